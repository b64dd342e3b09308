#include "pipeline/driver/manifest.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>
#include <utility>

#include "pipeline/contract/error.h"
#include "pipeline/driver/file_lock.h"

namespace drench {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

// The last member of every line; what stands before it is what the checksum covers.
constexpr std::string_view check_mark = ",\"check\":\"";

std::string with_check(const json& object) {
  std::string text = object.dump(-1, ' ', false, json::error_handler_t::replace);
  text.pop_back();  // the closing brace comes after the checksum
  const std::string check = hash_bytes(text.data(), text.size()).hex();
  return fmt::format("{}{}{}\"}}", text, check_mark, check);
}

std::string drop_line(const std::string& file) {
  return with_check(json{{"file", file}, {"dropped", true}});
}

/// The object of a line whose checksum holds.
std::optional<json> checked(std::string_view line) {
  const size_t mark = line.rfind(check_mark);
  if (mark == std::string_view::npos) return {};
  const std::string_view body = line.substr(0, mark);
  const std::string check = hash_bytes(body.data(), body.size()).hex();
  if (line.substr(mark) != fmt::format("{}{}\"}}", check_mark, check)) return {};
  json object = json::parse(line.begin(), line.end(), nullptr, false);
  if (!object.is_object()) return {};
  return object;
}

/// A whole number that the type holds. @throws Error for anything else, which json would convert.
template <class T>
T whole_number(const json& value) {
  if (value.is_number_unsigned() && std::in_range<T>(value.get<uint64_t>()))
    return T(value.get<uint64_t>());
  if (value.is_number_integer() && !value.is_number_unsigned() &&
      std::in_range<T>(value.get<int64_t>()))
    return T(value.get<int64_t>());
  throw Error("a number of the record is none");
}

/// Whether it names a file below the folder, in the one way that the driver writes: a record must
/// not lead a reader, or `clean`, elsewhere.
bool is_name_inside(const std::string& file) {
  constexpr size_t longest = 4095;
  if (file.empty() || file.size() > longest || file.find('\0') != file.npos) return false;
  const fs::path path(file);
  if (path.is_absolute() || path.lexically_normal() != path) return false;
  return path.has_filename() && *path.begin() != ".." && *path.begin() != ".";
}

std::optional<Record> record_of(const json& object) {
  try {
    Record record;
    record.file = object.at("file").get<std::string>();
    record.step = object.at("step").get<std::string>();
    record.frame = whole_number<int>(object.at("frame"));
    record.size = whole_number<uint64_t>(object.at("size"));
    record.digest = Digest::from_hex(object.at("digest").get<std::string>());
    record.mtime_ns = whole_number<int64_t>(object.at("mtime_ns"));
    record.key = Digest::from_hex(object.at("key").get<std::string>());
    record.parts = object.at("parts").get<KeyParts>();
    if (!is_name_inside(record.file)) return {};
    return record;
  } catch (const json::exception&) {
    return {};
  } catch (const Error&) {
    return {};
  }
}

}  // namespace

std::string manifest_line(const Record& record) {
  return with_check(json{{"file", record.file},
                         {"step", record.step},
                         {"frame", record.frame},
                         {"size", record.size},
                         {"digest", record.digest.hex()},
                         {"mtime_ns", record.mtime_ns},
                         {"key", record.key.hex()},
                         {"parts", record.parts}});
}

std::optional<Record> parse_manifest_line(std::string_view line) {
  const std::optional<json> object = checked(line);
  return object ? record_of(*object) : std::nullopt;
}

Manifest::Manifest(fs::path file) : file_(std::move(file)) {
  std::error_code code;
  const bool there = fs::exists(file_, code);
  if (code) {
    throw Error(fmt::format("{}: cannot be read: {}", file_.string(), system_reason(code.value())));
  }
  if (there) take_in(read_text(file_, uint64_t(1) << 32));
}

Manifest::~Manifest() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void Manifest::fail_to_write(int reason) const {
  throw Error(fmt::format("{}: cannot be written: {}", file_.string(), system_reason(reason)));
}

