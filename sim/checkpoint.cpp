#include "sim/checkpoint.h"

#include <cstring>

#include "pipeline/contract/error.h"
#include "sim/columns.h"

namespace drench::sim {

namespace {

constexpr char magic[8] = {'D', 'R', 'N', 'C', 'H', 'C', 'P', '9'};

template <class Archive, class Values>
void transfer_values(Archive& archive, Values& values) {
  if constexpr (std::is_same_v<std::remove_const_t<Values>, HostVec>)
    archive(values.x), archive(values.y), archive(values.z);
  else
    archive(values);
}

/// The same list of members writes and reads: Archive is a Writer or a Reader.
template <class Archive, class C>
void transfer(Archive& archive, C& c) {
  archive(c.frame), archive(c.time), archive(c.steps), archive(c.next_id), archive(c.births);
  archive(c.emitted), archive(c.shut);
  auto& s = c.state;
  cpu::State columns;
  columns.parameters.incompressible = columns.shell.any = columns.wet.any =
      true;  // which keep more
  cpu::for_each_kept_column(
      columns, [&](const auto&, const auto&, auto member) { transfer_values(archive, s.*member); });
  archive(s.limits), archive(s.guard_hits), archive(s.guard_holds);
  archive(s.removed), archive(s.shell_dt);
  archive(c.rest.since), transfer_values(archive, c.rest.mark), archive(c.rest.square);
  archive(c.rest.still);
  archive(c.rest.busy), archive(c.rest.asleep), archive(c.rest.pull);
  archive(c.probes);
}

struct Writer {
  std::string bytes;
  template <class T>
  void operator()(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class T>
  void operator()(const std::vector<T>& values) {
    (*this)(uint64_t(values.size()));
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }
};

struct Reader {
  const std::byte* at;
  const std::byte* end;
  const std::filesystem::path& path;
  void take(void* to, uint64_t size) {
    if (size > uint64_t(end - at))
      throw Error(path.string() +
                  ": the checkpoint is cut short. Delete it; the run starts from an earlier one");
    if (size) std::memcpy(to, at, size);
    at += size;
  }
  template <class T>
  void operator()(T& value) {
    take(&value, sizeof value);
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    uint64_t count = 0;
    (*this)(count);
    if (count > uint64_t(end - at) / sizeof(T)) {
      throw Error(path.string() +
                  ": the checkpoint is damaged. Delete it; the run starts from an earlier one");
    }
    values.resize(count);
    take(values.data(), count * sizeof(T));
  }
};

}  // namespace

WrittenFile write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint) {
  Writer writer;
  transfer(writer, checkpoint);
  const Digest content = hash_bytes(writer.bytes.data(), writer.bytes.size());
  Writer file;
  file.bytes.assign(magic, sizeof magic);
  file(checkpoint.layout), file(content);
  file.bytes += writer.bytes;
  return write_file_whole(path, file.bytes);
}

Checkpoint read_checkpoint(const std::filesystem::path& path, const Digest& layout) {
  const std::vector<std::byte> bytes = read_file(path);
  Reader reader{bytes.data(), bytes.data() + bytes.size(), path};
  char found[sizeof magic];
  Checkpoint checkpoint;
  Digest content;
  reader.take(found, sizeof found);
  reader(checkpoint.layout), reader(content);
  if (std::memcmp(found, magic, sizeof magic) != 0 ||
      content != hash_bytes(reader.at, reader.end - reader.at)) {
    throw Error(
        path.string() +
        ": not a whole checkpoint of this version. Delete it; the run starts from an earlier one");
  }
  if (checkpoint.layout != layout) {
    throw Error(path.string() +
                ": the checkpoint belongs to other settings of the shot. Delete it, or run the "
                "shot into another folder");
  }
  transfer(reader, checkpoint);
  return checkpoint;
}

}  // namespace drench::sim
