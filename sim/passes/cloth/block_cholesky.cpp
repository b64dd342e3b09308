#include "sim/passes/cloth/block_cholesky.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sim/backend/pack.h"

namespace drench::sim {

namespace {

using cpu::Pack;

constexpr int smallest_part = 12;         // vertices that are not split
constexpr int panel = 24;                 // columns
constexpr size_t worth_a_task = 1 << 20;  // flops

/// c - a b, in every lane.
Pack less_product(Pack c, Pack a, Pack b) { return Pack(_mm256_fnmadd_ps(a.v, b.v, c.v)); }

/// Takes L L^T of the columns from `first` to before `last` from those from `last` on, in a lower
/// triangle of `rows` by columns.
void update(float* a, int rows, int first, int last) {
  constexpr int wide = 4, high = 2 * Pack::size;
  const size_t stride = size_t(rows);
  int j = last;
  for (; j + wide <= rows; j += wide) {
    int i = j;
    for (; i + high <= rows; i += high) {
      Pack sum[wide][2];
      for (int c = 0; c < wide; ++c)
        for (int h = 0; h < 2; ++h) sum[c][h] = Pack::load(a + (j + c) * stride + i + 8 * h);
      for (int k = first; k < last; ++k) {
        const float* column = a + k * stride;
        const Pack low = Pack::load(column + i), top = Pack::load(column + i + 8);
        for (int c = 0; c < wide; ++c) {
          const Pack by(column[j + c]);
          sum[c][0] = less_product(sum[c][0], low, by);
          sum[c][1] = less_product(sum[c][1], top, by);
        }
      }
      for (int c = 0; c < wide; ++c)
        for (int h = 0; h < 2; ++h) sum[c][h].store(a + (j + c) * stride + i + 8 * h);
    }
    for (; i < rows; ++i) {
      float sum[wide];
      for (int c = 0; c < wide; ++c) sum[c] = a[(j + c) * stride + i];
      for (int k = first; k < last; ++k) {
        const float* column = a + k * stride;
        for (int c = 0; c < wide; ++c) sum[c] -= column[i] * column[j + c];
      }
      for (int c = 0; c < wide; ++c) a[(j + c) * stride + i] = sum[c];
    }
  }
  for (; j < rows; ++j)
    for (int k = first; k < last; ++k)
      for (int i = j; i < rows; ++i) a[j * stride + i] -= a[k * stride + i] * a[k * stride + j];
}

/// The first `columns` columns of the factor of a lower triangle, and what they leave of the rest.
bool eliminate_columns(float* a, int rows, int columns) {
  bool positive = true;
  const size_t stride = size_t(rows);
  for (int first = 0; first < columns; first += panel) {
    const int last = std::min(first + panel, columns);
    for (int j = first; j < last; ++j) {
      float* column = a + j * stride;
      const float whole = column[j];
      for (int k = first; k < j; ++k) {
        const float* of = a + k * stride;
        const float by = of[j];
        for (int i = j; i < rows; ++i) column[i] -= of[i] * by;
      }
      const float least = 1e-6f * whole;
      if (!(column[j] > least)) positive = false, column[j] = std::max(std::abs(whole), 1e-30f);
      const float inverse = 1.f / std::sqrt(column[j]);
      for (int i = j; i < rows; ++i) column[i] *= inverse;
    }
    update(a, rows, first, last);
  }
  return positive;
}

}  // namespace

/// Splits sets of vertices by planes.
struct BlockCholesky::Dissection {
  const BlockPattern& pattern;
  std::span<const float> place;
  std::vector<int> position;  // of a vertex in the set that is split; -1: not in it
  std::vector<Front>& front;
  std::vector<int>& vertex;

