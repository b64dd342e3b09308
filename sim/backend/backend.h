#pragma once
// Physics is written once and compiled twice: by g++ for TBB and by nvcc for CUDA. Everything that
// is compiled twice lives in drench::sim::DRENCH_BACKEND, or the linker would merge the two
// silently.

#if defined(__CUDACC__)
#define DRENCH_BACKEND cuda
#define DRENCH_HD __host__ __device__ __forceinline__
#define DRENCH_HD_CALL __host__ __device__ __forceinline__
#define DRENCH_DEVICE __device__ __forceinline__
#define DRENCH_LAMBDA [=] __device__
#else
#define DRENCH_BACKEND cpu
#define DRENCH_HD inline __attribute__((always_inline))
#define DRENCH_HD_CALL inline __attribute__((noinline))
#define DRENCH_DEVICE inline
#define DRENCH_LAMBDA [=]
#endif
