#pragma once
// OUT/manifest.jsonl: what every file of an output folder is and which key made it. Append-only,
// one JSON object a line, each with a checksum, so that a torn or damaged line is dropped and never
// used. Several processes may append, on several machines: each takes the kernel's lock of the file
// for a line, and reads what the others wrote before it writes its own.

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "pipeline/contract/files/files.h"
#include "pipeline/contract/hash.h"

namespace drench {

/// What a key was made of, by name ("build", "device", "camera", "fluid.1001.ply"): only to say why
/// a key differs; decisions compare keys.
using KeyParts = std::map<std::string, std::string>;

/// One file of the folder.
struct Record {
  std::string file;  // relative to the folder, with '/'
  std::string step;  // simulate, checkpoint, mesh, render, ...
  int frame = 0;     // film frame, 0 where it has no meaning
  uint64_t size = 0;
  Digest digest;         // XXH3-128 of the bytes
  int64_t mtime_ns = 0;  // of the inode when it was made: a hint, see output_folder.h
  Digest key;            // of the inputs and settings that made it
  KeyParts parts;
};

/// Live records by file name. Readers take one snapshot; drivers, which hold the folder's lock,
/// append. Safe to use from several threads.
class Manifest {
 public:
  /// Reads what is there; a missing file is an empty manifest.
  /// @throws Error if it is there but cannot be read.
  explicit Manifest(std::filesystem::path file);
  ~Manifest();
  Manifest(const Manifest&) = delete;
  Manifest& operator=(const Manifest&) = delete;

  /// Writes the file anew, without damaged lines. Call before open_for_append, with the folder's
  /// lock held against all others. @throws Error if it cannot be written; it is as it was then.
  void rewrite();
  /// Cuts a torn tail off and allows add and drop. Call with the folder's lock held.
  /// @throws Error if the file cannot be written.
  void open_for_append();

  /// Appends and fsyncs. @throws Error if the disk is full; the torn line is then cut off.
  void add(const Record& record);
  /// Forgets `file`: it is gone, damaged or no longer wanted.
  void drop(const std::string& file);
  /// Takes in what other processes appended. Call after open_for_append.
  void refresh();

  std::optional<Record> find(const std::string& file) const;
  std::map<std::string, Record> records() const;
  /// Lines that failed their checksum, the torn tail among them.
  int damaged_lines() const { return damaged_lines_ + (torn_ ? 1 : 0); }
  /// Whether it ended within a line, as it does for a moment while another writes.
  bool is_torn() const { return torn_; }

 private:
  void take_line(std::string_view line);
  void take_in(std::string_view text);
  void catch_up();
  void append(std::string line);
  [[noreturn]] void fail_to_write(int reason) const;

  std::filesystem::path file_;
  mutable std::mutex mutex_;
  std::map<std::string, Record> records_;
  int damaged_lines_ = 0;
  bool torn_ = false;       // the file ends within a line
  uint64_t good_size_ = 0;  // bytes up to the end of the last whole line
  int descriptor_ = -1;
};

/// The line of a record without its newline, and back; nothing if the checksum or a field is wrong.
std::string manifest_line(const Record& record);
std::optional<Record> parse_manifest_line(std::string_view line);

}  // namespace drench
