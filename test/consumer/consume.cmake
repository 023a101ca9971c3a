# Installs the build in BUILD into a fresh prefix under SCRATCH, then builds and runs this folder's project and the
# two examples of docs/guide/library.md against it.
function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${SCRATCH})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${SCRATCH}/prefix)
run(${CMAKE_COMMAND} -G Ninja -S ${CMAKE_CURRENT_LIST_DIR} -B ${SCRATCH}/build
  -DCMAKE_PREFIX_PATH=${SCRATCH}/prefix
  -DCMAKE_BUILD_TYPE=${BUILD_TYPE} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS})
run(${CMAKE_COMMAND} --build ${SCRATCH}/build)
run(${SCRATCH}/build/consumer)

# The page's CMake lines with its first block of C++ (scene file) and its second one (DEM).
file(READ ${CMAKE_CURRENT_LIST_DIR}/../../docs/guide/library.md page)
string(REPLACE ";" "<semicolon>" page "${page}")  # which would separate items of a list
string(REGEX MATCHALL "\n```(cmake|cpp)\n[^`]+" blocks "${page}")
list(LENGTH blocks count)
if(NOT count EQUAL 3)
  message(FATAL_ERROR "docs/guide/library.md has ${count} blocks of CMake and C++; there must be 3")
endif()
list(TRANSFORM blocks REPLACE "^\n```[a-z]+\n" "")
list(GET blocks 0 cmake)
foreach(index RANGE 1 2)
  list(GET blocks ${index} cpp)
  string(REPLACE "<semicolon>" ";" cpp "${cpp}")
  set(folder ${SCRATCH}/example_${index})
  file(WRITE ${folder}/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)\nproject(example LANGUAGES CXX)\n${cmake}")
  file(WRITE ${folder}/example.cpp "${cpp}")
  run(${CMAKE_COMMAND} -G Ninja -S ${folder} -B ${folder}/build
    -DCMAKE_PREFIX_PATH=${SCRATCH}/prefix
    -DCMAKE_BUILD_TYPE=${BUILD_TYPE} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS})
  run(${CMAKE_COMMAND} --build ${folder}/build)
endforeach()

set(data ${SCRATCH}/prefix/share/groundray/data)
function(read_count file variable)  # the number of points in a PLY file
  file(STRINGS ${file} line REGEX "^element vertex [0-9]+$" LIMIT_COUNT 1)
  string(REPLACE "element vertex " "" line "${line}")
  set(${variable} "${line}" PARENT_SCOPE)
endfunction()

# The first example makes the scan that the program makes.
set(scene ${data}/scenes/first_light.yaml)
set(ENV{GROUNDRAY_DATA} ${data})
run(${SCRATCH}/example_1/build/example ${scene} ${SCRATCH}/scan.ply)
run(${SCRATCH}/prefix/bin/groundray generate ${scene} -o ${SCRATCH}/dataset)
file(GLOB scans ${SCRATCH}/dataset/lidar/*/000000.ply)
list(GET scans 0 scan)
read_count(${scan} expected)
read_count(${SCRATCH}/scan.ply points)
if(NOT points OR NOT points EQUAL expected)
  message(FATAL_ERROR "the example of docs/guide/library.md wrote '${points}' points, groundray generate '${expected}'")
endif()

# groundray::dataset reads back what the program wrote.
run(${SCRATCH}/build/consumer ${SCRATCH}/dataset ${expected})

run(${SCRATCH}/example_2/build/example ${data}/terrain/prairie_1m.tif ${data}/sensors/velodyne_vlp16.yaml ${SCRATCH}/scan.ply)
file(SIZE ${SCRATCH}/scan.ply bytes)
if(bytes LESS 900000)
  message(FATAL_ERROR "the example of docs/guide/library.md wrote ${bytes} bytes, but 12361 points take a megabyte")
endif()