  int longest_axis(const std::vector<int>& set) const {
    int axis = 0;
    float longest = -1.f;
    for (int d = 0; d < 3; ++d) {
      float low = 1e30f, high = -1e30f;
      for (const int v : set) {
        const float x = place[size_t(3 * v + d)];
        low = std::min(low, x), high = std::max(high, x);
      }
      if (high - low > longest) longest = high - low, axis = d;
    }
    return axis;
  }
  /// The first position that a vertex meets, or its own.
  int first_met(int v) const {
    int least = position[size_t(v)];
    for (int e = pattern.start[size_t(v)]; e < pattern.start[size_t(v) + 1]; ++e) {
      const int at = position[size_t(pattern.column[size_t(e)])];
      if (at >= 0) least = std::min(least, at);
    }
    return least;
  }
  /// Where of the middle fifth the separator, what is after the cut and meets what is before it,
  /// is smallest.
  int best_cut(const std::vector<int>& set) const {
    const int n = int(set.size());
    std::vector<int> change(size_t(n) + 1, 0);
    for (int k = 0; k < n; ++k)
      ++change[size_t(first_met(set[size_t(k)])) + 1], --change[size_t(k) + 1];
    int best = n / 2, least = n, size = 0;
    for (int cut = 0; cut <= n * 3 / 5; ++cut) {
      size += change[size_t(cut)];
      if (cut >= n * 2 / 5 && size < least) least = size, best = cut;
    }
    return best;
  }
  int add(std::vector<int> own, std::vector<int> child) {
    Front f;
    f.first = int(vertex.size()), f.own = int(own.size()), f.child = std::move(child);
    vertex.insert(vertex.end(), own.begin(), own.end());
    front.push_back(std::move(f));
    return int(front.size()) - 1;
  }
  int split(std::vector<int> set) {
    if (int(set.size()) <= smallest_part) return add(std::move(set), {});
    const int axis = longest_axis(set);
    std::sort(set.begin(), set.end(), [&](int a, int b) {
      const float x = place[size_t(3 * a + axis)], y = place[size_t(3 * b + axis)];
      return x != y ? x < y : a < b;
    });
    for (size_t k = 0; k < set.size(); ++k) position[size_t(set[k])] = int(k);
    const int cut = best_cut(set);
    std::vector<int> before(set.begin(), set.begin() + cut), after, separator;
    for (size_t k = size_t(cut); k < set.size(); ++k)
      (first_met(set[k]) < cut ? separator : after).push_back(set[k]);
    for (const int v : set) position[size_t(v)] = -1;
    if (before.empty() || after.empty()) return add(std::move(set), {});
    const int one = split(std::move(before)), other = split(std::move(after));
    return add(std::move(separator), {one, other});
  }
};

BlockCholesky::BlockCholesky(const BlockPattern& pattern, std::span<const float> place)
    : pattern_(pattern) {
  const size_t n = size_t(pattern.rows());
  std::vector<int> all(n);
  std::iota(all.begin(), all.end(), 0);
  Dissection dissection{pattern_, place, std::vector<int>(n, -1), front_, vertex_};
  if (n > 0) root_.push_back(dissection.split(std::move(all)));
  rank_.resize(n);
  for (size_t k = 0; k < n; ++k) rank_[size_t(vertex_[k])] = int(k);
  find_borders();
  right_.resize(3 * n);
}

void BlockCholesky::find_borders() {
  size_t entries = 0;
  for (Front& f : front_) {
    const int end = f.first + f.own;
    std::vector<int>& border = f.border;
    for (int k = f.first; k < end; ++k) {
      const size_t v = size_t(vertex_[size_t(k)]);
      for (int e = pattern_.start[v]; e < pattern_.start[v + 1]; ++e) {
        const int other = rank_[size_t(pattern_.column[size_t(e)])];
        if (other >= end) border.push_back(other);
      }
    }
    for (const int c : f.child)
      for (const int other : front_[size_t(c)].border)
        if (other >= end) border.push_back(other);
    std::sort(border.begin(), border.end());
    border.erase(std::unique(border.begin(), border.end()), border.end());
    for (const int c : f.child) {
      Front& below = front_[size_t(c)];
      for (const int other : below.border) {
        const bool own = other < end;
        const auto it = std::lower_bound(border.begin(), border.end(), other);
        below.at.push_back(own ? other - f.first : f.own + int(it - border.begin()));
      }
      f.work += below.work;
    }
    f.entry = entries, entries += size_t(f.rows()) * size_t(f.columns());
    double flops = 0;
    for (int j = 0; j < f.columns(); ++j) flops += double(f.rows() - j) * (f.rows() - j);
    flops_ += flops, f.work += size_t(flops);
  }
  entries_ = entries;
}

bool BlockCholesky::eliminate(Front& f, const float* block) {
  const int rows = f.rows(), end = f.first + f.own;
  const size_t stride = size_t(rows);
  std::vector<float> a(stride * stride, 0.f);
  const auto local = [&](int rank) {
    if (rank < end) return rank - f.first;
    return f.own + int(std::lower_bound(f.border.begin(), f.border.end(), rank) - f.border.begin());
  };
  for (int j = 0; j < f.own; ++j) {
    const size_t v = size_t(vertex_[size_t(f.first + j)]);
    for (int e = pattern_.start[v]; e < pattern_.start[v + 1]; ++e) {
      const int other = rank_[size_t(pattern_.column[size_t(e)])];
      if (other < f.first + j) continue;
      const float* b = block + 9 * size_t(e);  // row v, so its transpose stands below the diagonal
      float* to = a.data() + 3 * size_t(j) * stride + 3 * size_t(local(other));
      for (size_t c = 0; c < 3; ++c)
        for (size_t r = 0; r < 3; ++r) to[c * stride + r] = b[3 * c + r];
    }
  }
  for (const int c : f.child) {
    Front& below = front_[size_t(c)];
    const size_t n = 3 * below.at.size();
    for (size_t j = 0; j < n; ++j) {
      float* to = a.data() + (3 * size_t(below.at[j / 3]) + j % 3) * stride;
      const float* from = below.left.data() + j * n;
      for (size_t i = j / 3; i < below.at.size(); ++i)
        for (size_t r = 0; r < 3; ++r) to[3 * size_t(below.at[i]) + r] += from[3 * i + r];
    }
    std::vector<float>().swap(below.left);
  }
  const bool positive = eliminate_columns(a.data(), rows, f.columns());
  const size_t columns = size_t(f.columns()), left = stride - columns;
  std::copy_n(a.data(), stride * columns, factor_.data() + f.entry);
  f.left.assign(left * left, 0.f);
  for (size_t j = 0; j < left; ++j)
    std::copy_n(a.data() + (columns + j) * stride + columns + j, left - j,
                f.left.data() + j * left + j);
  return positive;
}

bool BlockCholesky::factor_below(int at, const float* block) {
  Front& f = front_[size_t(at)];
  bool positive[2] = {true, true};
  const int count = int(f.child.size());
  const auto child = [&](int k) { positive[k] = factor_below(f.child[size_t(k)], block); };
  if (f.work > worth_a_task)
    tbb::parallel_for(0, count, child);
  else
    for (int k = 0; k < count; ++k) child(k);
  const bool own = eliminate(f, block);
  return own && positive[0] && positive[1];
}

bool BlockCholesky::factor(std::span<const float> block) {
  factor_.resize(entries_);
  bool positive = true;
  for (const int root : root_) positive = factor_below(root, block.data()) && positive;
  return positive;
}

void BlockCholesky::lower(const Front& f, float* work) {
  const int rows = f.rows(), columns = f.columns();
  float* own = right_.data() + 3 * size_t(f.first);
  std::copy_n(own, columns, work);
  std::fill(work + columns, work + rows, 0.f);
  const float* l = factor_.data() + f.entry;
  for (int j = 0; j < columns; ++j, l += rows) {
    const float x = work[j] / l[j];
    work[j] = x;
    int i = j + 1;
    for (; i + Pack::size <= rows; i += Pack::size)
      less_product(Pack::load(work + i), Pack::load(l + i), Pack(x)).store(work + i);
    for (; i < rows; ++i) work[i] -= l[i] * x;
  }
  std::copy_n(work, columns, own);
  for (size_t k = 0; k < f.border.size(); ++k)
    for (size_t c = 0; c < 3; ++c)
      right_[3 * size_t(f.border[k]) + c] += work[size_t(columns) + 3 * k + c];
}

void BlockCholesky::upper(const Front& f, float* work) {
  const int rows = f.rows(), columns = f.columns();
  float* own = right_.data() + 3 * size_t(f.first);
  std::copy_n(own, columns, work);
  for (size_t k = 0; k < f.border.size(); ++k)
    std::copy_n(right_.data() + 3 * size_t(f.border[k]), 3, work + size_t(columns) + 3 * k);
  const float* l = factor_.data() + f.entry + size_t(rows) * size_t(columns);
  for (int j = columns - 1; j >= 0; --j) {
    l -= rows;
    Pack sum(0.f);
    int i = j + 1;
    for (; i + Pack::size <= rows; i += Pack::size)
      sum = less_product(sum, Pack::load(l + i), Pack::load(work + i));
    alignas(32) float lane[Pack::size];
    sum.store(lane);
    float left = work[j] + ((lane[0] + lane[4]) + (lane[1] + lane[5])) +
                 ((lane[2] + lane[6]) + (lane[3] + lane[7]));
    for (; i < rows; ++i) left -= l[i] * work[i];
    work[j] = left / l[j];
  }
  std::copy_n(work, columns, own);
}

void BlockCholesky::solve(float* x, float* y, float* z) {
  for (size_t k = 0; k < vertex_.size(); ++k) {
    const int v = vertex_[k];
    right_[3 * k] = x[v], right_[3 * k + 1] = y[v], right_[3 * k + 2] = z[v];
  }
  int most = 0;
  for (const Front& f : front_) most = std::max(most, f.rows());
  std::vector<float> work(size_t(most), 0.f);
  for (const Front& f : front_) lower(f, work.data());
  for (size_t k = front_.size(); k-- > 0;) upper(front_[k], work.data());
  for (size_t k = 0; k < vertex_.size(); ++k) {
    const int v = vertex_[k];
    x[v] = right_[3 * k], y[v] = right_[3 * k + 1], z[v] = right_[3 * k + 2];
  }
}

}  // namespace drench::sim
