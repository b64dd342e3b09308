// Graphs: nodes, executable copies, launches, conditional nodes.

#include <algorithm>
#include <random>
#include <set>

#include "tests/gpu/emulator/streams.h"

namespace gpu_emulator {

namespace {

using Node = cudaGraphNode_t;

constexpr u32 most_turns = 1'000'000;  // of a WHILE node

struct Condition {
  u32 start = 0;
  bool assign = false;  // the start, at each launch
  bool used = false, runs = false, set = false;
  u32 value = 0, launch = 0, thread = 0;  // and which launch and thread have set it
};
std::map<u64, Condition> conditions;  // by handle

bool has_conditions(const CUgraph_st& g) {
  return std::any_of(g.nodes.begin(), g.nodes.end(),
                     [](const auto& n) { return n->type == cudaGraphNodeTypeConditional; });
}
void for_conditions(const CUgraph_st& g, const auto& what) {
  for (const u64 handle : g.handles) what(conditions.at(handle));
  for (const auto& n : g.nodes)
    for (const auto& body : n->bodies) for_conditions(*body, what);
}
void forget(const CUgraph_st& g) {
  remember(&g, false);
  for (const auto& n : g.nodes)
    for (const auto& body : n->bodies) forget(*body);
}

void copy_graph(const CUgraph_st& from, CUgraph_st& to, std::map<Node, Node>& copies) {
  to.handles = from.handles;
  for (const auto& n : from.nodes) {
    const Node m = copies[n.get()] = add_node(&to, n->type, n->task, {});
    m->enabled = n->enabled, m->handle = n->handle, m->condition = n->condition;
    for (const auto& body : n->bodies) {
      m->bodies.push_back(std::make_unique<CUgraph_st>());
      copy_graph(*body, *m->bodies.back(), copies);
    }
  }
  for (const auto& n : from.nodes)
    for (const Node need : n->needs) copies[n.get()]->needs.push_back(copies.at(need));
}

/// An order in which each node comes after what it needs; not all nodes, if they need each other.
std::vector<Node> in_order(const CUgraph_st& g) {
  static std::mt19937 random(1);
  const auto how = settings().order;
  std::map<Node, size_t> missing;
  std::map<Node, std::vector<Node>> next;
  std::vector<Node> ready, order;
  for (const auto& n : g.nodes) {
    missing[n.get()] = n->needs.size();
    for (const Node need : n->needs) next[need].push_back(n.get());
    if (n->needs.empty()) ready.push_back(n.get());
  }
  while (!ready.empty()) {
    const size_t k = how == Settings::Order::reverse    ? ready.size() - 1
                     : how == Settings::Order::shuffled ? random() % ready.size()
                                                        : 0;
    order.push_back(ready[k]);
    ready.erase(ready.begin() + long(k));
    for (const Node other : next[order.back()])
      if (--missing[other] == 0) ready.push_back(other);
  }
  return order;
}

/// Nodes that follow each other get one timeline, branches others.
void lay_out(const CUgraph_st& g, std::vector<u32>& timelines, u32 first) {
  std::set<Node> continued;
  for (const Node n : in_order(g)) {
    for (const Node need : n->needs)
      if (n->timeline == 0 && continued.insert(need).second) n->timeline = need->timeline;
    if (n->timeline == 0) n->timeline = std::exchange(first, 0);
    if (n->timeline == 0) timelines.push_back(n->timeline = new_timeline());
    for (const auto& body : n->bodies) lay_out(*body, timelines, n->timeline);
  }
}

/// @return why a graph cannot be instantiated, or success.
cudaError_t check_graph(const CUgraph_st& g, bool in_condition) {
  const char* const call = "cudaGraphInstantiate";
  if (in_order(g).size() != g.nodes.size())
    return refuse(call, cudaErrorInvalidValue, "finds nodes that need each other");
  for (const auto& n : g.nodes) {
    const bool conditional = n->type == cudaGraphNodeTypeConditional;
    if (in_condition && n->type == cudaGraphNodeTypeHost)
      return refuse(call, cudaErrorNotSupported, "finds a host function in a conditional body");
    for (const auto& body : n->bodies)
      if (const cudaError_t error = check_graph(*body, in_condition || conditional)) return error;
  }
  for (const u64 handle : g.handles)
    if (!conditions.at(handle).used)
      return refuse(call, cudaErrorInvalidValue, "finds a handle that no conditional node uses");
  return cudaSuccess;
}

cudaError_t run(CUgraph_st& g, Clock& clock);

cudaError_t run_condition(CUgraphNode_st& n) {
  const Condition& c = conditions.at(n.handle);
  if (!c.set) say("UNDEFINED CONDITION: nothing has set its value, %s", after_launch().c_str());
  for (u32 turn = 0; turn < most_turns; ++turn) {
    begin_operation(n.timeline, n.over, "graph", "condition");
    const size_t body = n.condition == cudaGraphCondTypeSwitch ? c.value : c.value == 0;
    if (body >= n.bodies.size()) return cudaSuccess;
    if (const cudaError_t error = run(*n.bodies[body], n.over)) return error;
    if (n.condition != cudaGraphCondTypeWhile) return cudaSuccess;
  }
  return refuse("cudaGraphLaunch", cudaErrorIllegalAddress, "runs a WHILE node that does not end");
}

cudaError_t run(CUgraph_st& g, Clock& clock) {
  const Clock start = clock;
  for (const Node n : in_order(g)) {
    n->over = start;
    for (const Node need : n->needs) join(n->over, need->over);
    const cudaError_t error = n->type == cudaGraphNodeTypeConditional ? run_condition(*n)
                              : n->type == cudaGraphNodeTypeGraph     ? run(*n->bodies[0], n->over)
                              : n->enabled ? perform(n->task, n->timeline, n->over, "graph")
                                           : cudaSuccess;
    if (error) return error;
    join(clock, n->over);
  }
  return cudaSuccess;
}

/// Could the nodes of an executable graph get the parameters of another graph's, one by one?
cudaError_t compare(const CUgraph_st& from, const CUgraph_st& to,
                    cudaGraphExecUpdateResultInfo& info) {
  const auto differs = [&](cudaGraphExecUpdateResult result, Node n) {
    info.result = result, info.errorNode = n;
    return cudaErrorGraphExecUpdateFailure;
  };
  if (from.nodes.size() != to.nodes.size())
    return differs(cudaGraphExecUpdateErrorTopologyChanged, nullptr);
  std::map<Node, Node> pair;
  for (size_t k = 0; k < from.nodes.size(); ++k) pair[from.nodes[k].get()] = to.nodes[k].get();
  for (const auto& n : from.nodes) {
    const CUgraphNode_st& m = *pair[n.get()];
    bool same = n->needs.size() == m.needs.size() && n->bodies.size() == m.bodies.size();
    for (size_t k = 0; same && k < m.needs.size(); ++k) same = pair[n->needs[k]] == m.needs[k];
    if (n->type != m.type) return differs(cudaGraphExecUpdateErrorNodeTypeChanged, n.get());
    if (!same) return differs(cudaGraphExecUpdateErrorTopologyChanged, n.get());
    if (n->task.cooperative != m.task.cooperative)
      return differs(cudaGraphExecUpdateErrorAttributesChanged, n.get());
    if (n->handle != m.handle || n->task.direction != m.task.direction)
      return differs(cudaGraphExecUpdateErrorParametersChanged, n.get());
    for (size_t k = 0; k < n->bodies.size(); ++k)
      if (const cudaError_t error = compare(*n->bodies[k], *m.bodies[k], info)) return error;
  }
  return cudaSuccess;
}
void update(const CUgraph_st& from, CUgraph_st& to) {
  for (size_t k = 0; k < from.nodes.size(); ++k) {
    to.nodes[k]->task = from.nodes[k]->task;
    for (size_t b = 0; b < from.nodes[k]->bodies.size(); ++b)
      update(*from.nodes[k]->bodies[b], *to.nodes[k]->bodies[b]);
  }
}

// What nodes do, from their parameters in either version of the API.
Task kernel_of_node(const auto& p) {
  return kernel_task(p.func, p.gridDim, p.blockDim, p.kernelParams, p.sharedMemBytes);
}
Task fill_of_node(const auto& p) {
  return {.kind = p.height == 1 ? Task::Kind::fill : Task::Kind::claim,
          .name = "a memset node",
          .to = p.dst,
          .size = p.width * p.elementSize,
          .value = p.value,
          .element = p.elementSize};
}
Task copy_of_node(void* to, const void* from, size_t size, cudaMemcpyKind direction) {
  return {.kind = Task::Kind::copy,
          .name = "a memcpy node",
          .to = to,
          .from = from,
          .size = size,
          .direction = direction};
}
Task copy_of_node(const cudaMemcpy3DParms& p) {
  Task t = copy_of_node(static_cast<char*>(p.dstPtr.ptr) + p.dstPos.x,
                        static_cast<char*>(p.srcPtr.ptr) + p.srcPos.x, p.extent.width, p.kind);
  if (p.srcArray || p.dstArray || p.extent.height != 1 || p.extent.depth != 1)
    t.kind = Task::Kind::claim;
  return t;
}
Task call_of_node(const auto& p) {
  return {.kind = Task::Kind::call, .name = "a host node", .function = p.fn, .data = p.userData};
}

cudaError_t add(Node* out, cudaGraph_t graph, const Node* needs, size_t count, const Task& task) {
  if (!exists(graph)) return refuse("cudaGraphAddNode", cudaErrorInvalidResourceHandle);
  if (task.kind == Task::Kind::claim)
    return refuse("cudaGraphAddNode", cudaErrorNotSupported, "is asked for arrays or several rows");
  if (const cudaError_t error = check(task)) return error;
  *out = add_node(graph, type_of(task), task, {needs, needs + count});
  return cudaSuccess;
}
cudaError_t set(cudaGraphExec_t exec, Node node, Task task) {
  const char* const call = "cudaGraphExecNodeSetParams";
  if (!exists(exec)) return refuse(call, cudaErrorInvalidResourceHandle);
  const auto found = exec->nodes.find(node);
  if (found == exec->nodes.end() || found->second->type != type_of(task))
    return refuse(call, cudaErrorInvalidValue, "is given a node of another graph or type");
  task.cooperative = found->second->task.cooperative;
  if (const cudaError_t error = check(task)) return error;
  return found->second->task = task, cudaSuccess;
}

}  // namespace

cudaGraphNodeType type_of(const Task& t) {
  return t.kind == Task::Kind::kernel ? cudaGraphNodeTypeKernel
         : t.kind == Task::Kind::copy ? cudaGraphNodeTypeMemcpy
         : t.kind == Task::Kind::fill ? cudaGraphNodeTypeMemset
         : t.kind == Task::Kind::call ? cudaGraphNodeTypeHost
                                      : cudaGraphNodeTypeEmpty;
}
Node add_node(cudaGraph_t graph, cudaGraphNodeType type, const Task& task,
              const std::vector<Node>& needs) {
  graph->nodes.push_back(std::unique_ptr<CUgraphNode_st>(new CUgraphNode_st{type, task, needs}));
  return graph->nodes.back().get();
}

void set_conditional(Thread& t, u32 site, u64 handle, u32 value) {
  const auto found = conditions.find(handle);
  if (found == conditions.end() || !found->second.runs) {
    say("cudaGraphSetConditional: the handle is of no graph that runs now");
    fault_trap(t, site);
  }
  Condition& c = found->second;
  const u32 launch = current_launch().serial,
            thread = t.block->index * t.ntid[0] * t.ntid[1] * t.ntid[2] + t.rank;
  if (settings().race && c.launch == launch && c.thread != thread && c.value != value)
    say("RACE, threads of one launch set a condition to %u and %u, %s", c.value, value,
        after_launch().c_str());
  c.value = value, c.set = true, c.launch = launch, c.thread = thread;
}

}  // namespace gpu_emulator

