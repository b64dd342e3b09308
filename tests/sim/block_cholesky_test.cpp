// The sheets' factor: it solves what it is of, in the work that nested dissection is known for.

#include "sim/passes/cloth/block_cholesky.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <array>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

namespace drench::sim_tests {
namespace {

struct System {
  sim::BlockPattern pattern;
  std::vector<float> block, place;

  /// A x, in double precision.
  std::vector<double> times(const std::vector<float>& x) const {
    std::vector<double> y(x.size(), 0);
    for (size_t i = 0; i < size_t(pattern.rows()); ++i)
      for (size_t e = size_t(pattern.start[i]); e < size_t(pattern.start[i + 1]); ++e)
        for (size_t k = 0; k < 9; ++k)
          y[3 * i + k / 3] += double(block[9 * e + k]) * x[3 * size_t(pattern.column[e]) + k % 3];
    return y;
  }
};

/// Of `wide` x `high` vertices on a plane, or where it `closes` around a tube, each coupled to
/// those within two steps by a random positive block, with a thousandth of that on the diagonal.
System grid(int wide, int high, bool closes = false) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(-1, 1);
  const int n = wide * high;
  std::vector<std::map<int, std::array<float, 9>>> rows(size_t(n),
                                                        std::map<int, std::array<float, 9>>{});
  const auto couple = [&](int i, int j, const std::array<float, 9>& k) {
    for (size_t e = 0; e < 9; ++e) {
      rows[size_t(i)][i][e] += k[e], rows[size_t(j)][j][e] += k[e];
      rows[size_t(i)][j][e] -= k[e], rows[size_t(j)][i][e] -= k[e];
    }
  };
  for (int i = 0; i < n; ++i) {
    for (size_t e = 0; e < 9; e += 4) rows[size_t(i)][i][e] += 1e-3f;
    for (int dy = 0; dy <= 2; ++dy) {
      for (int dx = -2; dx <= 2; ++dx) {
        const int x = i % wide + dx, y = i / wide + dy;
        if ((dy == 0 && dx <= 0) || y >= high || (!closes && (x < 0 || x >= wide))) continue;
        const float v[3] = {any(random), any(random), any(random)};
        std::array<float, 9> k{};
        for (size_t e = 0; e < 9; ++e) k[e] = v[e / 3] * v[e % 3];
        couple(i, y * wide + (x + wide) % wide, k);
      }
    }
  }
  System s;
  for (int i = 0; i < n; ++i) {
    for (const auto& [j, k] : rows[size_t(i)]) {
      s.pattern.column.push_back(j);
      s.block.insert(s.block.end(), k.begin(), k.end());
    }
    s.pattern.start.push_back(int(s.pattern.column.size()));
    const double turn = 2 * M_PI * (i % wide) / wide;
    s.place.push_back(float(closes ? wide * std::cos(turn) / 6 : i % wide));
    s.place.push_back(float(closes ? wide * std::sin(turn) / 6 : 0));
    s.place.push_back(float(i / wide));
  }
  return s;
}

std::vector<float> random_vector(size_t size) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(-1, 1);
  std::vector<float> x(size);
  for (float& a : x) a = any(random);
  return x;
}

/// The factor's solution for a right side.
std::vector<float> solution(sim::BlockCholesky& cholesky, const std::vector<double>& right) {
  std::vector<float> column[3], x(right.size());
  for (size_t k = 0; k < right.size(); ++k) column[k % 3].push_back(float(right[k]));
  cholesky.solve(column[0].data(), column[1].data(), column[2].data());
  for (size_t k = 0; k < x.size(); ++k) x[k] = column[k % 3][k / 3];
  return x;
}

void expect_solved(const System& s) {
  sim::BlockCholesky cholesky(s.pattern, s.place);
  EXPECT_TRUE(cholesky.factor(s.block));
  const std::vector<float> x = random_vector(s.place.size());
  const std::vector<double> right = s.times(x), again = s.times(solution(cholesky, right));
  double left = 0, all = 0;
  for (size_t k = 0; k < x.size(); ++k)
    left += std::pow(again[k] - right[k], 2), all += right[k] * right[k];
  EXPECT_LT(std::sqrt(left / all), 2e-6);
}

TEST(BlockCholesky, SolvesWhatItIsOf) {
  for (const auto& [wide, high] : {std::pair(1, 1), {3, 2}, {40, 1}, {23, 31}, {64, 64}}) {
    SCOPED_TRACE(fmt::format("{} x {}", wide, high));
    expect_solved(grid(wide, high));
  }
  expect_solved(grid(24, 30, true));
}

TEST(BlockCholesky, OfPiecesThatNothingJoins) {
  System s = grid(20, 10);
  const System other = grid(15, 12, true);
  const int before = s.pattern.rows(), entries = int(s.pattern.column.size());
  for (const int j : other.pattern.column) s.pattern.column.push_back(before + j);
  for (size_t i = 1; i < other.pattern.start.size(); ++i)
    s.pattern.start.push_back(entries + other.pattern.start[i]);
  s.block.insert(s.block.end(), other.block.begin(), other.block.end());
  s.place.insert(s.place.end(), other.place.begin(), other.place.end());  // at the same places
  expect_solved(s);
}

TEST(BlockCholesky, SaysWhenAMatrixIsNotPositive) {
  System s = grid(12, 12);
  for (size_t e = 0; e < s.block.size(); e += 9)
    for (size_t k = 0; k < 9; k += 4) s.block[e + k] -= 3;
  sim::BlockCholesky cholesky(s.pattern, s.place);
  EXPECT_FALSE(cholesky.factor(s.block));
}

// Twice as many vertices along a side: in the limit 8 times the work and 4 log_2 2n / log_2 n the
// entries (George 1973), where a band takes 16 and 8.
TEST(BlockCholesky, TakesTheWorkOfNestedDissection) {
  const System small = grid(48, 48), large = grid(96, 96);
  const sim::BlockCholesky a(small.pattern, small.place), b(large.pattern, large.place);
  EXPECT_LT(b.flops() / a.flops(), 10);
  EXPECT_LT(double(b.entries()) / double(a.entries()), 6);
}

TEST(BlockCholesky, HasTheSameBitsOnAnyNumberOfThreads) {
  const System s = grid(50, 50);
  const std::vector<double> right = s.times(random_vector(s.place.size()));
  const auto on = [&](size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    sim::BlockCholesky cholesky(s.pattern, s.place);
    cholesky.factor(s.block);
    return solution(cholesky, right);
  };
  EXPECT_EQ(on(1), on(8));
}

}  // namespace
}  // namespace drench::sim_tests
