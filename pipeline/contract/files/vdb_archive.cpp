#include "pipeline/contract/files/vdb_archive.h"

#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <istream>
#include <sstream>
#include <stdexcept>
#include <streambuf>

#include "pipeline/contract/files/allocation_limit.h"
#include "pipeline/contract/hash.h"

namespace drench {

namespace {

// Magic number, file version, library version, a flag; then the UUID as text.
constexpr size_t uuid_offset = 21;
constexpr size_t uuid_size = 36;

/// Digest of all bytes but the UUID, written as one: 8-4-4-4-12 hex digits.
std::string content_uuid(std::string_view bytes) {
  Hasher hasher;
  hasher.bytes(bytes.data(), uuid_offset);
  const std::string_view rest = bytes.substr(uuid_offset + uuid_size);
  hasher.bytes(rest.data(), rest.size());
  const std::string hex = hasher.finish().hex();
  return fmt::format("{}-{}-{}-{}-{}", hex.substr(0, 8), hex.substr(8, 4), hex.substr(12, 4),
                     hex.substr(16, 4), hex.substr(20));
}

/// With grid offsets, as a file has them: readers can then load one grid without the others.
class SeekableArchive : public openvdb::io::Archive {
 public:
  void write_to(std::ostream& stream, const openvdb::GridCPtrVec& grids) const {
    write(stream, grids, /*seekable=*/true, openvdb::MetaMap());
  }
};

/// Bytes as a stream that throws at the end of them, and when far more of them are read than there
/// are: OpenVDB itself goes on with whatever it has, for as long as a number in the file says.
class BytesBuffer final : public std::streambuf {
 public:
  explicit BytesBuffer(std::string_view bytes) : left_(8 * uint64_t(bytes.size()) + (1 << 20)) {
    char* const begin = const_cast<char*>(bytes.data());  // a get area is not written to
    setg(begin, begin, begin + bytes.size());
  }

 protected:
  int_type underflow() override { throw std::runtime_error("it ends too early"); }
  std::streamsize xsgetn(char* to, std::streamsize count) override {
    if (count > egptr() - gptr()) throw std::runtime_error("it ends too early");
    if (uint64_t(count) + 1 > left_) throw std::runtime_error("its parts contain each other");
    left_ -= uint64_t(count) + 1;  // reading nothing counts, too
    std::copy_n(gptr(), count, to);
    setg(eback(), gptr() + count, egptr());
    return count;
  }
  pos_type seekoff(off_type by, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const off_type base = from == std::ios::beg   ? 0
                          : from == std::ios::cur ? gptr() - eback()
                                                  : egptr() - eback();
    if (by < -base || by > egptr() - eback() - base) return pos_type(off_type(-1));
    setg(eback(), eback() + base + by, egptr());
    return pos_type(base + by);
  }
  pos_type seekpos(pos_type to, std::ios_base::openmode mode) override {
    return seekoff(off_type(to), std::ios::beg, mode);
  }

 private:
  uint64_t left_;  // bytes and calls
};

}  // namespace

void initialize_vdb() {
  static const bool done = [] {
    openvdb::initialize();
    return true;
  }();
  (void)done;
}

std::string vdb_bytes(const openvdb::GridCPtrVec& grids) {
  initialize_vdb();
  SeekableArchive archive;
  archive.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
  std::ostringstream stream(std::ios::binary);
  archive.write_to(stream, grids);
  if (!stream) throw std::bad_alloc();  // memory is all that an in-memory stream can lack
  std::string bytes = std::move(stream).str();
  if (bytes.size() < uuid_offset + uuid_size) throw std::logic_error("vdb_bytes: no header");
  bytes.replace(uuid_offset, uuid_size, content_uuid(bytes));
  return bytes;
}

openvdb::GridBase::Ptr vdb_grid(std::string_view bytes) {
  initialize_vdb();
  if (bytes.size() < uuid_offset + uuid_size || !bytes.starts_with(" BDV")) {
    throw std::runtime_error("it is not an OpenVDB file or was cut off");
  }
  // OpenVDB itself accepts flipped bits and many truncations without a word.
  if (bytes.substr(uuid_offset, uuid_size) != content_uuid(bytes)) {
    throw std::runtime_error(
        "its content does not match its own digest: damaged, or not written by "
        "Drench");
  }
  BytesBuffer buffer(bytes);
  std::istream stream(&buffer);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  constexpr size_t most_compression = 256;
  const AllocationLimit limit(most_compression * bytes.size() + (1 << 20));
  try {
    openvdb::io::Stream archive(stream, /*delayLoad=*/false);
    const openvdb::GridPtrVecPtr grids = archive.getGrids();
    if (!stream || !grids || grids->empty()) throw std::runtime_error("it holds no grid");
    return grids->front();
  } catch (const BeyondAllocationLimit&) {
    throw std::runtime_error("it asks for more memory than its size explains");
  }
}

}  // namespace drench