void Manifest::take_line(std::string_view line) {
  if (const std::optional<Record> record = parse_manifest_line(line)) {
    records_[record->file] = *record;
  } else if (const std::optional<json> object = checked(line);
             object && object->contains("dropped") && object->contains("file") &&
             object->at("file").is_string()) {
    records_.erase(object->at("file").get<std::string>());
  } else {
    ++damaged_lines_;
  }
}

/// What follows in the file after good_size_.
void Manifest::take_in(std::string_view text) {
  size_t begin = 0;
  for (size_t end; (end = text.find('\n', begin)) != text.npos; begin = end + 1)
    take_line(text.substr(begin, end - begin));
  good_size_ += begin;
  torn_ = begin < text.size();  // the writer was killed in the middle of this line
}

/// Under the file's lock: reads what others appended and cuts off what one that was killed began.
void Manifest::catch_up() {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) fail_to_write(errno);
  const auto size = uint64_t(status.st_size);
  if (size < good_size_) {
    throw Error(
        fmt::format("{}: became shorter while it was in use; does another program clean "
                    "this folder? Run again",
                    file_.string()));
  }
  if (size > good_size_) {
    std::string text(size - good_size_, '\0');
    for (size_t done = 0; done < text.size();) {
      const ssize_t got =
          ::pread(descriptor_, text.data() + done, text.size() - done, off_t(good_size_ + done));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) fail_to_write(got < 0 ? errno : EIO);
      done += size_t(got);
    }
    take_in(text);
  }
  if (!torn_) return;
  if (::ftruncate(descriptor_, off_t(good_size_)) != 0) fail_to_write(errno);
  torn_ = false;
  ++damaged_lines_;
}

void Manifest::rewrite() {
  const std::scoped_lock lock(mutex_);
  std::string text;
  for (const auto& [file, record] : records_) text += manifest_line(record) + '\n';
  write_file_whole(file_, text);
  good_size_ = text.size();
  damaged_lines_ = 0;
  torn_ = false;
}

void Manifest::open_for_append() {
  descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (descriptor_ < 0) fail_to_write(errno);
  refresh();
}

void Manifest::refresh() {
  const std::scoped_lock lock(mutex_);
  const FileLock file_lock(descriptor_, file_);
  catch_up();
}

void Manifest::append(std::string line) {
  if (descriptor_ < 0) throw std::logic_error("manifest: append before open_for_append");
  line += '\n';
  const FileLock file_lock(descriptor_, file_);
  catch_up();
  int reason = ::lseek(descriptor_, off_t(good_size_), SEEK_SET) < 0 ? errno : 0;
  for (size_t done = 0; reason == 0 && done < line.size();) {
    const ssize_t count = ::write(descriptor_, line.data() + done, line.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) reason = count < 0 ? errno : ENOSPC;
    if (count > 0) done += size_t(count);
  }
  if (reason == 0 && ::fdatasync(descriptor_) != 0) reason = errno;
  if (reason == 0) {
    good_size_ += line.size();
    return;
  }
  // The next record must not be glued to half a line, nor follow one that nobody counts.
  (void)!::ftruncate(descriptor_, off_t(good_size_));
  fail_to_write(reason);
}

void Manifest::add(const Record& record) {
  const std::scoped_lock lock(mutex_);
  append(manifest_line(record));
  records_[record.file] = record;
}

void Manifest::drop(const std::string& file) {
  const std::scoped_lock lock(mutex_);
  if (!records_.contains(file)) return;
  append(drop_line(file));
  records_.erase(file);
}

std::optional<Record> Manifest::find(const std::string& file) const {
  const std::scoped_lock lock(mutex_);
  const auto found = records_.find(file);
  return found == records_.end() ? std::nullopt : std::optional(found->second);
}

std::map<std::string, Record> Manifest::records() const {
  const std::scoped_lock lock(mutex_);
  return records_;
}

}  // namespace drench
