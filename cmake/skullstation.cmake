# How a folder of this project becomes a target.

add_library(skullstation_build_flags INTERFACE)
target_include_directories(skullstation_build_flags INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(skullstation_build_flags INTERFACE
  -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wpedantic
  # The same bytes on every machine: no fused multiply-add chosen by the compiler.
  -ffp-contract=off
  $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>  # without it ccache can't see into precompiled headers
  $<$<BOOL:${SKULLSTATION_WERROR}>:-Werror>)
if(SKULLSTATION_SANITIZE)
  target_compile_options(skullstation_build_flags INTERFACE
    -fsanitize=${SKULLSTATION_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(skullstation_build_flags INTERFACE -fsanitize=${SKULLSTATION_SANITIZE})
endif()

# What nearly every source includes of other people's headers is compiled once: a third of the time
# of a small source. The preset `dev` goes without and so proves that each source includes what it
# uses. JSON and CLI11 bring inline code that each source compiles again, precompiled or not: only
# the outer folders (daemon, bench) have them.
function(skullstation_precompile_words)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/words.cpp CONTENT "")
  set(words <Eigen/Cholesky> <Eigen/Core> <Eigen/Geometry> <Eigen/LU> <algorithm> <array> <chrono>
            <cmath> <filesystem> <fmt/format.h> <functional> <map> <memory> <optional> <span> <string>
            <tl/expected.hpp> <utility> <vector>)
  foreach(name skullstation_words skullstation_outer_words)
    add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/words.cpp)
    target_link_libraries(${name}
      PRIVATE skullstation_build_flags Eigen3::Eigen Threads::Threads fmt::fmt)
    target_include_directories(${name} SYSTEM PRIVATE ${TL_EXPECTED_INCLUDE_DIR})
    target_precompile_headers(${name} PRIVATE ${words})
  endforeach()
  target_compile_options(skullstation_outer_words PRIVATE ${SKULLSTATION_OUTER_OPTIONS})
  target_link_libraries(skullstation_outer_words
    PRIVATE nlohmann_json::nlohmann_json CLI11::CLI11)
  target_precompile_headers(skullstation_outer_words PRIVATE <CLI/CLI.hpp> <nlohmann/json.hpp>)
endfunction()

# What the outer folders and the tests do themselves is quick; what they call is compiled for speed.
set(SKULLSTATION_OUTER_OPTIONS $<$<CONFIG:Release>:-O1>)

# What the folder that is being read is compiled with; the outer folders set it to `outer_words`.
set(SKULLSTATION_WORDS words)
function(skullstation_compile_as_folder target)
  if(SKULLSTATION_WORDS STREQUAL outer_words)
    target_compile_options(${target} PRIVATE ${SKULLSTATION_OUTER_OPTIONS})
  endif()
  if(SKULLSTATION_PCH)
    target_precompile_headers(${target} REUSE_FROM skullstation_${SKULLSTATION_WORDS})
  endif()
endfunction()

# skullstation_library(NAME SOURCES a.cpp ... [PUBLIC targets ...] [PRIVATE targets ...]
#                      [WITHOUT_WORDS] [UNSANITIZED])
# makes the static library skullstation_NAME, alias skullstation::NAME. WITHOUT_WORDS: for what is
# compiled with other flags or another Eigen than everything else. UNSANITIZED: for what is nearly
# all a library's templates, which take minutes to compile with sanitizers.
function(skullstation_library name)
  cmake_parse_arguments(ARG "WITHOUT_WORDS;UNSANITIZED" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(skullstation_${name} STATIC ${ARG_SOURCES})
  add_library(skullstation::${name} ALIAS skullstation_${name})
  target_link_libraries(skullstation_${name}
    PUBLIC skullstation_build_flags ${ARG_PUBLIC}
    PRIVATE ${ARG_PRIVATE} fmt::fmt)
  if(NOT ARG_WITHOUT_WORDS)
    skullstation_compile_as_folder(skullstation_${name})
  endif()
  if(SKULLSTATION_SANITIZE AND ARG_UNSANITIZED)
    target_compile_options(skullstation_${name} PRIVATE -fno-sanitize=all)
  endif()
endfunction()

# skullstation_program(NAME SOURCES a.cpp ... [LINK targets ...])
# makes the program NAME.
function(skullstation_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE skullstation_build_flags ${ARG_LINK} fmt::fmt)
  skullstation_compile_as_folder(${name})
endfunction()

# skullstation_test(NAME SOURCES a_test.cpp ... [LINK targets ...] [LABEL unit] [TIMEOUT s]
#                   [ONE_PROCESS])
# makes the test program NAME and registers each of its tests with CTest under the label, or with
# ONE_PROCESS the program as a whole, labelled `dear`, too: for tests that share something dear to
# make. Sanitizers run those only on request (docs/testing.md).
function(skullstation_test name)
  cmake_parse_arguments(ARG "ONE_PROCESS" "LABEL;TIMEOUT" "SOURCES;LINK" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 600)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_compile_options(${name} PRIVATE ${SKULLSTATION_OUTER_OPTIONS})
  target_precompile_headers(${name} REUSE_FROM skullstation_test_words)
  target_link_libraries(${name} PRIVATE ${ARG_LINK} skullstation::test_support GTest::gmock_main)
  if(ARG_ONE_PROCESS)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABEL};dear" TIMEOUT ${ARG_TIMEOUT})
  else()
    gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST
      PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT})
  endif()
endfunction()
