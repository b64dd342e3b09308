# Everything Drench links, by Debian 12 name in README.md. TBB and OpenEXR are looked for with CONFIG
# before OpenVDB, whose own modules of the same names would shadow them.
find_package(Threads REQUIRED)
find_package(TBB CONFIG REQUIRED)
find_package(Imath CONFIG REQUIRED)
find_package(OpenEXR CONFIG REQUIRED)
find_package(PNG REQUIRED)
find_package(JPEG REQUIRED)
find_package(TIFF REQUIRED)
find_package(fmt CONFIG REQUIRED)
find_package(nlohmann_json CONFIG REQUIRED)
find_package(GTest CONFIG REQUIRED)
find_package(embree 4 CONFIG QUIET)
if(NOT embree_FOUND)
  find_package(embree 3 CONFIG REQUIRED)
endif()

# Optional. Debian's package has no OpenColorIOConfig.
if(DRENCH_OCIO)
  find_path(OCIO_INCLUDE OpenColorIO/OpenColorIO.h)
  find_library(OCIO_LIBRARY OpenColorIO)
  if(OCIO_INCLUDE AND OCIO_LIBRARY)
    add_library(OpenColorIO::OpenColorIO UNKNOWN IMPORTED)
    set_target_properties(OpenColorIO::OpenColorIO PROPERTIES
      IMPORTED_LOCATION ${OCIO_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${OCIO_INCLUDE})
  endif()
endif()

# CLI11, toml++ and xxHash are header-only and found by their headers.
foreach(header CLI/CLI.hpp toml++/toml.h xxhash.h)
  string(MAKE_C_IDENTIFIER "DRENCH_${header}" variable)
  find_path(${variable} ${header} REQUIRED)
endforeach()

# Debian's cpp-httplib has no config; the library was built with all three, and its classes differ
# without.
find_path(HTTPLIB_INCLUDE httplib.h REQUIRED)
find_library(HTTPLIB_LIBRARY cpp-httplib REQUIRED)
add_library(httplib::httplib UNKNOWN IMPORTED)
set_target_properties(httplib::httplib PROPERTIES
  IMPORTED_LOCATION ${HTTPLIB_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${HTTPLIB_INCLUDE})
target_compile_definitions(httplib::httplib INTERFACE
  CPPHTTPLIB_OPENSSL_SUPPORT CPPHTTPLIB_ZLIB_SUPPORT CPPHTTPLIB_BROTLI_SUPPORT)
target_link_libraries(httplib::httplib INTERFACE Threads::Threads)

# The config of Debian's package names static libraries that the package has not.
find_path(OPENSUBDIV_INCLUDE opensubdiv/far/primvarRefiner.h REQUIRED)
find_library(OPENSUBDIV_LIBRARY osdCPU REQUIRED)
add_library(OpenSubdiv::osdCPU UNKNOWN IMPORTED)
set_target_properties(OpenSubdiv::osdCPU PROPERTIES
  IMPORTED_LOCATION ${OPENSUBDIV_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${OPENSUBDIV_INCLUDE})

# Debian ships no OpenVDBConfig and its FindOpenVDB asks for Boost libraries that are not needed:
# the library and its headers are enough.
find_path(OPENVDB_INCLUDE openvdb/openvdb.h REQUIRED)
find_library(OPENVDB_LIBRARY openvdb REQUIRED)
add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
set_target_properties(OpenVDB::openvdb PROPERTIES
  IMPORTED_LOCATION ${OPENVDB_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${OPENVDB_INCLUDE})
target_link_libraries(OpenVDB::openvdb INTERFACE Imath::Imath TBB::tbb)
