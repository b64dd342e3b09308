#include "pipeline/driver/checkpoints.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/contract/log.h"
#include "pipeline/driver/layout.h"
#include "pipeline/driver/output_folder.h"

namespace drench {

namespace fs = std::filesystem;

CheckpointKeeper::CheckpointKeeper(fs::path folder, Manifest& manifest, const Targets& targets,
                                   std::vector<Digest> keys, int every, int kept)
    : folder_(std::move(folder)),
      manifest_(manifest),
      first_(targets.first),
      keys_(std::move(keys)),
      parts_(targets.simulate.parts),
      every_(every),
      kept_(kept) {}

void CheckpointKeeper::remove_stale() {
  for (const auto& [file, record] : manifest_.records()) {
    if (record.step != checkpoint_record) continue;
    // Those beyond the frames asked for now may belong to the same, longer simulation.
    const bool beyond = record.frame >= first_ + int(keys_.size());
    const bool same_stage = record.parts == parts_;
    const bool known =
        record.frame >= first_ && !beyond && record.key == keys_[size_t(record.frame - first_)];
    if (!(known || (beyond && same_stage))) remove(file);
  }
  remove_unlisted();
}

void CheckpointKeeper::remove(const std::string& file) {
  // The record first: a kill in between leaves a file that nothing trusts, removed at the next
  // start.
  manifest_.drop(file);
  std::error_code code;
  fs::remove(folder_ / file, code);
}

void CheckpointKeeper::remove_unlisted() {
  const fs::path folder = folder_ / "sim/checkpoint";
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end;
       entry.increment(code)) {
    const std::string file = entry->path().lexically_relative(folder_).generic_string();
    if (entry->path().extension() != ".ckpt" || manifest_.find(file)) continue;
    std::error_code ignored;
    fs::remove(entry->path(), ignored);
  }
}

std::vector<Record> CheckpointKeeper::on_frames() const {
  std::vector<Record> found;
  for (const auto& [file, record] : manifest_.records()) {
    if (record.step == checkpoint_record && file != layout::stop_checkpoint)
      found.push_back(record);
  }
  std::sort(found.begin(), found.end(),
            [](const Record& a, const Record& b) { return a.frame < b.frame; });
  return found;
}

void CheckpointKeeper::write(const Simulation& simulation, int frame, const std::string& file) {
  Record record = record_of_file(folder_, simulation.write_checkpoint(folder_ / file));
  record.step = checkpoint_record;
  record.frame = frame;
  record.key = keys_.at(size_t(frame - first_));
  record.parts = parts_;
  manifest_.add(record);
}

void CheckpointKeeper::before_frame(const Simulation& simulation, int frame) {
  const bool last = frame == first_ + int(keys_.size()) - 1;  // a longer range continues here
  const bool due = frame > first_ && ((frame - first_) % every_ == 0 || last);
  if (!due) return;
  const std::vector<Record> before = on_frames();
  const auto later = std::count_if(before.begin(), before.end(),
                                   [&](const Record& record) { return record.frame >= frame; });
  if (later >= kept_) return;  // frames made again; it would be the next to be removed
  write(simulation, frame, layout::checkpoint(frame));
  const std::vector<Record> now = on_frames();
  for (size_t k = 0; k + size_t(kept_) < now.size(); ++k) remove(now[k].file);
  const auto stop = manifest_.find(std::string(layout::stop_checkpoint));
  if (stop && stop->frame < frame) remove(stop->file);
}

bool CheckpointKeeper::on_stop(const Simulation& simulation, int frame) {
  const int last = first_ + int(keys_.size()) - 1;
  if (frame < first_ || frame >= last) return false;  // nothing to continue
  write(simulation, frame, std::string(layout::stop_checkpoint));
  log_info("sim", fmt::format("checkpoint written after frame {}", frame));
  return true;
}

fs::path CheckpointKeeper::last_good() const {
  const std::vector<Record> found = on_frames();
  return found.empty() ? fs::path() : folder_ / found.back().file;
}

}  // namespace drench
