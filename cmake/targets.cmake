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

# drench_add_tests(AREA LIBRARIES lib... SOURCES file...): one GoogleTest program an area,
# build/bin/drench_AREA_tests, every test registered with CTest.
function(drench_add_tests area)
  cmake_parse_arguments(arg "" "" "LIBRARIES;SOURCES" ${ARGN})
  set(program drench_${area}_tests)
  add_executable(${program} ${arg_SOURCES})
  target_link_libraries(${program} PRIVATE drench_flags ${arg_LIBRARIES} GTest::gtest GTest::gtest_main)
  target_compile_definitions(${program} PRIVATE DRENCH_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  include(GoogleTest)
  gtest_discover_tests(${program} DISCOVERY_MODE PRE_TEST TEST_PREFIX ${area}.
    PROPERTIES TIMEOUT 600 LABELS ${area})
endfunction()
