// VDB files whose numbers someone chose and whose digest of themselves is right: reading them ends
// soon, takes no memory that the file's size does not explain, and gives an Error or particles.

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <stdexcept>

#include "pipeline/contract/files/foam_file.h"
#include "pipeline/contract/files/particles_file.h"
#include "pipeline/contract/hash.h"
#include "tests/temporary_folder.h"

namespace drench {
namespace {

using namespace test;
namespace fs = std::filesystem;

/// Puts the digest of the rest into the header's UUID, 36 characters from byte 21.
void sign(std::string& bytes) {
  Hasher hasher;
  hasher.bytes(bytes.data(), 21).bytes(bytes.data() + 57, bytes.size() - 57);
  std::string hex = hasher.finish().hex();
  for (const size_t at : {8, 13, 18, 23}) hex.insert(at, "-");
  bytes.replace(21, 36, hex);
}

std::string particles_bytes(const fs::path& folder) {
  ParticleFrame frame;
  frame.spacing = 0.01f;
  frame.rest_density = 1000;
  for (int k = 0; k < 200; ++k) {
    frame.position.emplace_back(0.01f * float(k % 10), 0.011f * float(k / 10), 0.3f);
    frame.velocity.emplace_back(0.1f * float(k), 0.f, 1.f);
    frame.density.push_back(1000 + float(k));
    frame.id.push_back(uint32_t(k));
  }
  write_particles(folder / "whole.vdb", frame);
  return read_text(folder / "whole.vdb");
}

/// What came of reading forged files in children.
struct Outcome {
  int wrong = 0;         // files that neither an Error nor particles came of
  int asserted = 0;      // that ended the child by an assertion of the library, as Debian builds it
  int crashed = 0;       // that ended it in another way, or after 30 s
  long most_memory = 0;  // KiB
};

/// Calls read(k) for k in [begin, end) in a child, and the rest in another where one ends. The
/// library leaks what it had begun of a file that it gives up: one child reads so many.
template <class Read>
Outcome in_children(size_t begin, size_t end, const Read& read) {
  constexpr size_t files = 200;
  struct Shared {
    size_t at;
    int wrong;
  };
  void* const memory =
      ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  EXPECT_NE(memory, MAP_FAILED);
  auto* const shared = static_cast<volatile Shared*>(memory);
  shared->wrong = 0;
  Outcome outcome;
  for (size_t at = begin; at < end; at = shared->at + 1) {
    const pid_t child = ::fork();
    if (child == 0) {
      ::alarm(30);
      (void)!std::freopen("/dev/null", "w", stderr);
      for (size_t k = at; k < std::min(at + files, end); ++k) {
        shared->at = k;
        try {
          read(k);
        } catch (const Error&) {
        } catch (...) {
          shared->wrong = shared->wrong + 1;
        }
      }
      ::_exit(0);
    }
    int status = 0;
    rusage usage{};
    ::wait4(child, &status, 0, &usage);
    outcome.asserted += WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
    outcome.crashed += WIFSIGNALED(status) && WTERMSIG(status) != SIGABRT;
    outcome.most_memory = std::max(outcome.most_memory, usage.ru_maxrss);
  }
  outcome.wrong = shared->wrong;
  ::munmap(memory, sizeof(Shared));
  return outcome;
}

// Every place a number may stand at. The library makes room for a text of 4 GiB where it is told to
// before it looks whether there is one.
TEST(ForgedVdb, EndsSoonAndTakesLittleMemory) {
  const TemporaryFolder folder;
  const std::string whole = particles_bytes(folder.path());
  rusage before{};
  ::getrusage(RUSAGE_SELF, &before);
  for (const uint32_t number : {0xffffffffu, 0x0000ffffu, 0u}) {
    const Outcome outcome = in_children(2 * 4, 2 * (whole.size() - 3), [&](size_t k) {
      const size_t at = k / 2;
      if (at + 4 > 21 && at < 57) return;
      std::string forged = whole;
      std::memcpy(forged.data() + at, &number, 4);
      sign(forged);
      write_quickly(folder / "forged.vdb", forged);
      if (k % 2 == 0) return (void)read_particles(folder / "forged.vdb");
      (void)read_foam(folder / "forged.vdb");
    });
    RecordProperty("assertions", outcome.asserted);
    EXPECT_EQ(outcome.crashed, 0);
    EXPECT_EQ(outcome.wrong, 0);
    EXPECT_LT(size_t(outcome.asserted), 2 * whole.size() / 100);
    EXPECT_LT(outcome.most_memory - before.ru_maxrss, 1 << 18)
        << "KiB for files of " << whole.size() << " bytes";
  }
}

// A cut file that is signed again: nothing reads on beyond its end.
TEST(ForgedVdb, CutAnywhereIsRefused) {
  const TemporaryFolder folder;
  const std::string whole = particles_bytes(folder.path());
  const Outcome outcome = in_children(57, whole.size(), [&](size_t size) {
    std::string cut = whole.substr(0, size);
    sign(cut);
    write_quickly(folder / "cut.vdb", cut);
    (void)read_particles(folder / "cut.vdb");
    throw std::logic_error("it was read");
  });
  EXPECT_EQ(outcome.crashed, 0);
  EXPECT_EQ(outcome.asserted, 0);
  EXPECT_EQ(outcome.wrong, 0);
}

}  // namespace
}  // namespace drench
