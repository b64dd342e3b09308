#pragma once
// Sparse Cholesky factor of a symmetric positive matrix of 3 x 3 blocks, on the host, for sheets:
// nested dissection of the graph (George 1973) by the places of its vertices, the factor front by
// front (multifrontal, Liu 1992), in single precision. A front has the vertices of a separator, or
// of a part that is not split, as its own, and as its border those of later fronts that they meet;
// what is left of it after its own are eliminated its parent adds up. Same bits for any number of
// threads: fronts are whole, and children are added in a fixed order.

#include <cstddef>
#include <span>
#include <vector>

namespace drench::sim {

/// Columns of the blocks of each row, sorted, the diagonal among them. Symmetric.
struct BlockPattern {
  std::vector<int> start{0}, column;
  int rows() const { return int(start.size()) - 1; }
  bool operator==(const BlockPattern&) const = default;
};

class BlockCholesky {
 public:
  /// Order and fronts.
  /// @param place  of the vertices: x y z of each, m
  BlockCholesky(const BlockPattern& pattern, std::span<const float> place);

  /// Multiplications and additions of `factor`; entries of the factor, which `solve` reads twice.
  double flops() const { return flops_; }
  size_t entries() const { return entries_; }

  /// @param block  9 numbers for each of the pattern's columns, row by row
  /// @return whether all pivots were positive; else the factor is of a matrix that is stiffer there
  bool factor(std::span<const float> block);

  /// x = A^-1 x, by three columns.
  void solve(float* x, float* y, float* z);

 private:
  struct Front {
    int first = 0, own = 0;   // vertices in the order of elimination
    std::vector<int> border;  // the same
    std::vector<int> child;   // fronts
    std::vector<int> at;      // of the border's vertices in the parent: among its own, then border
    size_t entry = 0;         // of its columns in factor_
    size_t work = 0;          // flops of it and below
    std::vector<float> left;  // what it leaves to its parent
    int rows() const { return 3 * (own + int(border.size())); }
    int columns() const { return 3 * own; }
  };
  struct Dissection;

  void find_borders();
  bool eliminate(Front& front, const float* block);
  bool factor_below(int front, const float* block);
  void lower(const Front& front, float* work);
  void upper(const Front& front, float* work);

  BlockPattern pattern_;
  std::vector<int> vertex_, rank_;  // by order of elimination, and back
  std::vector<Front> front_;        // children before parents
  std::vector<int> root_;
  std::vector<float> factor_, right_;
  double flops_ = 0;
  size_t entries_ = 0;
};

}  // namespace drench::sim
