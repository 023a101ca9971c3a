# Installs the build in BUILD into a fresh prefix under SCRATCH, then builds and runs this folder's project and the
# example of docs/library.md against it.
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

file(READ ${CMAKE_CURRENT_LIST_DIR}/../../docs/library.md page)
foreach(block cmake cpp)
  if(NOT page MATCHES "\n```${block}\n([^`]+)```\n")
    message(FATAL_ERROR "docs/library.md has no block of ${block}")
  endif()
  set(${block} "${CMAKE_MATCH_1}")
endforeach()
file(WRITE ${SCRATCH}/example/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)\nproject(example LANGUAGES CXX)\n${cmake}")
file(WRITE ${SCRATCH}/example/example.cpp "${cpp}")
run(${CMAKE_COMMAND} -G Ninja -S ${SCRATCH}/example -B ${SCRATCH}/example/build
  -DCMAKE_PREFIX_PATH=${SCRATCH}/prefix
  -DCMAKE_BUILD_TYPE=${BUILD_TYPE} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS})
run(${CMAKE_COMMAND} --build ${SCRATCH}/example/build)
set(data ${SCRATCH}/prefix/share/groundray)
run(${SCRATCH}/example/build/example ${data}/terrain/prairie_1m.tif ${data}/sensors/velodyne_vlp16.yaml ${SCRATCH}/scan.ply)
file(SIZE ${SCRATCH}/scan.ply bytes)
if(bytes LESS 900000)
  message(FATAL_ERROR "the example of docs/library.md wrote ${bytes} bytes, but 12361 points take a megabyte")
endif()
