#pragma once
// A column of the simulation state: an array with capacity in the memory of the backend.

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "sim/backend/backend.h"

#if defined(__CUDACC__)
#include "sim/backend/cuda_check.h"
#else
#include <cstring>
#endif

namespace drench::sim::DRENCH_BACKEND {

#if defined(__CUDACC__)

class Queue;

template <class T>
class Column {
 public:
  Column() = default;
  Column(Column&& other) noexcept { swap(other); }
  Column& operator=(Column&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Column() { cudaFree(data_); }

  void resize(size_t size) {  // contents are kept, new elements are 0
    if (size > capacity_) {   // grown by halves so that emitters rarely copy
      const size_t capacity = capacity_ ? size + size / 2 : size;
      T* data = nullptr;
      check_cuda(cudaMalloc(&data, capacity * sizeof(T)), "allocating a column");
      check_cuda(cudaMemset(data, 0, capacity * sizeof(T)), "clearing a column");
      if (size_) {
        check_cuda(cudaMemcpy(data, data_, size_ * sizeof(T), cudaMemcpyDeviceToDevice),
                   "growing a column");
      }
      cudaFree(data_);
      data_ = data, capacity_ = capacity, used_ = size_;
    }
    const size_t used = std::min(size, used_);  // a larger size may have left something there
    if (used > size_) {
      check_cuda(cudaMemset(data_ + size_, 0, (used - size_) * sizeof(T)), "clearing a column");
    }
    size_ = size, used_ = std::max(size, used_);
  }
  void renew(size_t size) {  // contents are lost; never holds old and new memory at once
    *this = {};
    resize(size);
  }
  void upload(const T* source, size_t size, size_t at = 0) {
    if (size == 0) return;
    check_cuda(cudaMemcpy(data_ + at, source, size * sizeof(T), cudaMemcpyHostToDevice),
               "uploading");
  }
  void download(T* target, size_t size) const {
    if (size == 0) return;
    check_cuda(cudaMemcpy(target, data_, size * sizeof(T), cudaMemcpyDeviceToHost), "downloading");
  }
  void clear_bytes(Queue& queue, int byte);  // queue.h
  T* data() { return data_; }
  const T* data() const { return data_; }
  size_t size() const { return size_; }
  size_t capacity() const { return capacity_; }  // elements that memory is held for
  void swap(Column& other) noexcept {
    std::swap(data_, other.data_), std::swap(size_, other.size_),
        std::swap(capacity_, other.capacity_), std::swap(used_, other.used_);
  }

 private:
  T* data_ = nullptr;
  size_t size_ = 0, capacity_ = 0, used_ = 0;  // the largest size since memory was taken
};

#else

struct Queue;

/// Eight elements of room stand behind the last one, so that a pack may be read where the column
/// ends.
template <class T>
class Column {
 public:
  void resize(size_t size) {  // contents are kept, new elements are 0, and the room
    data_.resize(std::min(size, size_)), data_.resize(size + 8);
    size_ = size;
  }
  void renew(size_t size) {  // contents are lost; never holds old and new memory at once
    *this = {};
    resize(size);
  }
  void upload(const T* source, size_t size, size_t at = 0) {
    if (size) std::memcpy(data_.data() + at, source, size * sizeof(T));
  }
  void download(T* target, size_t size) const {
    if (size) std::memcpy(target, data_.data(), size * sizeof(T));
  }
  void clear_bytes(Queue& queue, int byte);  // queue.h
  T* data() { return data_.data(); }
  const T* data() const { return data_.data(); }
  size_t size() const { return size_; }
  size_t capacity() const { return data_.capacity(); }
  void swap(Column& other) noexcept { data_.swap(other.data_), std::swap(size_, other.size_); }

 private:
  std::vector<T> data_;
  size_t size_ = 0;
};

#endif

template <class T>
std::vector<T> to_host(const Column<T>& column, size_t size) {
  std::vector<T> host(size);
  column.download(host.data(), size);
  return host;
}
/// One value, read back.
template <class T>
T value_at(const Column<T>& column, size_t index) {
#if defined(__CUDACC__)
  T value;
  check_cuda(cudaMemcpy(&value, column.data() + index, sizeof(T), cudaMemcpyDeviceToHost),
             "reading back");
  return value;
#else
  return column.data()[index];
#endif
}
template <class T>
void from_host(Column<T>& column, const std::vector<T>& host) {
  column.resize(host.size());
  column.upload(host.data(), host.size());
}

}  // namespace drench::sim::DRENCH_BACKEND