using namespace gpu_emulator;

extern "C" {

// Making graphs
// -------------------------------------------------------------------------------------------

cudaError_t cudaGraphCreate(cudaGraph_t* graph, unsigned) {
  *graph = new CUgraph_st;
  return remember(*graph, true), cudaSuccess;
}
cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  if (!exists(graph)) return refuse("cudaGraphDestroy", cudaErrorInvalidResourceHandle);
  forget(*graph);
  delete graph;
  return cudaSuccess;
}
cudaError_t cudaGraphAddKernelNode(cudaGraphNode_t* node, cudaGraph_t graph,
                                   const cudaGraphNode_t* needs, size_t count,
                                   const cudaKernelNodeParams* p) {
  return add(node, graph, needs, count, kernel_of_node(*p));
}
cudaError_t cudaGraphAddMemcpyNode(cudaGraphNode_t* node, cudaGraph_t graph,
                                   const cudaGraphNode_t* needs, size_t count,
                                   const cudaMemcpy3DParms* p) {
  return add(node, graph, needs, count, copy_of_node(*p));
}
cudaError_t cudaGraphAddMemcpyNode1D(cudaGraphNode_t* node, cudaGraph_t graph,
                                     const cudaGraphNode_t* needs, size_t count, void* to,
                                     const void* from, size_t size, cudaMemcpyKind kind) {
  return add(node, graph, needs, count, copy_of_node(to, from, size, kind));
}
cudaError_t cudaGraphAddMemsetNode(cudaGraphNode_t* node, cudaGraph_t graph,
                                   const cudaGraphNode_t* needs, size_t count,
                                   const cudaMemsetParams* p) {
  return add(node, graph, needs, count, fill_of_node(*p));
}
cudaError_t cudaGraphAddHostNode(cudaGraphNode_t* node, cudaGraph_t graph,
                                 const cudaGraphNode_t* needs, size_t count,
                                 const cudaHostNodeParams* p) {
  return add(node, graph, needs, count, call_of_node(*p));
}
cudaError_t cudaGraphAddEmptyNode(cudaGraphNode_t* node, cudaGraph_t graph,
                                  const cudaGraphNode_t* needs, size_t count) {
  return add(node, graph, needs, count, {});
}
cudaError_t cudaGraphAddChildGraphNode(cudaGraphNode_t* node, cudaGraph_t graph,
                                       const cudaGraphNode_t* needs, size_t count,
                                       cudaGraph_t child) {
  const char* const call = "cudaGraphAddChildGraphNode";
  if (!exists(graph) || !exists(child)) return refuse(call, cudaErrorInvalidResourceHandle);
  if (has_conditions(*child)) return refuse(call, cudaErrorNotSupported, "conditional nodes");
  *node = add_node(graph, cudaGraphNodeTypeGraph, {}, {needs, needs + count});
  std::map<Node, Node> copies;
  (*node)->bodies.push_back(std::make_unique<CUgraph_st>());
  return copy_graph(*child, *(*node)->bodies[0], copies), cudaSuccess;
}
cudaError_t cudaGraphConditionalHandleCreate(cudaGraphConditionalHandle* handle, cudaGraph_t graph,
                                             unsigned value, unsigned flags) {
  const char* const call = "cudaGraphConditionalHandleCreate";
  static u64 next = 0x600d'0000'0001;  // no other number is likely to be one
  if (!exists(graph)) return refuse(call, cudaErrorInvalidResourceHandle);
  graph->handles.push_back(*handle = next++);
  conditions[*handle] = {value, flags == cudaGraphCondAssignDefault};
  return cudaSuccess;
}
cudaError_t cudaGraphAddNode(cudaGraphNode_t* node, cudaGraph_t graph, const cudaGraphNode_t* needs,
                             const cudaGraphEdgeData*, size_t count, cudaGraphNodeParams* p) {
  const char* const call = "cudaGraphAddNode";
  if (p->type == cudaGraphNodeTypeKernel)
    return add(node, graph, needs, count, kernel_of_node(p->kernel));
  if (p->type == cudaGraphNodeTypeMemcpy)
    return add(node, graph, needs, count, copy_of_node(p->memcpy.copyParams));
  if (p->type == cudaGraphNodeTypeMemset)
    return add(node, graph, needs, count, fill_of_node(p->memset));
  if (p->type == cudaGraphNodeTypeHost)
    return add(node, graph, needs, count, call_of_node(p->host));
  if (p->type == cudaGraphNodeTypeEmpty) return add(node, graph, needs, count, {});
  if (p->type == cudaGraphNodeTypeGraph)
    return cudaGraphAddChildGraphNode(node, graph, needs, count, p->graph.graph);
  if (p->type != cudaGraphNodeTypeConditional) return refuse(call, cudaErrorNotSupported);
  cudaConditionalNodeParams& c = p->conditional;
  const auto found = conditions.find(c.handle);
  if (!exists(graph) || found == conditions.end())
    return refuse(call, cudaErrorInvalidResourceHandle);
  const u32 most = c.type == cudaGraphCondTypeWhile ? 1 : c.type == cudaGraphCondTypeIf ? 2 : ~0u;
  if (found->second.used || c.size < 1 || c.size > most)
    return refuse(call, cudaErrorInvalidValue, "a handle used twice, or a wrong number of bodies");
  found->second.used = true;
  CUgraphNode_st& n = *(*node = add_node(graph, p->type, {}, {needs, needs + count}));
  n.handle = c.handle, n.condition = c.type;
  for (unsigned k = 0; k < c.size; ++k) {
    n.bodies.push_back(std::make_unique<CUgraph_st>());
    n.bodies_out.push_back(n.bodies.back().get());
    remember(n.bodies_out.back(), true);
  }
  return c.phGraph_out = n.bodies_out.data(), cudaSuccess;
}
cudaError_t cudaGraphGetNodes(cudaGraph_t graph, cudaGraphNode_t* nodes, size_t* count) {
  if (!exists(graph)) return refuse("cudaGraphGetNodes", cudaErrorInvalidResourceHandle);
  for (size_t k = 0; nodes && k < std::min(*count, graph->nodes.size()); ++k)
    nodes[k] = graph->nodes[k].get();
  return *count = graph->nodes.size(), cudaSuccess;
}
cudaError_t cudaGraphKernelNodeSetAttribute(cudaGraphNode_t node, cudaLaunchAttributeID id,
                                            const cudaLaunchAttributeValue* value) {
  if (id == cudaLaunchAttributeCooperative) node->task.cooperative = value->cooperative;
  return check(node->task);
}

