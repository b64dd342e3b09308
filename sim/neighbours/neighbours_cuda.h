#pragma once
// Neighbour lists on the GPU: see neighbours.h. Counted, scanned and filled; a thread traverses the
// list of its particle.

namespace drench::sim::cuda {

/// Calls visit(j, squared distance) for all neighbours of particle i within h, in the order of
/// cells.
template <class Filter, class Visit>
__device__ void for_each_within(const GridView& grid, const ConstVecView& position, int i, float h,
                                const Filter& filter, const Visit& visit) {
  const GridShape& g = grid.shape;
  const Vec3<float> p = position[i];
  bool tested = false;
  if constexpr (Filter::columns > 0) tested = filter.tests(i);
  for_each_run(grid, g.cell_x(p.x), g.cell_y(p.y), g.cell_z(p.z),
               [&](int begin, int end, Vec3<float> shift) {
                 const Vec3<float> seen = p - shift;  // from where they are
                 for (int j = begin; j < end; ++j) {
                   const float r2 = length2(position[j] - seen);
                   if (r2 >= h * h) continue;
                   if constexpr (Filter::columns > 0) {
                     if (tested && filter.hides(i, j, shift)) continue;
                   }
                   visit(j, r2);
                 }
               });
}

template <class Kernel, class Density, class Filter = NoFilter>
void build_neighbour_lists(Queue& queue, const GridView& grid, int n, const ConstVecView& position,
                           float h, NeighbourLists& lists, const Density& density,
                           const Filter& filter = {}) {
  lists.begin.resize(size_t(n) + 1), lists.blocks.resize(n);
  int* blocks = lists.blocks.data();
  parallel_for(queue, "neighbours: count", n, [=] __device__(int i) {
    BlockFiller filler;
    for_each_within(grid, position, i, h, filter, [&](int j, float) { filler.opens(j); });
    blocks[i] = filler.blocks;
  });
  exclusive_scan(queue, lists.blocks, n, lists.begin);
  const size_t all = value_at(lists.begin, n);
  if (lists.block.size() < all) lists.block.renew(all + all / 16), lists.base.renew(all + all / 16);
  NeighbourBlock* block = lists.block.data();
  int* base = lists.base.data();
  const unsigned* first = lists.begin.data();
  parallel_for(queue, "neighbours: fill", n, [=] __device__(int i) {
    BlockFiller filler;
    NeighbourBlock* to = block + first[i] - 1;
    float sum = 0.f;
    for_each_within(grid, position, i, h, filter, [&](int j, float r2) {
      const float u = max0(1.f - sqrtf(r2) / h);
      sum += Kernel::value(u);
      if (filler.opens(j)) *++to = {}, base[to - block] = j;
      to->offset[filler.used - 1] = uint16_t(2 * (j - filler.base));
      to->closeness[filler.used - 1] = uint16_t(rintf(u * NeighbourBlock::unit));
    });
    density(i, sum);
  });
}

template <class Physics>
__global__ void launch_neighbours(NeighbourView list, int n, Physics physics) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= n || physics.idle()) return;
  constexpr int N = Physics::columns;
  using P = typename Physics::template Particle<Quad>;
  using S = typename Physics::template Sum<Quad>;
  const auto inputs = physics.inputs();
  const auto load = [&](int k) {
    Members<P, float4, N> m;
    for (int c = 0; c < N; ++c)
      m.value[c] = __ldg(reinterpret_cast<const float4*>(inputs.column[c]) + k);
    return m.as();
  };
  const P self = load(i);
  S sum{};
  const auto pair = [&](int j, unsigned closeness) {
    const float w = physics.weight(float(closeness) * (1.f / NeighbourBlock::unit));
    physics.pair(self, load(j), Quad{w, w, w, w}, sum);
  };
  const auto two = [&](int base, unsigned offset, unsigned closeness) {
    pair(base + int((offset & 0xffff) >> 1), closeness & 0xffff);
    pair(base + int(offset >> 17), closeness >> 16);
  };
  const uint4* block = reinterpret_cast<const uint4*>(list.block + list.begin[i]);
  const int* base = list.base + list.begin[i];
  for (int b = 0; b < list.blocks[i]; ++b) {
    const uint4 o = __ldg(block + 2 * b), u = __ldg(block + 2 * b + 1);
    const int from = __ldg(base + b);
    two(from, o.x, u.x), two(from, o.y, u.y);
    if ((u.z | u.w) == 0) continue;
    two(from, o.z, u.z), two(from, o.w, u.w);
  }
  typename Physics::template Sum<Float4> out;
  static_assert(sizeof out == sizeof sum, "a sum has as many members of either type");
  memcpy(&out, &sum, sizeof out);
  physics.finish(i, out);
}

template <class Physics>
void for_each_neighbour(Queue& queue, const char* name, const NeighbourLists& lists, int n,
                        const Physics& physics) {
  if (n <= 0) return;
  launch_neighbours<<<(n + 127) / 128, 128, 0, queue.stream()>>>(view_of(lists), n, physics);
  check_cuda(cudaGetLastError(), name);
}

}  // namespace drench::sim::cuda
