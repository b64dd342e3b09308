# The CUDA simulator is built whenever nvcc is there: PTX for anything from 8.0 on, and code for sm_90
# made of the same PTX. PTX for 9.0 would be the same but for its name, and is most of nvcc's time.
# CMAKE_CUDA_ARCHITECTURES asks for others. docs/decisions/0203-nvcc-units.md
#
# The runtime library is a shared one, so that tests/gpu/emulator can stand in for it, whose reports name
# the source lines that the code is compiled with: packed, it is smaller than without them.
set(DRENCH_HAS_CUDA OFF)
if(NOT DRENCH_CUDA STREQUAL OFF)
  if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES AND NOT DEFINED ENV{CUDAARCHS})
    set(CMAKE_CUDA_ARCHITECTURES OFF)
    set(cuda_code " --generate-code=arch=compute_80,code=[compute_80,sm_90]")
  endif()
  set(CMAKE_CUDA_RUNTIME_LIBRARY Shared)
  include(CheckLanguage)
  check_language(CUDA)
  if(CMAKE_CUDA_COMPILER)
    enable_language(CUDA)
    string(APPEND CMAKE_CUDA_FLAGS " -lineinfo --compress-mode=size${cuda_code}")
    find_package(CUDAToolkit REQUIRED)
    set(DRENCH_HAS_CUDA ON)
  elseif(DRENCH_CUDA STREQUAL ON)
    message(FATAL_ERROR "DRENCH_CUDA=ON but no nvcc was found; install the CUDA Toolkit or set AUTO")
  endif()
endif()
message(STATUS "CUDA simulator: ${DRENCH_HAS_CUDA}")
