#pragma once
// What launches need beside the columns that they work on. A solver has a queue of its own, so that
// solvers of one process do not meet.

#include "sim/backend/column.h"

namespace drench::sim::DRENCH_BACKEND {

/// Scratch of sorts, kept between calls.
struct SortScratch {
  Column<int> histogram, order_in, key_out;
  Column<char> bytes;
};

#if defined(__CUDACC__)

/// A stream and scratch: launches of a queue follow each other. The stream is a blocking one, so
/// that the copies of columns, which go to the legacy default stream, stay in order with them.
class Queue {
 public:
  Queue() { check_cuda(cudaStreamCreate(&stream_), "creating a stream"); }
  Queue(const Queue&) = delete;
  Queue& operator=(const Queue&) = delete;
  ~Queue() { cudaStreamDestroy(stream_); }

  cudaStream_t stream() const { return stream_; }
  /// Room for n partial results of a reduction, until the next one.
  template <class T>
  T* partial(size_t n) {
    if (partial_.size() < n * sizeof(T)) partial_.renew(n * sizeof(T));
    return reinterpret_cast<T*>(partial_.data());
  }

  SortScratch sort;

 private:
  cudaStream_t stream_ = nullptr;
  Column<char> partial_;  // a few KiB, in no figure of memory
};

template <class T>
void Column<T>::clear_bytes(Queue& queue, int byte) {
  if (!size_) return;
  check_cuda(cudaMemsetAsync(data_, byte, size_ * sizeof(T), queue.stream()), "clearing");
}

#else

struct Queue {
  SortScratch sort;
};

template <class T>
void Column<T>::clear_bytes(Queue&, int byte) {
  if (!data_.empty()) std::memset(data_.data(), byte, data_.size() * sizeof(T));
}

#endif

}  // namespace drench::sim::DRENCH_BACKEND
