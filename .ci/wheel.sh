# Wheels of the Python package with the programs; sourced by dev. They are built on Debian 12, whose C library is the oldest
# that has what groundray uses: systems with glibc 2.35 or later run them.

packing_packages=(dpkg-dev file zstd libproj-dev libgeotiff-dev libcurl4-openssl-dev libjson-c-dev libdeflate-dev liblzma-dev
  libzstd-dev libqhull-dev libdraco-dev libutfcpp-dev libminizip-dev)
wheel_platform=manylinux_2_35_x86_64

# slim PACKAGE SETTING...: builds a library of Debian's source package with few parts, in build/wheel/slim.
slim() {
  local package=$1 folder=$PWD/build/wheel
  local log=$folder/$package.log
  [[ ! -e $folder/slim/$package ]] || return 0
  echo "dev: building $package in build/wheel"
  rm -f "$PWD/build/apt/bookworm/$package"_*
  debian_apt bookworm source --download-only "$package" >"$log" 2>&1 ||
    { echo "dev: its source cannot be fetched; see $log" >&2; return 1; }
  rm -rf "$folder/${package}_source"
  dpkg-source --no-check -x "$PWD/build/apt/bookworm/$package"_*.dsc "$folder/${package}_source" >>"$log" 2>&1
  cmake -S "$folder/${package}_source" -B "$folder/${package}_build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_INSTALL_PREFIX="$folder/slim" -DCMAKE_INSTALL_LIBDIR=lib \
    -DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache "${@:2}" >>"$log" 2>&1 &&
    cmake --build "$folder/${package}_build" --target install >>"$log" 2>&1 ||
    { echo "dev: it cannot be built; see $log" >&2; return 1; }
  touch "$folder/slim/$package"
}

# GDAL with no drivers but those of DEMs and photos (docs/reference/trust.md), and assimp with no readers but those that
# core/model uses. Programs load them instead of Debian's, which would add 57 libraries and 104 MiB, and 7 MiB.
slim_libraries() {
  local part settings=()
  mkdir -p build/wheel/slim/lib
  for part in HFA AAIGRID DTED PNG SRTMHGT USGSDEM RAW JPEG XYZ; do
    settings+=("-DGDAL_ENABLE_DRIVER_$part=ON")
  done
  for part in ZLIB TIFF GEOTIFF PNG JPEG CURL JSONC OPENSSL DEFLATE LIBLZMA ZSTD QHULL; do
    settings+=("-DGDAL_USE_$part=ON")
  done
  slim gdal "${settings[@]}" -DGDAL_BUILD_OPTIONAL_DRIVERS=OFF -DOGR_BUILD_OPTIONAL_DRIVERS=OFF \
    -DGDAL_USE_EXTERNAL_LIBS=OFF -DGDAL_USE_INTERNAL_LIBS=OFF -DENABLE_GNM=OFF \
    -DBUILD_APPS=OFF -DBUILD_PYTHON_BINDINGS=OFF -DBUILD_TESTING=OFF
  local versions=$PWD/build/wheel/assimp_source/debian/libassimp.ver
  slim assimp -DASSIMP_BUILD_ALL_IMPORTERS_BY_DEFAULT=OFF -DASSIMP_BUILD_STL_IMPORTER=ON -DASSIMP_BUILD_GLTF_IMPORTER=ON \
    -DASSIMP_NO_EXPORT=ON -DASSIMP_BUILD_TESTS=OFF -DASSIMP_BUILD_ASSIMP_TOOLS=OFF -DASSIMP_BUILD_ZLIB=OFF \
    -DASSIMP_WARNINGS_AS_ERRORS=OFF -DCMAKE_CXX_FLAGS=-DASSIMP_ENABLE_DRACO=1 \
    "-DCMAKE_SHARED_LINKER_FLAGS=-Wl,--version-script=$versions"
  # OpenCV's core loads GLX, and by it X11, for windows of OpenGL, of which groundray opens none.
  printf 'void* %s(void) { return 0; }\n' glXGetCurrentContext glXGetCurrentDisplay glXGetProcAddressARB |
    gcc -shared -fPIC -Wl,-soname,libGLX.so.0 -x c - -o build/wheel/slim/lib/libGLX.so.0
}

# The headers of Python 3.13 go to build/wheel/python3.13: Debian 12 has none that know the stable ABI of 3.12.
stable_abi_headers() {
  local folder=$PWD/build/wheel/python3.13
  [[ ! -e $folder/usr/include/python3.13/Python.h ]] || return 0
  rm -f "$PWD"/build/apt/trixie/libpython3.13-dev_*.deb
  debian_apt trixie download libpython3.13-dev
  dpkg-deb -x "$PWD"/build/apt/trixie/libpython3.13-dev_*.deb "$folder"
}

# wheel: two wheels in out/wheel, one for Python 3.11 and one of the stable ABI for 3.12 and later.
wheel() {
  local folder=$PWD/build/wheel
  local headers=$folder/python3.13/usr/include
  [[ $(debian_suite) == bookworm ]] ||
    { echo "dev: wheels are built on Debian 12: others have C libraries that fewer systems have" >&2; return 1; }
  mkdir -p "$folder" out/wheel
  slim_libraries
  stable_abi_headers
  rm -rf "$folder/built" "$folder/repaired" out/wheel/*.whl
  .venv/bin/pip wheel . --quiet --no-deps --wheel-dir "$folder/built" --config-settings=build-dir="$folder/tree" \
    --config-settings=build.targets="groundray;groundray-golden;groundray_python_stub;groundray_python_abi3" \
    --config-settings=cmake.define.GROUNDRAY_STABLE_ABI_HEADERS="$headers/python3.13;$headers"
  local built=("$folder"/built/groundray-*.whl)
  .venv/bin/python .ci/pack_wheels.py "${built[0]}" "$folder" out/wheel --platform "$wheel_platform"
}

# try_wheels: installs the wheels in a bare Debian 12 and 13, which have Python 3.11 and 3.13.
try_wheels() {
  local suite root wheel
  for suite in bookworm trixie; do
    root=$PWD/build/bare_$suite
    make_debian_root "$suite" "$root" python3-venv
    wheel=(out/wheel/groundray-*-"$([[ $suite == bookworm ]] && echo cp311-cp311 || echo cp312-abi3)"-*.whl)
    rm -rf "${root:?}/groundray"
    mkdir "$root/groundray"
    cp -r "${wheel[@]}" .ci/try_wheel.sh data "$root/groundray/"
    echo "dev: ${wheel[0]##*/} on Debian ($suite)"
    in_debian_root "$root" bash /groundray/try_wheel.sh
  done
}
