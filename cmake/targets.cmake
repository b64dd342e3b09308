# Flags of every target. One instruction set (x86-64-v3: AVX2 and FMA) and no silent contraction, so
# that the same source gives the same bits; errno and traps off lets packs vectorise without fast-math.
add_library(drench_flags INTERFACE)
target_compile_features(drench_flags INTERFACE cxx_std_20)
target_include_directories(drench_flags INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(drench_flags INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-march=x86-64-v3
  -ffp-contract=off -fno-math-errno -fno-trapping-math -Wall -Wextra -Werror=return-type>)
if(DRENCH_SANITIZE)
  target_compile_options(drench_flags INTERFACE
    $<$<COMPILE_LANGUAGE:CXX>:-fsanitize=address,undefined -fno-omit-frame-pointer>)
  target_link_options(drench_flags INTERFACE -fsanitize=address,undefined)
endif()
if(DRENCH_FUZZ)
  target_compile_options(drench_flags INTERFACE -fsanitize=fuzzer-no-link,address,undefined
    -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
  target_link_options(drench_flags INTERFACE -fsanitize=address,undefined)
endif()
