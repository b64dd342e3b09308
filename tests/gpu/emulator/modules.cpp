// Finds the PTX in a fat binary, has it translated and compiled, and keeps the results in a cache.

#include <cuda_occupancy.h>
#include <cuda_runtime_api.h>
#include <cxxabi.h>
#include <dlfcn.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "tests/gpu/emulator/runtime.h"

namespace gpu_emulator {

namespace {

namespace fs = std::filesystem;

struct FatBinaryWrapper {
  int magic, version;
  const char* data;
  void* names;
};
struct FatBinaryHeader {
  u32 magic;
  u16 version, header_size;
  u64 size;
};
struct FatBinaryEntry {
  u16 kind, version;  // kind 1 is PTX
  u32 header_size;
  u64 padded_size;
  u32 packed_size, unknown;
};
constexpr u32 entry_flags_at = 40;  // bytes from an entry's beginning
constexpr u64 packed_by_lz4 = 0x2000, packed_by_zstd = 0x8000;

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream all;
  all << in.rdbuf();
  return all.str();
}

std::string unpacked(const char* data, size_t size) {
  std::string text(ZSTD_getFrameContentSize(data, size), '\0');
  const size_t written = ZSTD_decompress(text.data(), text.size(), data, size);
  if (ZSTD_isError(written)) give_up("the PTX cannot be unpacked");
  text.resize(std::min(written, text.find('\0')));
  return text;
}

std::string ptx_of(const void* fat_binary) {
  const auto& wrapper = *static_cast<const FatBinaryWrapper*>(fat_binary);
  const char* at = wrapper.data;
  const auto& header = *reinterpret_cast<const FatBinaryHeader*>(at);
  if (wrapper.magic != 0x466243b1 || header.magic != 0xba55ed50) give_up("this is no fat binary");
  const char* const end = at + header.header_size + header.size;
  for (at += header.header_size; at < end;) {
    const auto& entry = *reinterpret_cast<const FatBinaryEntry*>(at);
    u64 flags;
    std::memcpy(&flags, at + entry_flags_at, sizeof flags);
    const char* const data = at + entry.header_size;
    if (entry.kind == 1) {
      if (flags & packed_by_lz4) give_up("the PTX is compressed for speed: --compress-mode=size");
      return flags & packed_by_zstd ? unpacked(data, entry.packed_size)
                                    : std::string(data, strnlen(data, entry.padded_size));
    }
    at = data + entry.padded_size;
  }
  give_up("no PTX in the fat binary: compile with --generate-code=arch=...,code=compute_...");
}

u64 hash(const std::string& text, u64 start) {  // FNV-1a, eight bytes at a time
  u64 h = start, word = 0;
  for (size_t k = 0; k < text.size(); k += 8) {
    word = 0;
    std::memcpy(&word, text.data() + k, std::min<size_t>(8, text.size() - k));
    h = (h ^ word) * 0x100000001b3, h ^= h >> 29;
  }
  return h;
}

void run(const std::string& command) {  // without this library in it
  if (std::system(("unset LD_PRELOAD; " + command).c_str()) != 0) give_up("failed: " + command);
}

/// Without parameter lists and the names of namespaces.
std::string for_people(const std::string& mangled) {
  int status = 0;
  char* const text = abi::__cxa_demangle(mangled.c_str(), nullptr, nullptr, &status);
  std::string full = status == 0 ? text : mangled, out;
  std::free(text);
  const auto replace = [&](const std::string& what, const std::string& by) {
    for (size_t at; (at = full.find(what)) != std::string::npos;) full.replace(at, what.size(), by);
  };
  replace("(anonymous namespace)::", ""), replace("{lambda(", "{lambda%(");
  int angles = 0, round = 0;
  for (size_t k = 0; k < full.size(); ++k) {
    const char c = full[k];
    if (c == '(' && angles == 0 && round == 0) break;  // the function's own parameters
    if (c == '<' && round == 0) ++angles;
    if (c == '>' && round == 0) --angles;
    if (c == '(') ++round;
    if (round == 0 && c != '%') out += c;
    if (c == ')') --round;
  }
  if (out.rfind("void ", 0) == 0) out.erase(0, 5);
  std::string name;  // a lower-case word before "::" is a namespace
  for (size_t k = 0; k < out.size();) {
    size_t end = k;
    while (end < out.size() &&
           (std::isalnum(static_cast<unsigned char>(out[end])) || out[end] == '_'))
      ++end;
    const std::string word = out.substr(k, end - k);
    const bool space =
        !word.empty() && out.compare(end, 2, "::") == 0 && out.compare(end, 3, "::{") != 0 &&
        (std::islower(static_cast<unsigned char>(word[0])) || word.rfind("CUB_", 0) == 0);
    if (space) {
      k = end + 2;
    } else {
      name += word.empty() ? out.substr(k, 1) : word;
      k = word.empty() ? k + 1 : end;
    }
  }
  return name;
}

std::string source_folder() { return GPUEMU_SOURCE; }

/// The folder with the C++ of a module.
std::string translated(const std::string& ptx) {
  const fs::path source = source_folder();
  u64 h = hash(ptx, 0xcbf29ce484222325);
  for (const char* file : {"translate.py", "ptx.h"}) h = hash(read_file(source / file), h);
  char name[20];
  std::snprintf(name, sizeof name, "%016llx", static_cast<unsigned long long>(h));
  const fs::path folder = fs::path(settings().cache) / name;
  if (fs::exists(folder / "index")) return folder;
  const std::string building = folder.string() + "." + std::to_string(getpid());
  fs::create_directories(building);
  std::ofstream(fs::path(building) / "module.ptx") << ptx;
  run("python3 '" + (source / "translate.py").string() + "' '" + building + "/module.ptx' '" +
      building + "'");
  std::error_code taken;  // another process may have been faster
  fs::rename(building, folder, taken);
  if (taken) fs::remove_all(building);
  return folder;
}

void read_variable(std::istream& line, Module& module) {
  std::string name, space, data;
  u64 size, align;
  line >> name >> space >> size >> align >> data;
  const u64 address = allocate(std::max<u64>(size, 1), "variable " + name);
  if (size > 0) std::memset(contents(address), 0, size);
  for (size_t k = 0; data != "-" && 2 * k + 1 < data.size(); ++k)
    contents(address)[k] = char(std::stoi(data.substr(2 * k, 2), nullptr, 16));
  mark_written(address, size);
  module.variables[name] = {address, size};
  module.symbols.push_back(address);
}

void read_kernel(std::istream& line, Module& module) {
  Kernel k;
  std::string kind, order, parameters;
  line >> k.number >> k.name >> kind >> order >> k.most_threads >> k.shared >> parameters;
  k.fibers = kind == "FIBERS", k.any_order = order == "ANY_ORDER";
  k.pretty = for_people(k.name), k.module = &module;
  k.most_dynamic = u32(std::max(0, plain_shared - int(k.shared)));
  std::replace(parameters.begin(), parameters.end(), ',', ' ');
  std::istringstream all(parameters);
  for (std::string one; all >> one;) {
    const size_t colon = one.find(':');
    k.parameters.push_back({u32(std::stoul(one)), u32(std::stoul(one.substr(colon + 1)))});
  }
  module.kernels[k.name] = k;
}

}  // namespace

