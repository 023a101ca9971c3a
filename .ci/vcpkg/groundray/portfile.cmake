# Not tried. Builds the libraries and programs, without the viewer, from the clone that this port lies in.
cmake_path(SET source NORMALIZE "${CMAKE_CURRENT_LIST_DIR}/../../..")
vcpkg_cmake_configure(SOURCE_PATH "${source}"
  OPTIONS -DGROUNDRAY_TESTS=OFF -DGROUNDRAY_BENCHMARKS=OFF -DGROUNDRAY_VIEW=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME groundray CONFIG_PATH lib/cmake/groundray)
vcpkg_copy_tools(TOOL_NAMES groundray groundray-golden AUTO_CLEAN)
vcpkg_install_copyright(FILE_LIST "${source}/LICENSE")
