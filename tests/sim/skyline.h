#pragma once
// Direct solution of symmetric systems by L D L^T within their envelope: rows from their first
// entry to the diagonal (Jennings 1966). The caller numbers unknowns so that the rows are short.

#include <algorithm>
#include <cmath>
#include <vector>

namespace drench::sim_tests {

class Skyline {
 public:
  /// @param first  of every row: the column of its first entry.
  explicit Skyline(const std::vector<int>& first) : first_(first), row_(first.size()) {
    for (size_t i = 0; i < first.size(); ++i) row_[i].assign(i + 1 - size_t(first[i]), 0.0);
  }
  void clear() {
    for (auto& row : row_) std::fill(row.begin(), row.end(), 0.0);
  }
  /// Of the lower triangle: row >= column.
  double& at(int row, int column) {
    return row_[size_t(row)][size_t(column - first_[size_t(row)])];
  }

  /// In place. @return how many pivots are not positive: as many eigenvalues are negative
  ///         (Sylvester's law of inertia).
  int factor() {
    int negative = 0;
    const int n = int(row_.size());
    std::vector<double> scaled;
    pivot_.assign(row_.size(), 0.0);
    for (int i = 0; i < n; ++i) {
      auto& row = row_[size_t(i)];
      const int begin = first_[size_t(i)];
      for (int j = begin; j < i; ++j) {  // L_ij d_j
        const auto& other = row_[size_t(j)];
        const int from = std::max(begin, first_[size_t(j)]);
        double sum = row[size_t(j - begin)];
        const double* a = row.data() + (from - begin);
        const double* b = other.data() + (from - first_[size_t(j)]);
        for (int k = 0; k < j - from; ++k) sum -= a[k] * b[k];
        row[size_t(j - begin)] = sum;
      }
      double pivot = row.back();
      for (int j = begin; j < i; ++j) {
        const double whole = row[size_t(j - begin)];
        row[size_t(j - begin)] = whole / pivot_[size_t(j)];
        pivot -= whole * row[size_t(j - begin)];
      }
      if (!(pivot > 0)) ++negative;
      pivot_[size_t(i)] = pivot;
    }
    return negative;
  }
  std::vector<double> solve(std::vector<double> b) const {
    const int n = int(row_.size());
    for (int i = 0; i < n; ++i) {
      const auto& row = row_[size_t(i)];
      for (int j = first_[size_t(i)]; j < i; ++j)
        b[size_t(i)] -= row[size_t(j - first_[size_t(i)])] * b[size_t(j)];
    }
    for (int i = 0; i < n; ++i) b[size_t(i)] /= pivot_[size_t(i)];
    for (int i = n - 1; i >= 0; --i) {
      const auto& row = row_[size_t(i)];
      for (int j = first_[size_t(i)]; j < i; ++j)
        b[size_t(j)] -= row[size_t(j - first_[size_t(i)])] * b[size_t(i)];
    }
    return b;
  }

 private:
  std::vector<int> first_;
  std::vector<std::vector<double>> row_;
  std::vector<double> pivot_;
};

}  // namespace drench::sim_tests