Module* load_module(const void* fat_binary) {
  auto* module = new Module;
  const std::string ptx = ptx_of(fat_binary);
  module->folder = translated(ptx);
  const size_t target = ptx.find(".target sm_");
  if (target != std::string::npos) module->architecture = std::atoi(ptx.c_str() + target + 11);
  std::ifstream index(fs::path(module->folder) / "index");
  for (std::string line; std::getline(index, line);) {
    std::istringstream words(line);
    std::string what;
    words >> what;
    what == "variable" ? read_variable(words, *module) : read_kernel(words, *module);
  }
  return module;
}

void compile(Kernel& kernel) {
  const Settings& s = settings();
  const bool profile = !s.profile.empty();
  const std::string name = "kernel_" + std::to_string(kernel.number),
                    stem = kernel.module->folder + "/" + name,
                    flags = std::string(s.init ? "i" : "") + (s.race ? "r" : "") +
                            (profile ? "p" : "") + s.fuse,
                    library = stem + (flags.empty() ? "" : "_" + flags) + ".so";
  if (!fs::exists(library)) {
    const std::string building = library + "." + std::to_string(getpid());
    // Optimising the largest kernels takes minutes, running them as they are seconds.
    const bool optimise = fs::file_size(stem + ".cpp") < (flags.empty() ? 700'000 : 150'000);
    // Without the folder's name, which is another for every PTX, ccache knows what has not changed.
    run("cd '" + kernel.module->folder + "' && " GPUEMU_CCACHE " g++ -std=c++20 " +
        (optimise ? "-O1" : "-O0") +
        (s.fuse.empty() ? " -ffp-contract=off" : " -ffp-contract=fast -fexpensive-optimizations") +
        " -march=x86-64-v3 -w -fPIC -fvisibility=hidden -fwrapv -fno-strict-aliasing "
        "-fno-math-errno -fno-trapping-math -I'" GPUEMU_ROOT "' -DCHECK_INIT=" +
        (s.init ? "1" : "0") + " -DCHECK_RACE=" + (s.race ? "1" : "0") +
        " -DPROFILE=" + (profile ? "1" : "0") + " -c -o '" + building + ".o' " + name + ".cpp");
    run("g++ -shared -Wl,-Bsymbolic -o '" + building + "' '" + building + ".o'");
    fs::remove(building + ".o");
    fs::rename(building, library);
  }
  void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) give_up(dlerror());
  kernel.run = reinterpret_cast<void (*)(Thread&)>(dlsym(handle, "kernel"));
  kernel.sites = static_cast<const Site*>(dlsym(handle, "sites"));
  auto* const symbols = static_cast<u64*>(dlsym(handle, "symbol"));
  std::copy(kernel.module->symbols.begin(), kernel.module->symbols.end(), symbols);
}

