#pragma once
// Where particles come from and when: by ids, which rise as particles come.

#include <algorithm>
#include <cstdint>
#include <vector>

namespace drench::sim {

/// From this id on particles came from that source at that time.
struct Birth {
  int first_id = 0;
  int source = 0;   // boxes, spheres, drops, volumes, then emitters, each in the order of the shot
  double time = 0;  // s since the first frame
};

class Births {
 public:
  /// @param first_id  not below those added before.
  void add(const Birth& birth) {
    if (!run_.empty() && run_.back().source == birth.source && run_.back().time == birth.time)
      return;
    if (!run_.empty() && run_.back().first_id == birth.first_id) run_.pop_back();  // of nothing
    run_.push_back(birth);
  }
  /// Of a particle that was added.
  const Birth& of(int id) const {
    const auto after = std::upper_bound(run_.begin(), run_.end(), id,
                                        [](int i, const Birth& b) { return i < b.first_id; });
    return *std::prev(after);
  }
  const std::vector<Birth>& runs() const { return run_; }
  void resume(std::vector<Birth> runs) { run_ = std::move(runs); }

 private:
  std::vector<Birth> run_;
};

}  // namespace drench::sim
