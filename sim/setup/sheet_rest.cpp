#include "sim/setup/sheet_rest.h"

#include <algorithm>
#include <cmath>

#include "sim/setup/scene.h"

namespace drench::sim {

namespace {

constexpr double window = 0.5;  // s
constexpr int windows = 4;

/// m/s: the smaller of a millimetre and a 500th of the sheet's diagonal a second, which no picture
/// of it shows.
double automatic_speed(const Sheet& sheet) {
  V3d low(1e30), high(-1e30);
  for (const V3d& p : sheet.rest) {
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  }
  return std::min(1e-3, (high - low).length() / 500);
}

double square_of(const HostVec& a, const HostVec& b, size_t i) {
  const double x = double(a.x[i]) - b.x[i], y = double(a.y[i]) - b.y[i],
               z = double(a.z[i]) - b.z[i];
  return x * x + y * y + z * z;
}

}  // namespace

SheetRest::SheetRest(const Shot& shot, const Scene& scene) {
  const Parameters& p = scene.parameters;
  const bool weightless = p.gravity[0] == 0 && p.gravity[1] == 0 && p.gravity[2] == 0;
  if (!sheets_are_implicit(p) || p.wet_sheets || weightless || scene.motion.moves()) return;
  const std::vector<VertexRange> range = sheet_ranges(scene.cloth);
  for (size_t k = 0; k < range.size(); ++k) {
    const Cloth& cloth = shot.cloth[k];
    const bool may = cloth.model == ClothModel::shell;
    const double speed =
        cloth.sleep_speed < 0 ? automatic_speed(scene.sheet[k]) : cloth.sleep_speed;
    sheet_.push_back({range[k], may ? speed : 0, float(cloth.thickness)});
  }
  if (std::all_of(sheet_.begin(), sheet_.end(), [](const Sheet& s) { return s.speed == 0; })) {
    sheet_.clear();
    return;
  }
  const size_t n = sheet_.size();
  joined_.assign(n * n, 0), box_.resize(n);
  for (const SeamSpring& s : scene.cloth.seam) {
    const auto a = size_t(scene.cloth.sheet_of(s.a)), b = size_t(scene.cloth.sheet_of(s.b));
    joined_[a * n + b] = joined_[b * n + a] = 1;
  }
  for (const int v : scene.cloth.pin_vertex) pin_sheet_.push_back(scene.cloth.sheet_of(v));
}

void SheetRest::start(Solver& solver, const SheetRestState& state, double time) {
  const size_t n = sheet_.size();
  const HostVec place = solver.cloth_positions();
  state_ = state;
  if (state_.asleep.empty())
    state_ = {time,        place, std::vector<double>(n, 0), std::vector<int>(n, 0), Flags(n, 0),
              Flags(n, 0), {}};
  look(place);
  solver.sleep(state_.asleep);
}

int SheetRest::asleep() const {
  return int(std::count(state_.asleep.begin(), state_.asleep.end(), 1));
}

void SheetRest::before_step(Solver& solver, const Motion& motion) {
  Flags touched(sheet_.size(), motion.everywhere ? 1 : 0);
  for (size_t k = 0; k < sheet_.size(); ++k) {
    for (const PlacedBox& box : motion.obstacle)
      if (meets(box, k)) touched[k] = 1;
  }
  const PinsNow& now = motion.pins;
  for (size_t k = 0; k < pin_sheet_.size(); ++k) {
    const bool moves = now.velocity.x[k] != 0 || now.velocity.y[k] != 0 || now.velocity.z[k] != 0,
               changes = !state_.pull.empty() && now.pull[k] != state_.pull[k];
    if (moves || changes) touched[size_t(pin_sheet_[k])] = 1;
  }
  state_.pull = now.pull;
  wake(solver, touched);
}

void SheetRest::after_step(Solver& solver, double time) {
  const bool ends = time >= state_.since + window - 1e-9;
  const size_t sleeping = size_t(asleep());
  if (sleeping == 0 && !ends) return;
  const Flags wetted = solver.sheets_near_fluid();
  const HostVec place = ends || sleeping < sheet_.size() ? solver.cloth_positions() : HostVec{};
  if (place.size() > 0) look(place);
  wake(solver, wetted);
  if (!ends) return;
  send_to_sleep(solver, measure(place, time - state_.since));
  state_.since = time, state_.mark = place;
  std::fill(state_.busy.begin(), state_.busy.end(), 0);
}

void SheetRest::look(const HostVec& place) {
  for (size_t k = 0; k < sheet_.size(); ++k) {
    const VertexRange& range = sheet_[k].vertices;
    const std::vector<float>* axis[3] = {&place.x, &place.y, &place.z};
    for (int c = 0; c < 3; ++c) {
      const auto begin = axis[c]->begin() + range.first;
      const auto [low, high] = std::minmax_element(begin, begin + range.count);
      box_[k].low[c] = *low, box_[k].high[c] = *high;
    }
  }
}

std::vector<SheetRest::Windows> SheetRest::measure(const HostVec& place, double elapsed) {
  std::vector<Windows> all(sheet_.size());
  for (size_t k = 0; k < sheet_.size(); ++k) {
    if (state_.asleep[k]) continue;
    const VertexRange& range = sheet_[k].vertices;
    double sum = 0;
    for (int i = range.first; i < range.first + range.count; ++i)
      sum += square_of(place, state_.mark, size_t(i));
    const double most = std::pow(sheet_[k].speed * elapsed, 2);
    Windows& w = all[k];
    w.before = state_.square[k], w.now = sum / range.count;
    int& still = state_.still[k];
    still = !state_.busy[k] && w.now <= most ? still + 1 : 0;
    w.still = still >= windows;
    state_.square[k] = w.now;
  }
  return all;
}

bool SheetRest::near(size_t a, size_t b) const {
  if (joined_[a * sheet_.size() + b]) return true;
  const float reach = sheet_[a].thickness + sheet_[b].thickness;
  for (int c = 0; c < 3; ++c) {
    if (box_[a].low[c] > box_[b].high[c] + reach || box_[b].low[c] > box_[a].high[c] + reach)
      return false;
  }
  return true;
}

bool SheetRest::meets(const PlacedBox& box, size_t sheet) const {
  const float reach = sheet_[sheet].thickness + box.clearance;
  for (int c = 0; c < 3; ++c) {
    if (box.low[c] > box_[sheet].high[c] + reach || box_[sheet].low[c] > box.high[c] + reach)
      return false;
  }
  return true;
}

void SheetRest::wake(Solver& solver, const Flags& touched) {
  bool changed = false;
  const auto rouse = [&](size_t k) {
    if (!state_.asleep[k]) return false;
    state_.asleep[k] = 0, state_.busy[k] = 1, state_.still[k] = 0;
    return changed = true;
  };
  for (size_t k = 0; k < sheet_.size(); ++k) {
    if (!touched[k]) continue;
    state_.busy[k] = 1, rouse(k);
  }
  for (bool more = asleep() > 0; more;) {
    more = false;
    for (size_t k = 0; k < sheet_.size(); ++k) {
      for (size_t j = 0; j < sheet_.size() && state_.asleep[k]; ++j)
        if (!state_.asleep[j] && near(j, k)) more |= rouse(k);
    }
  }
  if (changed) solver.sleep(state_.asleep);
}

std::vector<size_t> SheetRest::heaps() const {
  std::vector<size_t> heap(sheet_.size());
  for (size_t k = 0; k < heap.size(); ++k) {
    heap[k] = k;
    for (size_t j = 0; j < k; ++j) {
      const size_t from = heap[k], to = heap[j];
      if (from != to && near(j, k)) std::replace(heap.begin(), heap.end(), from, to);
    }
  }
  return heap;
}

void SheetRest::send_to_sleep(Solver& solver, const std::vector<Windows>& windows) {
  const std::vector<size_t> heap = heaps();
  std::vector<Windows> whole(sheet_.size());
  for (size_t k = 0; k < heap.size(); ++k) {
    Windows& w = whole[heap[k]];
    w.still &= windows[k].still, w.before += windows[k].before, w.now += windows[k].now;
  }
  bool changed = false;
  for (size_t k = 0; k < heap.size(); ++k) {
    const Windows& w = whole[heap[k]];
    if (state_.asleep[k] || !w.still || w.now > w.before) continue;
    state_.asleep[k] = 1, changed = true;
  }
  if (changed) solver.sleep(state_.asleep);
}

}  // namespace drench::sim
