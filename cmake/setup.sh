# Sourced by run, test, bench: installs what is missing, configures and builds. Debian 12 names; also
# right on Debian 13 and Ubuntu 24.04 where they exist. Needs `root` set to the repository;
# drench_yes=yes installs without asking.

# libboost-iostreams-dev brings the Boost headers that OpenVDB's own include.
# What the build needs, each with a file that shows it is there: asking dpkg would miss a library that
# came another way, and takes longer.
drench_packages=(
  "g++:/usr/bin/g++"
  "cmake:/usr/bin/cmake"
  "ninja-build:/usr/bin/ninja"
  "ccache:/usr/bin/ccache"
  "libopenvdb-dev:/usr/include/openvdb/openvdb.h"
  "libboost-iostreams-dev:/usr/include/boost/iostreams/stream.hpp"
  "libembree-dev:/usr/include/embree3/rtcore.h /usr/include/embree4/rtcore.h"
  "libopenexr-dev:/usr/include/OpenEXR/ImfRgbaFile.h"
  "libosd-dev:/usr/include/opensubdiv/far/primvarRefiner.h"
  "libimath-dev:/usr/include/Imath/ImathVec.h"
  "libtbb-dev:/usr/include/tbb/task_arena.h"
  "libpng-dev:/usr/include/png.h"
  "libjpeg62-turbo-dev:/usr/include/jpeglib.h"
  "libzstd-dev:/usr/include/zstd.h"
  "libtiff-dev:/usr/include/x86_64-linux-gnu/tiffio.h /usr/include/tiffio.h"
  "libgtest-dev:/usr/include/gtest/gtest.h"
  "libcli11-dev:/usr/include/CLI/CLI.hpp"
  "libtomlplusplus-dev:/usr/include/toml++/toml.h /usr/include/toml++/toml.hpp"
  "nlohmann-json3-dev:/usr/include/nlohmann/json.hpp"
  "libfmt-dev:/usr/include/fmt/format.h"
  "libxxhash-dev:/usr/include/xxhash.h"
  "libcpp-httplib-dev:/usr/include/httplib.h"
  "libopencolorio-dev:/usr/include/OpenColorIO/OpenColorIO.h"
  "ffmpeg:/usr/bin/ffmpeg"
  "python3:/usr/bin/python3"
)

# What few need: ./test --blender and ./bench render_vs_cycles.
drench_use_blender() {
  drench_packages+=(
    "blender:/usr/bin/blender"
    "python3-numpy:/usr/lib/python3/dist-packages/numpy/__init__.py"
  )
}

# ./bench render_skips counts instructions.
drench_use_valgrind() { drench_packages+=("valgrind:/usr/bin/valgrind"); }

# ./bench --pages.
drench_use_plots() {
  drench_packages+=("python3-matplotlib:/usr/lib/python3/dist-packages/matplotlib/__init__.py")
}

# ./test --fuzz.
drench_use_clang() { drench_packages+=("clang:/usr/bin/clang++"); }

# The cluster and the mounts that tests of the farm make, and the browser that opens reports; without
# them these tests are left out.
drench_try_optional() {
  if ! (
    drench_packages=(
      "slurm-wlm:/usr/sbin/slurmctld"
      "munge:/usr/sbin/munged"
      "bindfs:/usr/bin/bindfs"
      "chromium:/usr/bin/chromium"
    )
    drench_install
  ); then
    printf 'drench: no Slurm, bindfs or Chromium, so their tests are left out\n' >&2
  fi
}

drench_missing_packages() {
  local entry package files file found
  for entry in "${drench_packages[@]}"; do
    package=${entry%%:*}
    read -r -a files <<< "${entry#*:}"
    found=no
    for file in "${files[@]}"; do
      if [[ -e $file ]]; then found=yes; fi
    done
    if [[ $found == no ]]; then printf '%s\n' "$package"; fi
  done
}

# Whether a person is there to be asked.
drench_on_terminal() { [[ -t 0 && -t 2 ]]; }

# Scripts and CI are not asked: they have asked for the packages by calling.
drench_may_install() {
  local answer
  if [[ ${drench_yes:-no} == yes ]] || ! drench_on_terminal; then return 0; fi
  printf 'drench: missing: %s\nInstall these packages with apt-get? [y/N] ' "$*" >&2
  read -r answer || answer=
  case $answer in
    [yY] | [yY][eE][sS]) return 0 ;;
  esac
  printf 'drench: nothing was installed. By hand: apt-get install %s\n' "$*" >&2
  return 1
}

drench_install() {
  local missing as_root=()
  mapfile -t missing < <(drench_missing_packages)
  if ((${#missing[@]} == 0)); then return 0; fi
  if ! command -v apt-get > /dev/null; then
    printf 'drench: missing, and no apt-get to install them: %s\n' "${missing[*]}" >&2
    return 1
  fi
  if ((EUID != 0)); then
    if ! command -v sudo > /dev/null; then
      printf 'drench: missing: %s\nInstall them as root: apt-get install %s\n' \
        "${missing[*]}" "${missing[*]}" >&2
      return 1
    fi
    as_root=(sudo)
  fi
  drench_may_install "${missing[@]}" || return 1
  printf 'drench: installing %s\n' "${missing[*]}" >&2
  "${as_root[@]}" apt-get update -qq >&2
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" >&2
  mapfile -t missing < <(drench_missing_packages)
  if ((${#missing[@]} > 0)); then
    printf 'drench: still missing after the installation: %s\n' "${missing[*]}" >&2
    return 1
  fi
}

# Whether a GPU is there that the CUDA simulator could run on.
drench_has_device() { compgen -G '/dev/nvidia[0-9]*' > /dev/null; }

# Configures once and builds; a second time this takes as long as ninja needs to see that nothing
# changed. `drench_cuda` is what DRENCH_CUDA becomes where the build does not say it yet, the
# environment's DRENCH_CUDA what it becomes in any case.
drench_build() {
  local cuda=${DRENCH_CUDA:-} before=
  if [[ -f $root/build/CMakeCache.txt ]]; then
    before=$(sed -n 's/^DRENCH_CUDA:STRING=//p' "$root/build/CMakeCache.txt")
  fi
  # What ./run left out ./test needs; what was asked for by name stays.
  if [[ -z $cuda && ( -z $before || ($before == OFF && ${drench_cuda:-AUTO} == AUTO) ) ]]; then
    cuda=${drench_cuda:-AUTO}
  fi
  if [[ ! -f $root/build/build.ninja || (-n $cuda && $cuda != "$before") ]]; then
    cmake --preset release -S "$root" ${cuda:+-DDRENCH_CUDA=$cuda} >&2
  fi
  cmake --build "$root/build" -j"$(nproc)" --target "$@" >&2
}

# The last commit to anything but documents, + behind it where code has changed since: rows and pages
# make no new state.
drench_code_commit() {
  local code=(-- "$root" ":(exclude,top)docs" ":(exclude,top)*.md")
  git -C "$root" log -1 --abbrev=7 --format=%h "${code[@]}" | tr -d '\n'
  if [[ -n $(git -C "$root" status --porcelain "${code[@]}") ]]; then printf '+'; fi
}