void resources_of(Kernel& k) {
  if (k.registers > 0) return;
  const std::string& folder = k.module->folder;
  const fs::path file = folder + "/kernel_" + std::to_string(k.number) + ".ptxas";
  if (!fs::exists(file)) {
    const std::string building = file.string() + "." + std::to_string(getpid());
    run("ptxas -v -arch=sm_" + std::to_string(std::max(90, k.module->architecture)) + " -e '" +
        k.name + "' -o /dev/null '" + folder + "/module.ptx' > '" + building + "' 2>&1");
    fs::rename(building, file);
  }
  const std::string all = read_file(file);
  const auto number = [&](const std::string& pattern) {
    std::smatch found;
    return std::regex_search(all, found, std::regex(pattern)) ? std::stoi(found[1]) : 0;
  };
  k.registers = number("Used (\\d+) registers"), k.barriers = number("used (\\d+) barriers");
  k.stack = number("(\\d+) bytes stack"), k.spilled = number("(\\d+) bytes spill stores");
  if (k.registers == 0) give_up("ptxas does not tell registers: " + file.string());
}

int blocks_per_sm(Kernel& k, u32 threads, u64 dynamic_shared) {
  resources_of(k);
  cudaDeviceProp device;
  cudaGetDeviceProperties(&device, 0);
  const cudaOccDeviceProp properties(device);
  cudaOccFuncAttributes attributes;
  attributes.maxThreadsPerBlock = int(k.most_threads), attributes.numRegs = k.registers;
  attributes.sharedSizeBytes = k.shared,
  attributes.maxDynamicSharedSizeBytes = most_shared - k.shared;
  attributes.shmemLimitConfig = FUNC_SHMEM_LIMIT_OPTIN, attributes.numBlockBarriers = k.barriers;
  const cudaOccDeviceState state;
  cudaOccResult result{};
  if (cudaOccMaxActiveBlocksPerMultiprocessor(&result, &properties, &attributes, &state,
                                              int(threads), dynamic_shared) != CUDA_OCC_SUCCESS)
    return 0;
  return result.activeBlocksPerMultiprocessor;
}

}  // namespace gpu_emulator
