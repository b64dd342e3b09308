#include "render/film/exr_memory.h"

#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>

#include <algorithm>
#include <new>

namespace drench::render {

namespace {

class MemoryStream final : public Imf::OStream {
 public:
  MemoryStream() : Imf::OStream("a picture in memory") {}

  void write(const char* data, int size) override {
    const size_t end = at_ + size_t(size);
    try {
      if (end > bytes_.size()) bytes_.resize(end);
    } catch (...) {
      whole_ = false;  // the table of lines is written by a destructor, which lets nothing out
      throw;
    }
    std::copy_n(data, size, bytes_.data() + at_);
    at_ = end;
  }
  uint64_t tellp() override { return at_; }
  void seekp(uint64_t offset) override { at_ = size_t(offset); }

  bool whole() const { return whole_; }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
  size_t at_ = 0;
  bool whole_ = true;
};

}  // namespace

std::string exr_bytes(const Imf::Header& header, const Imf::FrameBuffer& pixels) {
  MemoryStream stream;
  {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(pixels);
    file.writePixels(header.dataWindow().max.y - header.dataWindow().min.y + 1);
  }
  if (!stream.whole()) throw std::bad_alloc();
  return stream.take();
}

}  // namespace drench::render
