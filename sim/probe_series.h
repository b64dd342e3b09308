#pragma once
// The probes of a shot: what each asks of the solver, and the rows they have given so far. Every
// row holds the time and then the columns of all probes, so that a checkpoint takes one list.

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/shot/shot.h"
#include "sim/setup/scene.h"
#include "sim/simulator.h"
#include "sim/solver.h"

namespace drench::sim {

class ProbeSeries {
 public:
  /// @throws Error if a probe names a vertex that its mesh does not have.
  ProbeSeries(const Shot& shot, const Scene& scene);

  /// The row of a state that no step has made yet: pressures and forces are not known.
  void start(double time, Solver& solver);
  /// The row of the step that ends at `time`, s; to be called right after it.
  void record(double time, Solver& solver);

  /// All rows, and whether another list could be theirs: whole rows of as many columns.
  const std::vector<double>& rows() const { return rows_; }
  bool fits(const std::vector<double>& rows) const;
  void resume(std::vector<double> rows) { rows_ = std::move(rows); }

  /// World coordinates; a value that is not there (no fluid, no pressure yet) is an empty cell.
  std::vector<ProbeText> texts() const;

 private:
  struct Series {
    Probe probe;
    ProbeQuery query;
    V3d rest;                          // tip: m, local as the state
    std::vector<std::string> columns;  // with units, after the time
    size_t first = 0;                  // column in a row
    size_t averaged = 0;               // so many columns; as many means follow
    std::optional<Obstacle> carrier;   // that it rides on
  };

  void add(const Probe& probe, const Shot& shot, const Scene& scene);
  void aim(Series& series, const Shot& shot, const Scene& scene) const;
  /// Whether the step from `before` to `time`, s, ends a probe's interval: it has a row then.
  static bool due(const Series& series, double before, double time);
  /// The query as it is at a time, s: some ride on obstacles.
  ProbeQuery query_at(const Series& series, double time) const;
  std::vector<double> values_of(const Series& series, const std::vector<double>& answer) const;
  double mean(size_t column, double window) const;
  std::string definition(const Series& series) const;

  std::string shot_;
  LocalFrame frame_;
  Timeline timeline_;
  double spacing_ = 0;         // m
  double low_[3], period_[3];  // m local; 0 where an axis is not periodic
  std::vector<Series> series_;
  size_t width_ = 1;
  std::vector<double> rows_;
};

}  // namespace drench::sim
