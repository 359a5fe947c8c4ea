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

# skullstation_library(NAME SOURCES a.cpp ... [PUBLIC targets ...] [PRIVATE targets ...])
# makes the static library skullstation_NAME, alias skullstation::NAME.
function(skullstation_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(skullstation_${name} STATIC ${ARG_SOURCES})
  add_library(skullstation::${name} ALIAS skullstation_${name})
  target_link_libraries(skullstation_${name}
    PUBLIC skullstation_build_flags ${ARG_PUBLIC}
    PRIVATE ${ARG_PRIVATE})
endfunction()

# What tests do themselves is quick; what they test is compiled as it ships.
set(SKULLSTATION_TEST_OPTIONS $<$<CONFIG:Release>:-O1>)

# skullstation_test(NAME SOURCES a_test.cpp ... [LINK targets ...] [LABEL unit] [TIMEOUT s]
#                   [ONE_PROCESS])
# makes the test program NAME and registers each of its tests with CTest under the label, or with
# ONE_PROCESS the program as a whole: for tests that share something dear to make.
function(skullstation_test name)
  cmake_parse_arguments(ARG "ONE_PROCESS" "LABEL;TIMEOUT" "SOURCES;LINK" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL unit)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 600)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_compile_options(${name} PRIVATE ${SKULLSTATION_TEST_OPTIONS})
  target_precompile_headers(${name} REUSE_FROM skullstation_test_words)
  target_link_libraries(${name} PRIVATE ${ARG_LINK} skullstation::test_support GTest::gmock_main)
  if(ARG_ONE_PROCESS)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT})
  else()
    gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST
      PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT})
  endif()
endfunction()