// Executing them
// -------------------------------------------------------------------------------------------

cudaError_t cudaGraphInstantiate(cudaGraphExec_t* out, cudaGraph_t graph, unsigned long long) {
  const char* const call = "cudaGraphInstantiate";
  if (!exists(graph)) return refuse(call, cudaErrorInvalidResourceHandle);
  if (const cudaError_t error = check_graph(*graph, false)) return error;
  if (has_conditions(*graph) && graph->instances > 0)
    return refuse(call, cudaErrorNotSupported, "conditional nodes are instantiated once at a time");
  CUgraphExec_st& exec = *(*out = new CUgraphExec_st);
  exec.source = graph, ++graph->instances;
  copy_graph(*graph, exec.graph, exec.nodes);
  lay_out(exec.graph, exec.timelines, 0);
  return remember(*out, true), cudaSuccess;
}
cudaError_t cudaGraphInstantiateWithFlags(cudaGraphExec_t* out, cudaGraph_t graph,
                                          unsigned long long flags) {
  return cudaGraphInstantiate(out, graph, flags);
}
cudaError_t cudaGraphExecDestroy(cudaGraphExec_t exec) {
  if (!exists(exec)) return refuse("cudaGraphExecDestroy", cudaErrorInvalidResourceHandle);
  if (exists(exec->source)) --exec->source->instances;
  for (const u32 timeline : exec->timelines) free_timeline(timeline);
  remember(exec, false);
  delete exec;
  return cudaSuccess;
}
cudaError_t cudaGraphUpload(cudaGraphExec_t, cudaStream_t) { return cudaSuccess; }
cudaError_t cudaGraphLaunch(cudaGraphExec_t exec, cudaStream_t handle) {
  const char* const call = "cudaGraphLaunch";
  const cudaStream_t s = stream_of(handle);
  if (!s || !exists(exec)) return refuse(call, cudaErrorInvalidResourceHandle);
  if (s->capture) {
    s->capture->valid = false;
    return refuse(call, cudaErrorNotSupported, "is captured; use cudaGraphAddChildGraphNode");
  }
  if (const cudaError_t error = enter(call, s)) return error;
  join(s->clock, exec->over);  // it runs once at a time
  begin_operation(s->timeline, s->clock, "stream", "graph launch");
  for_conditions(exec->graph, [](Condition& c) {
    if (c.assign) c.value = c.start, c.set = true;
    c.runs = true;
  });
  const cudaError_t error = run(exec->graph, s->clock);
  for_conditions(exec->graph, [](Condition& c) { c.runs = false; });
  exec->over = s->clock;
  return leave(s), error;
}
cudaError_t cudaGraphExecUpdate(cudaGraphExec_t exec, cudaGraph_t graph,
                                cudaGraphExecUpdateResultInfo* info) {
  *info = {};
  if (!exists(exec) || !exists(graph))
    return refuse("cudaGraphExecUpdate", cudaErrorInvalidResourceHandle);
  if (const cudaError_t error = compare(*graph, exec->graph, *info)) return fail(error);
  return update(*graph, exec->graph), cudaSuccess;
}
cudaError_t cudaGraphExecKernelNodeSetParams(cudaGraphExec_t exec, cudaGraphNode_t node,
                                             const cudaKernelNodeParams* p) {
  return set(exec, node, kernel_of_node(*p));
}
cudaError_t cudaGraphExecMemcpyNodeSetParams1D(cudaGraphExec_t exec, cudaGraphNode_t node, void* to,
                                               const void* from, size_t size, cudaMemcpyKind kind) {
  return set(exec, node, copy_of_node(to, from, size, kind));
}
cudaError_t cudaGraphExecMemsetNodeSetParams(cudaGraphExec_t exec, cudaGraphNode_t node,
                                             const cudaMemsetParams* p) {
  return set(exec, node, fill_of_node(*p));
}
cudaError_t cudaGraphNodeSetEnabled(cudaGraphExec_t exec, cudaGraphNode_t node, unsigned enabled) {
  if (!exists(exec) || !exec->nodes.count(node))
    return refuse("cudaGraphNodeSetEnabled", cudaErrorInvalidResourceHandle);
  return exec->nodes[node]->enabled = enabled, cudaSuccess;
}

}  // extern "C"
