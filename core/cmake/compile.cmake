# How groundray's own targets compile: compiler cache, flags, precompiled headers, and several sources at a time.
# What is set here holds for this build alone; users of the libraries inherit none of it.

# Two builds of the same text share their objects, wherever their folders are: see "The compiler cache" in CONTRIBUTING.md.
find_program(CCACHE ccache)
if(CCACHE)
  set(cache_settings
    CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}  # paths below it are hashed, and passed to the compiler, as relative ones
    CCACHE_NOHASHDIR=1                    # -ffile-prefix-map below keeps the folder out of objects
    CCACHE_ABSSTDERR=1                    # messages name files by absolute paths all the same
    CCACHE_SLOPPINESS=pch_defines,time_macros)  # without it nothing that uses a precompiled header is cached
  execute_process(COMMAND ${CCACHE} --get-config max_size OUTPUT_VARIABLE cache_size)
  if(cache_size MATCHES "^5\\.0")  # ccache's default, which is too little for all builds of CI
    list(APPEND cache_settings CCACHE_MAXSIZE=10G)
  endif()
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env ${cache_settings} ${CCACHE})
endif()

# What every target compiles with. OpenMP is there for its simd pragmas alone: they let loops that look for a maximum use
# vectors, and a maximum is the same in any order. Programs compile as libraries do, so that all share a precompiled header.
add_library(groundray_build_flags INTERFACE)
target_compile_options(groundray_build_flags INTERFACE
  -march=x86-64-v3 -fopenmp-simd -fno-math-errno -fno-trapping-math -fPIC -ffile-prefix-map=${PROJECT_SOURCE_DIR}=.
  -Wall -Wextra -Wpedantic -Wno-missing-field-initializers -Wconversion -Wno-sign-conversion -Wshadow)
# Debian 13's tinyxml2 asks for this, and targets that share a precompiled header must agree.
if(TARGET tinyxml2::tinyxml2)
  get_target_property(definitions tinyxml2::tinyxml2 INTERFACE_COMPILE_DEFINITIONS)
  if("_FILE_OFFSET_BITS=64" IN_LIST definitions)
    target_compile_definitions(groundray_build_flags INTERFACE _FILE_OFFSET_BITS=64)
  endif()
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 15)
  # At -O3 GCC 12 to 14 see overflows that are not there in inlined code of std::string, std::vector and {fmt}.
  target_compile_options(groundray_build_flags INTERFACE
    $<$<CONFIG:Release>:-Wno-stringop-overflow -Wno-array-bounds -Wno-restrict>)
endif()

# What most files include, compiled once for all targets; files name what they need all the same. With Clang, CMake names
# precompiled headers by absolute paths, which the cache would take for different flags in each clone.
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)
endif()
set(precompiled_headers
  <algorithm> <array> <chrono> <cmath> <filesystem> <functional> <map> <memory> <optional> <span> <string> <variant>
  <vector> <fmt/format.h> <fmt/ranges.h> <glm/glm.hpp> <glm/gtc/quaternion.hpp>)
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled.cpp CONTENT "")

# groundray_precompile(TARGET HEADER...): precompiles headers in a target of its own, one for each CMakeLists.txt. When CMake
# compiles the header anew, its own command (-include cmake_pch.hxx) makes ccache hash the old cmake_pch.hxx.gch that lies
# beside it: the tree would no longer share objects with clean clones. A header with no such neighbour is included instead.
macro(groundray_precompile target)
  add_library(${target} OBJECT ${PROJECT_BINARY_DIR}/precompiled.cpp)
  target_compile_features(${target} PRIVATE cxx_std_20)
  target_compile_options(${target} PRIVATE -ffp-contract=off)
  target_link_libraries(${target} PRIVATE groundray_build_flags fmt::fmt glm::glm)
  target_precompile_headers(${target} PRIVATE ${ARGN})
  set(includes ${ARGN})
  list(TRANSFORM includes REPLACE "(.+)" "#include \\1\n")
  list(JOIN includes "" includes)
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/precompiled.h CONTENT "${includes}" @ONLY)
  set(CMAKE_CXX_COMPILE_OPTIONS_CREATE_PCH -Winvalid-pch -x c++-header -include ${CMAKE_CURRENT_BINARY_DIR}/precompiled.h)
