#pragma once
// Work whose parts follow each other without the host: a body that asks a team to do them, in loops
// that end where the data are. On a GPU the body is one cooperative launch, whose threads all run
// it and meet after each part; on the CPU it is host code.
//
//     run_together(queue, "solve", n, body);    // body(team), with
//     team.for_each(n, f);                       // f(0..n-1)
//     team.for_each_lane(n, f);                  // eight at once on a CPU core
//     team.sum_lanes(n, f, then);                // f returns Two; then(a, b) once
//     team.alone(f);                             // f(one): for_each, by one block
//     team.for_each_alone(n, f);                 // f(one, k): each by one block; one.sum
//
// Sums do not depend on how many threads there are.

#include "sim/backend/parallel.h"

#if defined(__CUDACC__)
#include <cooperative_groups.h>
#endif

namespace drench::sim::DRENCH_BACKEND {

#if defined(__CUDACC__)

constexpr int team_block = 128, team_partials = 1024;

/// One block of a team.
struct OneOfTeam {
  template <class F>
  __device__ void for_each(int n, const F& f) const {
    for (int i = threadIdx.x; i < n; i += team_block) f(i);
    __syncthreads();
  }
  template <class F>
  __device__ void for_each_lane_of(int first, int n, const F& f) const {
    for_each(n, [&](int i) { f(first + i); });
  }
  /// Of f(0..n-1), to all threads.
  template <class T, class F>
  __device__ T sum(int n, T start, const F& f) const {
    for (int i = threadIdx.x; i < n; i += team_block) start = start + f(i);
    return sum_of_block(start);
  }
  template <class T>
  static __device__ T sum_of_block(const T& value) {
    __shared__ alignas(16) char raw[team_block * sizeof(T)];
    T* shared = reinterpret_cast<T*>(raw);
    __syncthreads();
    shared[threadIdx.x] = value;
    for (int half = team_block / 2; half > 0; half /= 2) {
      __syncthreads();
      if (threadIdx.x < half)
        shared[threadIdx.x] = shared[threadIdx.x] + shared[threadIdx.x + half];
    }
    __syncthreads();
    return shared[0];
  }
};

class Team {
 public:
  explicit __device__ Team(Two<double>* partial) : partial_(partial) {}

  template <class F>
  __device__ void for_each(int n, const F& f) const {
    for (int i = blockIdx.x * team_block + threadIdx.x; i < n; i += gridDim.x * team_block) f(i);
    meet();
  }
  template <class F>
  __device__ void for_each_lane(int n, const F& f) const {
    for_each(n, f);
  }
  template <class F, class Then>
  __device__ void sum_lanes(int n, const F& f, const Then& then) const {
    const int parts = (n + team_block - 1) / team_block,
              partials = parts < team_partials ? parts : team_partials;
    for (int b = blockIdx.x; b < partials; b += gridDim.x) {
      Two<double> sum{0., 0.};
      for (int i = b * team_block + threadIdx.x; i < n; i += partials * team_block) {
        const Two<float> one = f(i);
        sum = sum + Two<double>{one.a, one.b};
      }
      sum = OneOfTeam::sum_of_block(sum);
      if (threadIdx.x == 0) partial_[b] = sum;
    }
    meet();
    if (blockIdx.x == 0) {
      Two<double> sum{0., 0.};
      for (int b = threadIdx.x; b < partials; b += team_block) sum = sum + partial_[b];
      sum = OneOfTeam::sum_of_block(sum);
      if (threadIdx.x == 0) then(sum.a, sum.b);
    }
    meet();
  }
  template <class F>
  __device__ void alone(const F& f) const {
    if (blockIdx.x == 0) f(OneOfTeam{});
    meet();
  }
  template <class F>
  __device__ void for_each_alone(int n, const F& f) const {
    for (int k = blockIdx.x; k < n; k += gridDim.x) f(OneOfTeam{}, k);
    meet();
  }

 private:
  static __device__ void meet() { cooperative_groups::this_grid().sync(); }

  Two<double>* partial_;
};

template <class Body>
__global__ void __launch_bounds__(team_block)
    launch_together(const __grid_constant__ Body body, Two<double>* partial) {
  body(Team(partial));
}

/// Blocks of a cooperative kernel that the device holds at once.
template <class Kernel>
int blocks_at_once(Kernel kernel, const char* name) {
  int device = 0, processors = 0, each = 0;
  check_cuda(cudaGetDevice(&device), name);
  check_cuda(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device), name);
  check_cuda(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&each, kernel, team_block, 0), name);
  return processors * each;
}

/// @param n  the most indices of a part that is worth a thread for each
template <class Body>
void run_together(Queue& queue, const char* name, int n, const Body& body) {
  static const int most = blocks_at_once(launch_together<Body>, name);
  Two<double>* partial = queue.partial<Two<double>>(team_partials);
  void* arguments[] = {const_cast<Body*>(&body), &partial};
  const int blocks = std::clamp((n + team_block - 1) / team_block, 1, most);
  check_cuda(cudaLaunchCooperativeKernel(launch_together<Body>, dim3(blocks), dim3(team_block),
                                         arguments, 0, queue.stream()),
             name);
}

#else

class Team {
 public:
  Team(Queue& queue, const char* name) : queue_(queue), name_(name) {}

  template <class F>
  void for_each(int n, const F& f) const {
    parallel_for(queue_, name_, n, f);
  }
  template <class F>
  void for_each_lane(int n, const F& f) const {
    sim::cpu::for_each_lane(queue_, name_, n, f);
  }
  template <class F>
  void for_each_lane_of(int first, int n, const F& f) const {
    for_each_lane(n, [&](Lanes i) { f(Lanes{first + i.base}); });
  }
  template <class F, class Then>
  void sum_lanes(int n, const F& f, const Then& then) const {
    sum_lanes_then(queue_, name_, n, f, then);
  }
  template <class T, class F>
  T sum(int n, T start, const F& f) const {
    return parallel_reduce(queue_, name_, n, start, f, Plus{});
  }
  template <class F>
  void alone(const F& f) const {
    f(*this);
  }
  template <class F>
  void for_each_alone(int n, const F& f) const {
    for (int k = 0; k < n; ++k) f(*this, k);
  }

 private:
  Queue& queue_;
  const char* name_;
};
using OneOfTeam = Team;

template <class Body>
void run_together(Queue& queue, const char* name, int, const Body& body) {
  body(Team(queue, name));
}

#endif

}  // namespace drench::sim::DRENCH_BACKEND
