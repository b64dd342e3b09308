#include "render/frame_checkpoint.h"

#include <fmt/format.h>

#include "pipeline/contract/error.h"
#include "pipeline/contract/files/files.h"
#include "render/film/checkpoint_archive.h"

namespace drench::render {

namespace {

/// Changes with the layout of what is archived.
constexpr uint64_t format_version = 0x6472656e63680004;  // "drench", 4

struct Head {
  uint64_t format = format_version;
  Digest inputs;
  uint64_t pixels = 0;
};

void archive(CheckpointArchive& file, Sums& sums) {
  file.column(sums.pixel);
  sums.layers.archive(file);
  sums.plate.archive(file);
  sums.plan.archive(file);
  sums.rounds.archive(file);
  file.column(sums.split);
}

}  // namespace

CheckpointArchive::CheckpointArchive(const std::filesystem::path& file, Mode mode)
    : mode_(mode),
      file_(file),
      stream_(file, std::ios::binary |
                        (mode == Mode::write ? std::ios::out | std::ios::trunc : std::ios::in)) {
  if (!stream_) throw Error(fmt::format("{}: cannot be opened", file.string()));
}

void CheckpointArchive::bytes(void* data, size_t size) {
  if (mode_ == Mode::write)
    stream_.write(static_cast<const char*>(data), std::streamsize(size));
  else
    stream_.read(static_cast<char*>(data), std::streamsize(size));
  hasher_.bytes(data, size);
  size_ += size;
}

bool CheckpointArchive::finish() {
  const Digest digest = hasher_.finish();
  Digest other = digest;
  value(other);
  if (mode_ == Mode::read) return stream_.good() && other == digest;
  stream_.close();  // flushes: a full disk may show only here
  std::error_code code;
  return stream_.good() && std::filesystem::file_size(file_, code) == size_ && !code;
}

void write_checkpoint(const FrameCheckpoint& checkpoint, Sums& sums) {
  write_file_whole(checkpoint.file, [&](const std::filesystem::path& temporary) {
    CheckpointArchive file(temporary, CheckpointArchive::Mode::write);
    Head head{format_version, checkpoint.inputs, sums.pixel.size()};
    file.value(head);
    archive(file, sums);
    if (!file.finish())
      throw Error(fmt::format("{}: the samples of the frame cannot be written; is the disk full?",
                              checkpoint.file.string()));
  });
}

bool read_checkpoint(const FrameCheckpoint& checkpoint, Sums& sums) {
  if (checkpoint.file.empty() || !std::filesystem::is_regular_file(checkpoint.file)) return false;
  CheckpointArchive file(checkpoint.file, CheckpointArchive::Mode::read);
  Head head;
  file.value(head);
  if (head.format != format_version || head.inputs != checkpoint.inputs ||
      head.pixels != sums.pixel.size())
    return false;
  Sums read = sums;
  archive(file, read);
  if (!file.finish()) return false;
  sums = std::move(read);
  return true;
}

}  // namespace drench::render