endmacro()
groundray_precompile(groundray_precompiled ${precompiled_headers})

# Compiles up to eight sources of a folder as one: the build takes half of the time, for what they share is compiled once.
# Names that a source keeps to itself must then be unique in its folder, which `./dev lint` checks. Not CMAKE_UNITY_BUILD:
# CMake names the sources by absolute paths, and two folders would share no object of the cache.
option(GROUNDRAY_JOIN_SOURCES "Compile several sources of a folder as one" ON)
set(sources_in_one 8)

# groundray_compile(TARGET [PRECOMPILED]): settings of a target, called when it has its sources and flags. PRECOMPILED is the
# target whose precompiled header it uses.
function(groundray_compile target)
  set(precompiled groundray_precompiled)
  if(ARGC GREATER 1)
    set(precompiled ${ARGV1})
  endif()
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:groundray_build_flags>)
  target_precompile_headers(${target} REUSE_FROM ${precompiled})
  if(GROUNDRAY_JOIN_SOURCES)
    join_sources(${target})
  endif()
  set_property(GLOBAL APPEND PROPERTY groundray_objects $<TARGET_OBJECTS:${target}>)
endfunction()

# Adds the target odr, which merges the objects of all libraries and programs as link-time optimisation does. The compiler
# thus compares all types of one name, also those in different programs, but generates no code. For the preset odr.
function(groundray_check_odr)
  get_property(objects GLOBAL PROPERTY groundray_objects)
  separate_arguments(flags UNIX_COMMAND "${CMAKE_CXX_FLAGS}")
  add_custom_command(OUTPUT odr.o
    COMMAND ${CMAKE_CXX_COMPILER} ${flags} -r -flinker-output=rel -nostdlib -Wl,-z,muldefs ${objects} -o odr.o
    DEPENDS ${objects} COMMAND_EXPAND_LISTS VERBATIM COMMENT "Comparing types of one name")
  add_custom_target(odr DEPENDS odr.o)
endfunction()

# Replaces a target's sources, folder by folder, by files that include them. Those with flags of their own stay alone.
function(join_sources target)
  get_target_property(sources ${target} SOURCES)
  set(folders)
  foreach(source ${sources})
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
    get_source_file_property(options ${source} COMPILE_OPTIONS)
    get_source_file_property(definitions ${source} COMPILE_DEFINITIONS)
    if(options OR definitions OR NOT source MATCHES "\\.cpp$")
      continue()
    endif()
    cmake_path(RELATIVE_PATH source BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE place)
    cmake_path(GET place PARENT_PATH folder)
    string(REPLACE / _ folder "/${folder}")
    list(APPEND folders ${folder})
    list(APPEND places_${folder} ${place})
  endforeach()
  list(REMOVE_DUPLICATES folders)
  foreach(folder ${folders})
    list(LENGTH places_${folder} count)
    math(EXPR files "(${count} + ${sources_in_one} - 1) / ${sources_in_one}")
    foreach(index RANGE 1 ${files})
      # Shares as equal as can be: 9 sources are 4 and 5.
      math(EXPR first "${count} * (${index} - 1) / ${files}")
      math(EXPR length "${count} * ${index} / ${files} - ${first}")
      if(length EQUAL 1)
        continue()
      endif()
      list(SUBLIST places_${folder} ${first} ${length} places)
      list(TRANSFORM places REPLACE "(.+)" "#include \"\\1\"\n" OUTPUT_VARIABLE includes)
      list(JOIN includes "" includes)
      set(joined ${CMAKE_CURRENT_BINARY_DIR}/${target}_sources/${index}${folder}.cpp)
      file(CONFIGURE OUTPUT ${joined} CONTENT "${includes}" @ONLY)
      target_sources(${target} PRIVATE ${joined})
      list(TRANSFORM places PREPEND ${PROJECT_SOURCE_DIR}/)
      foreach(place ${places})
        get_source_file_property(joined_before ${place} HEADER_FILE_ONLY)
        if(joined_before)
          message(FATAL_ERROR "${place} is in two targets of one CMakeLists.txt: make it a library that both link")
        endif()
      endforeach()
      set_source_files_properties(${places} PROPERTIES HEADER_FILE_ONLY ON)
    endforeach()
  endforeach()
endfunction()
