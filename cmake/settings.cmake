# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

include(CTest)
# Packages are found beside the targets that need them, and used by all that link those.
set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL ON)
option(SLSD_BENCHMARKS "Build the benchmarks" ON)
option(SLSD_UNITY "Compile the files of a library together: quicker from nothing, slower after a change of one of them" ON)
option(SLSD_DEVICES "Build the drivers of cameras and projectors, calibrating and all clients; OFF: slsd and slsctl for recorded frames" ON)
option(SLSD_FUZZERS "Build the libFuzzer targets (needs clang)" OFF)
set(SLSD_SANITIZE "" CACHE STRING "Sanitizers to build with, as for -fsanitize=")

# For files whose names, or whose headers' macros, stand in each other's way.
function(slsd_compile_apart)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# For libraries of which a small program, as slsd-picture, is linked with what it needs alone.
function(slsd_link_by_file target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD OFF)
endfunction()

# For rooms that compute little: of the build for recorded frames, which is to be quick, they need no optimizing.
macro(slsd_compile_quickly)
  if(NOT SLSD_DEVICES)
    add_compile_options(-O0)
  endif()
endmacro()

add_library(slsd_settings INTERFACE)
target_include_directories(slsd_settings INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(slsd_settings INTERFACE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion
  $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor>)
# GCC 12 sees memory overlap in std::string where none does (its bug 105651).
target_compile_options(slsd_settings INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
# No function is replaced when a program is loaded, nothing reads errno after a root, no comparison traps: one twentieth
# of the time of decoding, and the same results to the last bit.
target_compile_options(slsd_settings INTERFACE -fno-semantic-interposition -fno-math-errno -fno-trapping-math)
target_compile_definitions(slsd_settings INTERFACE SLSD_VERSION="${PROJECT_VERSION}")
if(SLSD_SANITIZE)
  add_compile_options(-fsanitize=${SLSD_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${SLSD_SANITIZE})
  # Before it reads an object's type the sanitizer asks through a pipe whether it may: the tests that use up all
  # descriptors leave it none, and then each virtual call looks wrong.
  add_compile_options(-fno-sanitize=vptr)
  if(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
    link_libraries(atomic)
    # As GCC defines them; tests that measure memory read these.
    if(SLSD_SANITIZE MATCHES address)
      add_compile_definitions(__SANITIZE_ADDRESS__)
    elseif(SLSD_SANITIZE MATCHES thread)
      add_compile_definitions(__SANITIZE_THREAD__)
    endif()
  endif()
endif()
if(SLSD_FUZZERS)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()
