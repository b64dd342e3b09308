# -DPROGRAM=... "-DFILTERS=a;b" -P: fails where a GoogleTest filter chooses no test of the program.
foreach(filter ${FILTERS})
  execute_process(COMMAND ${PROGRAM} --gtest_list_tests --gtest_filter=${filter}
    OUTPUT_VARIABLE tests COMMAND_ERROR_IS_FATAL ANY)
  if(NOT tests MATCHES "\n  ")
    message(SEND_ERROR "SLOW or LONG names ${filter}, but no test is called that: mend the list in "
      "tests/*/CMakeLists.txt")
  endif()
endforeach()
