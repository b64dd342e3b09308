// The program where its surroundings end: closed streams, names that no file system or terminal
// likes, signals, pipes in the place of files, limits of the system.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "pipeline/driver/layout.h"
#include "pipeline/driver/movie.h"
#include "pipeline/driver/output_folder.h"
#include "pipeline/driver/step.h"
#include "tests/driver/tiny_shot.h"

namespace drench {
namespace {

using namespace std::chrono_literals;
using namespace test;
namespace fs = std::filesystem;
using nlohmann::json;

constexpr int done = 0, user_error = 1, stopped = 75;

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// "$@" stands for the program and its words.
Ended in_shell(const std::string& script, const std::vector<std::string>& words,
               const fs::path& folder) {
  std::vector<std::string> all{"-c", script, "sh", DRENCH_PROGRAM};
  all.insert(all.end(), words.begin(), words.end());
  return run_program("/bin/sh", all, folder);
}

Ended drench_in(const fs::path& folder, const std::vector<std::string>& words) {
  const TemporaryFolder logs;
  return in_shell("cd '" + folder.string() + "' && exec timeout 20 \"$@\"", words, logs.path());
}

void expect_user_error(const Ended& ended, const std::string& part = "") {
  EXPECT_EQ(ended.code, user_error) << ended.err;
  EXPECT_FALSE(has(ended.err, "bug")) << ended.err;
  EXPECT_TRUE(has(ended.err, part)) << ended.err;
}

// ---- closed streams ----

// The first files opened get the numbers of closed streams: log lines went into them.
TEST(Edges, ClosedStreamsBecomeNoFiles) {
  const auto& expected = undisturbed_digests(3);
  for (const std::string closed : {"2>&-", ">&- 2>&-", "<&- >&- 2>&-", "<&-", "<&- 2>&-"}) {
    const TinyShot shot(3);
    EXPECT_EQ(in_shell("exec \"$@\" " + closed, shot.words("run", {"-v"}), shot.folder()).code,
              done)
        << closed;
    EXPECT_EQ(shot.digests(), expected) << closed;
    EXPECT_EQ(Manifest(shot.out() / layout::manifest).damaged_lines(), 0) << closed;
  }
  const TinyShot shot(3);  // who asks for output and closed it is told
  expect_user_error(in_shell("exec \"$@\" >&-", shot.words("plan"), shot.folder()),
                    "standard output");
}

// ---- names ----

TEST(Edges, NoControlCharacterOfANameReachesTheTerminal) {
  const TinyShot shot(3);
  const std::string evil =
      "a\x1b[31mb\nc\xc2\x9b"
      "d\x7f\xff\xe2\x80\xae";
  const fs::path file = shot.folder() / (evil + ".toml");
  fs::copy_file(shot.file(), file);
  const std::vector<std::vector<std::string>> lines{
      {"plan", file.string()},
      {"run", (shot.folder() / evil / "none.toml").string()},
      {"run", shot.file().string(), "--frames", evil},
      {"run", shot.file().string(), "--quality", evil},
      {"run", shot.file().string(), "--" + evil},
      {"verify", (shot.folder() / evil).string()},
      {"clean", shot.file().string(), "--out", (shot.folder() / evil).string()}};
  for (const auto& words : lines) {
    const Ended ended = drench_in(shot.folder(), words);
    EXPECT_EQ(ended.code, user_error) << ended.err;
    for (const std::string part : {"\x1b", "\x7f", "\xff", "\xc2\x9b", "\xe2\x80\xae"})
      EXPECT_FALSE(has(ended.err + ended.out, part)) << words[0] << ' ' << ended.err;
  }
  const fs::path out = shot.folder() / "a\x1b[31mb";  // a folder may be called so
  const Ended run = drench_in(shot.folder(),
                              {"run", shot.file().string(), "--out", out.string(), "--json", "-v"});
  EXPECT_EQ(run.code, done) << run.err;
  EXPECT_FALSE(has(run.err + run.out, "\x1b"));
  put_text(out / "left\x1b[31mover", "x");
  const Ended verified = drench_in(shot.folder(), {"verify", out.string()});
  EXPECT_TRUE(has(verified.out, "left\\x1b[31mover")) << verified.out;
}

TEST(Edges, NamesThatNoShotCanHaveAreRefused) {
  const TinyShot shot(3);
  for (const std::string name : {"..toml", "...toml", "-x.toml", ".hidden.toml", "\xff\xfe.toml",
                                 "\xc0\xae\xc0\xae.toml", "a\tb.toml"}) {
    const TemporaryFolder folder;
    fs::copy_file(shot.file(), folder.path() / name);
    expect_user_error(drench_in(folder.path(), {"run", "./" + name}), "ename");
    EXPECT_EQ(folder.names(), std::vector<std::string>{name});
  }
  const TemporaryFolder folder;
  fs::copy_file(shot.file(), folder.path() / (std::string(240, 'n') + ".toml"));
  expect_user_error(drench_in(folder.path(), {"run", std::string(240, 'n') + ".toml"}), "200");
  put_text(folder.path() / "tiny.toml",
           text_of(shot.file()) + "[quality.\"../../up\".render]\nsamples = 1\n");
  expect_user_error(drench_in(folder.path(), {"run", "tiny.toml", "--quality", "../../up"}), "'/'");
  EXPECT_FALSE(fs::exists(folder.path() / "out"));
}

TEST(Edges, NamesOfTooManyBytesAreTheUsersToMend) {
  const TinyShot shot(3);
  const std::string name(300, 'x'), file = shot.file().string();
  for (const std::vector<std::string>& words : {std::vector<std::string>{"run", name + ".toml"},
                                                {"run", file, "--out", name},
                                                {"plan", file, "--out", name},
                                                {"clean", file, "--out", name},
                                                {"verify", name},
                                                {"init", name}})
    expect_user_error(drench_in(shot.folder(), words), "too long");
  expect_user_error(drench_in(shot.folder(), {"init", ".."}));
  expect_user_error(drench_in(shot.folder(), {"init", "\xff"}));
}

TEST(Edges, AFolderThatIsNotUtf8IsAFolder) {
  const TinyShot shot(3);
  const fs::path out = shot.folder() / "\xff\xfe";
  const Ended run =
      drench_in(shot.folder(), {"run", shot.file().string(), "--out", out.string(), "--json"});
  EXPECT_EQ(run.code, done) << run.err;
  EXPECT_FALSE(json::parse(run.out)["folder"].empty());
  put_text(out / "\xfe", "unlisted");
  EXPECT_EQ(drench_in(shot.folder(), {"verify", out.string(), "--json"}).code, done);
  const fs::path other = shot.folder() / "\xfd" / "tiny.toml";
  put_text(other, text_of(shot.file()));
  const Ended there = drench_in(shot.folder(), {"run", other.string(), "--out", "made"});
  EXPECT_EQ(there.code, done) << there.err;
}

// ffmpeg takes what stands before a colon for a protocol.
TEST(Edges, AFolderNamedLikeAProtocolGetsItsMovie) {
  if (!find_ffmpeg()) GTEST_SKIP() << "needs ffmpeg";
  const TinyShot shot(3);
  for (const std::string out : {"md5:x", "http:x", "pipe:1", "-y", "concat:a|b"}) {
    const Ended run = drench_in(shot.folder(), {"run", shot.file().string(), "--out=" + out});
    EXPECT_EQ(run.code, done) << run.err;
    EXPECT_GT(fs::file_size(shot.folder() / out / "tiny.mp4"), 500u);
    EXPECT_TRUE(run.out.empty());
  }
}

// ---- what stands where a file belongs ----

enum class Stands { pipe, folder };

/// What runs, plans and verifies while something else stands in the place of a file, and after.
void expect_no_harm(const TinyShot& shot, const std::string& file, Stands what) {
  const fs::path path = shot.out() / file, kept = shot.folder() / "kept";
  fs::rename(path, kept);
  if (what == Stands::folder) {
    fs::create_directory(path);
  } else {
    ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  }
  const Ended run = drench_in(shot.folder(), shot.words("run", {"--set", "render.seed=2"}));
  // A pipe is replaced like a damaged file where files are put in their place by renaming.
  if (run.code != done || what == Stands::folder) expect_user_error(run, file);
  for (const auto& words : {shot.words("plan"), {"verify", shot.out().string()}}) {
    const Ended ended = drench_in(shot.folder(), words);
    EXPECT_TRUE(ended.code == done || ended.code == user_error) << file << ended.err;
  }
  fs::remove_all(path);
  fs::rename(kept, path);
  ASSERT_EQ(shot.run("run").code, done) << file;
}

TEST(Edges, PipesAndFoldersInThePlaceOfFilesAreRefusedAtOnce) {
  const TinyShot shot(2);
  ASSERT_EQ(shot.run("run").code, done);
  const auto before = shot.digests();
  for (const std::string file : {"stats.jsonl", "manifest.jsonl", "render/tiny.1002.exr", ".lock"})
    expect_no_harm(shot, file, Stands::pipe);
  for (const std::string file :
       {"stats.jsonl", "manifest.jsonl", "render/tiny.1002.exr", ".lock", "mesh/fluid.1002.ply",
        "sim/particles.1002.vdb", "contact_sheet.png", "shot.lock.toml"})
    expect_no_harm(shot, file, Stands::folder);
  EXPECT_EQ(shot.digests(), before);
}

TEST(Edges, PipesAndFoldersInThePlaceOfInputsAreRefusedAtOnce) {
  const TinyShot shot(3);
  const fs::path pipe = shot.folder() / "pipe", folder = shot.folder() / "folder";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  fs::create_directory(folder);
  for (const fs::path& input : {pipe, folder}) {
    const std::string name = input.string(), file = shot.file().string();
    expect_user_error(drench_in(shot.folder(), {"run", name}), name);
    expect_user_error(drench_in(shot.folder(), {"verify", name}), name);
    for (const std::string setting :
         {"light.0.map", "cloth.0.mesh", "view.ocio_config", "ground.texture"}) {
      const Ended run =
          drench_in(shot.folder(), {"run", file, "--set", setting + "=\"" + name + "\""});
      EXPECT_EQ(run.code, user_error) << setting << run.err;
    }
    const Ended ocio =
        in_shell("export OCIO='" + name + "'; exec timeout 20 \"$@\"",
                 shot.words("run", {"--set", "view.display=\"sRGB\""}), shot.folder());
    EXPECT_EQ(ocio.code, user_error) << ocio.err;
  }
}

/// What may stand where a file is named: by name, with a line of control characters in one.
std::vector<std::string> hostile_paths(const fs::path& folder) {
  EXPECT_EQ(::mkfifo((folder / "a_pipe").c_str(), 0600), 0);
  fs::create_directory(folder / "a_folder");
  fs::create_symlink("a_pipe", folder / "link_to_pipe");
  fs::create_symlink("nowhere", folder / "dangling");
  fs::create_symlink("loop_b", folder / "loop_a");
  fs::create_symlink("loop_a", folder / "loop_b");
  return {"a_pipe",
          "a_folder",
          "link_to_pipe",
          "dangling",
          "loop_a",
          "/dev/zero",
          "/dev/tty",
          "../../../../../../../../proc/self/mem",
          "\\u001b[31mred\\u0007"};
}

// Nine paths in eight places: each is refused at once, and nothing of it reaches a terminal.
TEST(Edges, HostilePathsOfInputsAreRefusedAtOnce) {
  const TinyShot shot(2);
  std::string whole = text_of(shot.file());
  const std::string sky = "[[light]]\ntype = \"environment\"\nradiance = [1, 1, 1]\n";
  whole.replace(whole.find(sky), sky.size(), "");  // of which there may be one
  const std::vector<std::string> paths = hostile_paths(shot.folder());
  for (const std::string place :
       {"[[obstacle]]\nname = \"o\"\ntype = \"mesh\"\nmesh", "[[cloth]]\nname = \"c\"\nmesh",
        "[[fluid.emitter]]\ntype = \"mesh\"\ncenter = [0, 0.3, 0]\nmesh", "[[fluid.volume]]\nmesh",
        "[[sink]]\nname = \"s\"\ntype = \"mesh\"\nmesh",
        "[[light]]\nname = \"l\"\ntype = \"environment\"\nmap",
        "[[material]]\nname = \"ground\"\ntype = \"diffuse\"\ntexture",
        "[[material]]\nname = \"ground\"\ntype = \"diffuse\"\nnormal_map"})
    for (const std::string& path : paths) {
      put_text(shot.file(), whole + place + " = \"" + path + "\"\n");
      const Ended ended = in_shell("exec timeout 20 \"$@\"", shot.words("plan"), shot.folder());
      EXPECT_EQ(ended.code, user_error) << place << ' ' << path << ended.err << ended.out;
      const std::string named = path.find("red") != path.npos ? "red" : fs::path(path).filename();
      EXPECT_TRUE(has(ended.err, named)) << place << ' ' << path << ended.err;
      EXPECT_FALSE(has(ended.err + ended.out, "\x1b")) << place;
    }
}

// ---- signals ----

// Hashing 64 GiB takes longer than anyone waits.
TEST(Edges, VerifyEndsAtOnceWhenAsked) {
  const TinyShot shot(3);
  ASSERT_EQ(shot.run("run").code, done);
  const std::string file = layout::image("tiny", 1002);
  const auto size = uint64_t(1) << 36;
  fs::resize_file(shot.out() / file, size);
  {
    Manifest manifest(shot.out() / layout::manifest);
    manifest.open_for_append();
    Record record = *manifest.find(file);
    record.size = size;
    manifest.add(record);
  }
  for (const auto& words : {std::vector<std::string>{"verify", shot.out().string()},
                            shot.words("plan"), shot.words("run", {"--verify"})}) {
    Child child(DRENCH_PROGRAM, words, shot.folder());
    std::this_thread::sleep_for(1500ms);  // to load its libraries on a busy machine
    ASSERT_TRUE(child.running()) << words[0];
    const auto start = std::chrono::steady_clock::now();
    child.send(SIGTERM);
    const Ended ended = child.wait();
    EXPECT_LT(std::chrono::steady_clock::now() - start, 1s) << words[0];
    EXPECT_EQ(ended.code, stopped) << words[0] << ended.err;
    EXPECT_TRUE(has(ended.err, "stopped on request")) << ended.err;
  }
  fs::remove(shot.out() / file);
  EXPECT_EQ(shot.run("run").code, done);
  EXPECT_EQ(shot.digests(), undisturbed_digests(3));
}

// ---- limits of the system ----

TEST(Edges, MemoryIsANumber) {
  const TinyShot shot(3);
  for (const std::string memory : {"nan", "NaN", "-nan", "inf", "-inf", "0", "1e400", "x"})
    expect_user_error(drench_in(shot.folder(), shot.words("run", {"--memory=" + memory})));
}

TEST(Edges, NoCheckpointIsPromisedWhereThereIsNone) {
  const TinyShot shot(3);
  const Ended first = shot.run("run", {"--memory", "0.01"});
  expect_user_error(first, "--memory");
  EXPECT_EQ(has(first.err, "with a checkpoint"), fs::exists(shot.out() / layout::stop_checkpoint))
      << first.err;
  ASSERT_EQ(shot.run("run").code, done);
  // Rendering alone has nothing to keep.
  const Ended second = shot.run("render", {"--memory", "0.01", "--set", "render.seed=2"});
  expect_user_error(second, "--memory");
  EXPECT_FALSE(has(second.err, "with a checkpoint")) << second.err;
}

TEST(Edges, ThreadsThatTheSystemDoesNotGiveAreTheUsersToMend) {
  if (::geteuid() != 0 || !fs::exists("/usr/bin/setpriv"))
    GTEST_SKIP() << "needs root and setpriv: limits of processes do not bind root";
  const TinyShot shot(3);
  ::chmod(shot.folder().c_str(), 0777);
  std::vector<std::string> words{
      "--reuid=65533", "--regid=65533", "--clear-groups", "/usr/bin/prlimit", "", DRENCH_PROGRAM};
  for (const std::string& word : shot.words("run")) words.push_back(word);
  if (run_program("/usr/bin/setpriv",
                  {"--reuid=65533", "--regid=65533", "--clear-groups", DRENCH_PROGRAM, "--version"},
                  shot.folder())
          .code != 0)
    GTEST_SKIP() << "the build is not readable for others";
  for (const std::string limit : {"1", "3", "5", "6", "8"}) {  // libraries start some before main
    words[4] = "--nproc=" + limit;
    const Ended run = run_program("/usr/bin/setpriv", words, shot.folder());
    EXPECT_EQ(run.code, user_error) << limit << " signal " << run.signal << run.err;
    EXPECT_TRUE(has(run.err, "ulimit -u")) << limit << run.err;
  }
}

// A million frames: the plan is printed as it is walked.
TEST(Edges, APlanOfAMillionFramesFitsIntoAGigabyte) {
  const TinyShot shot(3);
  const Ended plan =
      in_shell("exec \"$@\" >plan.json",
               shot.words("plan", {"--json", "--set", "shot.frames=[1, 1000000]"}), shot.folder());
  EXPECT_EQ(plan.code, done) << plan.err;
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  EXPECT_LT(usage.ru_maxrss, 1 << 20) << "KiB";
  fs::remove("plan.json");
}

// ---- forged records ----

TEST(Edges, ForgedRecordsAreDroppedAndHarmNothing) {
  const TinyShot shot(3);
  ASSERT_EQ(shot.run("run").code, done);
  const std::string whole = text_of(shot.out() / layout::manifest);
  const std::string good = whole.substr(0, whole.find('\n'));
  const json object = json::parse(good);
  const auto forged = [&](const char* key, const json& value) {
    json other = object;
    other.erase("check");
    if (value.is_null()) other.erase(key);
    if (!value.is_null()) other[key] = value;
    std::string text = other.dump();
    text.pop_back();
    return text + ",\"check\":\"" + hash_bytes(text.data(), text.size()).hex() + "\"}\n";
  };
  std::string lines;
  const std::vector<json> strange{nullptr, -1,   1e300, "x", json::array({1}), json::object(),
                                  true,    -1.5, "..",  "",  1ull << 63};
  for (const char* key :
       {"file", "step", "frame", "size", "digest", "mtime_ns", "key", "parts", "dropped"})
    for (const json& value : strange) lines += forged(key, value);
  for (const char* file :
       {"/etc/passwd", "../x", "sim/../../x", "sim//x", "./x", "sim/", "..", "."})
    lines += forged("file", file);
  put_text(shot.out() / layout::manifest, whole + lines);
  for (const std::string command : {"plan", "run", "clean"}) {
    const Ended ended = drench_in(shot.folder(), shot.words(command));
    EXPECT_EQ(ended.code, done) << command << ended.err;
  }
  const Ended verified = drench_in(shot.folder(), {"verify", shot.out().string()});
  EXPECT_TRUE(verified.code == done || verified.code == user_error) << verified.err;
  // A record of a probe that names a frame of the year 200,000.
  for (const auto& [file, record] : Manifest(shot.out() / layout::manifest).records()) {
    if (record.step != probe_record) continue;
    Manifest manifest(shot.out() / layout::manifest);
    manifest.open_for_append();
    Record later = record;
    later.frame = 2147483647;
    manifest.add(later);
  }
  EXPECT_EQ(drench_in(shot.folder(), shot.words("run")).code, done);
  const auto now = shot.digests();  // files that only the forger names are missing for ever
  for (const auto& [file, digest] : undisturbed_digests(3)) EXPECT_EQ(now.at(file), digest) << file;
}

}  // namespace
}  // namespace drench
