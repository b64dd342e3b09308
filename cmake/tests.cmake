# drench_add_tests(AREA LIBRARIES lib... SOURCES file... SLOW filter... LONG filter...): one GoogleTest
# program an area, build/bin/drench_AREA_tests, every test registered with CTest and labelled AREA and
# quick or full. Full are those of the GoogleTest filters (* and ? are wild) SLOW, more than 2 CPU
# seconds, and LONG, more than 20.
#
# Where four others share two cores a test takes up to eight times its CPU seconds: quick ones have 60 s,
# slow ones 240, long ones 900. A limit ends what hangs, and a quick test that has become slow fails by
# it.
set(DRENCH_TEST_PATIENCE 1 CACHE STRING "Factor on the time limits of tests, for slow machines")
function(drench_add_tests area)
  cmake_parse_arguments(arg "" "" "LIBRARIES;SOURCES;SLOW;LONG" ${ARGN})
  set(program drench_${area}_tests)
  add_executable(${program} ${arg_SOURCES})
  target_link_libraries(${program} PRIVATE drench_flags ${arg_LIBRARIES} GTest::gtest GTest::gtest_main)
  target_compile_definitions(${program} PRIVATE DRENCH_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  set_property(DIRECTORY APPEND PROPERTY LABELS ${area})
  list(JOIN arg_SLOW ":" slow)
  list(JOIN arg_LONG ":" long)
  drench_discover(${area} "*-${slow}:${long}" quick 60)
  if(slow)
    drench_discover(${area} "${slow}" full 240)
  endif()
  if(long)
    drench_discover(${area} "${long}" full 900)
  endif()
  # A filter that a renamed test has left behind would keep nothing out of the quick tests.
  if(slow OR long)
    add_test(NAME ${area}.filters COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${program}>
      "-DFILTERS=${arg_SLOW};${arg_LONG}" -P ${CMAKE_SOURCE_DIR}/cmake/check_filters.cmake)
    set_tests_properties(${area}.filters PROPERTIES LABELS quick TIMEOUT 60)
  endif()
endfunction()

function(drench_discover area filter tier limit)
  include(GoogleTest)
  math(EXPR limit "${limit} * ${DRENCH_TEST_PATIENCE}")
  gtest_discover_tests(drench_${area}_tests DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
    TEST_PREFIX ${area}.
    TEST_FILTER "${filter}" PROPERTIES TIMEOUT ${limit} LABELS ${tier})
endfunction()
