// VDB files whose numbers someone chose and whose digest of themselves is right: reading them ends
// soon, takes no memory that the file's size does not explain, and gives an Error or particles.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <new>
#include <stdexcept>

#include "pipeline/contract/foam_file.h"
#include "pipeline/contract/hash.h"
#include "pipeline/contract/particles_file.h"
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

/// What the child that read the forged files came to.
struct Outcome {
  bool ended = false;    // by itself, in time
  int wrong = 0;         // files that neither an Error nor particles came of
  long most_memory = 0;  // KiB
};

template <class Each>
Outcome in_a_child(const Each& each) {
  int result[2];
  EXPECT_EQ(::pipe(result), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(100);
    int wrong = 0;
    each([&](const auto& read) {
      try {
        read();
      } catch (const Error&) {
      } catch (...) {
        ++wrong;
      }
    });
    (void)!::write(result[1], &wrong, sizeof wrong);
    ::_exit(0);
  }
  Outcome outcome;
  int status = 0;
  rusage usage{};
  ::wait4(child, &status, 0, &usage);
  outcome.ended = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  const ssize_t got = outcome.ended ? ::read(result[0], &outcome.wrong, sizeof(int)) : 0;
  outcome.ended = got == ssize_t(sizeof(int));
  outcome.most_memory = usage.ru_maxrss;
  ::close(result[0]), ::close(result[1]);
  return outcome;
}

// Every place a number may stand at. Numbers above 2^24 are left out: as the length of a text the
// library fills that much before the stream can object, 4 GiB at most.
TEST(ForgedVdb, EndsSoonAndTakesLittleMemory) {
  const TemporaryFolder folder;
  const std::string whole = particles_bytes(folder.path());
  rusage before{};
  ::getrusage(RUSAGE_SELF, &before);
  const Outcome outcome = in_a_child([&](const auto& attempt) {
    for (const uint32_t number : {0x00ffffffu, 0x0000ffffu, 0u}) {
      for (size_t at = 4; at + 4 <= whole.size(); ++at) {
        if (at + 4 > 21 && at < 57) continue;
        std::string forged = whole;
        std::memcpy(forged.data() + at, &number, 4);
        sign(forged);
        write_quickly(folder / "forged.vdb", forged);
        attempt([&] { (void)read_particles(folder / "forged.vdb"); });
        attempt([&] { (void)read_foam(folder / "forged.vdb"); });
      }
    }
  });
  EXPECT_TRUE(outcome.ended) << "crashed, or took too long";
  EXPECT_EQ(outcome.wrong, 0);
  EXPECT_LT(outcome.most_memory - before.ru_maxrss, 1 << 18)
      << "KiB for files of " << whole.size() << " bytes";
}

// A cut file that is signed again: nothing reads on beyond its end.
TEST(ForgedVdb, CutAnywhereIsRefused) {
  const TemporaryFolder folder;
  const std::string whole = particles_bytes(folder.path());
  const Outcome outcome = in_a_child([&](const auto& attempt) {
    for (size_t size = 57; size < whole.size(); ++size) {
      std::string cut = whole.substr(0, size);
      sign(cut);
      write_quickly(folder / "cut.vdb", cut);
      attempt([&] {
        (void)read_particles(folder / "cut.vdb");
        throw std::logic_error("it was read");
      });
    }
  });
  EXPECT_TRUE(outcome.ended);
  EXPECT_EQ(outcome.wrong, 0);
}

}  // namespace
}  // namespace drench
