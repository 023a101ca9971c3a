# Debian packages, and an archive that runs from any folder; sourced by dev.

# packages: those of core/cmake/packages.cmake, for this release of Debian, in out/packages.
packages() {
  local libraries
  libraries=$(printf '%s\n' "${program_packages[@]}" | grep -e '-dev$' | paste -sd,)
  configure release 'GOLDEN VIEW' "-DGROUNDRAY_LIBRARY_PACKAGES=${libraries//,/, }" \
    "-DCPACK_DEBIAN_PACKAGE_RELEASE=1~$(debian_suite)"
  cmake --build --preset release
  mkdir -p out/packages
  rm -f out/packages/*"~$(debian_suite)_"*.deb
  (cd build/release && cpack -B packages >packages.log 2>&1) ||
    { echo "dev: cpack failed; see build/release/packages.log" >&2; return 1; }
  mv build/release/packages/*.deb out/packages/
  ls -sh out/packages
}

# archive: programs and viewer with their libraries in out/packages, with the GDAL and assimp of wheels; built on Debian 12 for all
# systems with its C library or a later one.
archive() {
  [[ $(debian_suite) == bookworm ]] || { echo "dev: archives are built on Debian 12, as wheels are" >&2; return 1; }
  slim_libraries
  configure release 'GOLDEN VIEW'
  cmake --build --preset release
  local version
  rm -f out/packages/*.tar.zst
  version=$(build/release/bin/groundray --version)
  .venv/bin/python .ci/pack_archive.py build/release build/wheel "out/packages/groundray-${version#groundray }-x86_64.tar.zst"
}

# try_packages: installs the packages of each release in a bare system of it, and unpacks the archive in another.
try_packages() {
  local suite root what
  for suite in bookworm trixie; do
    for what in packages archive; do
      root=$PWD/build/bare_${what}_$suite
      make_debian_root "$suite" "$root"
      rm -rf "${root:?}/groundray"
      mkdir "$root/groundray"
      cp -r .ci/try_packages.sh test/consumer data "$root/groundray/"
      if [[ $what == packages ]]; then
        cp out/packages/*"~${suite}_"*.deb "$root/groundray/"
      else
        cp out/packages/*.tar.zst "$root/groundray/"
      fi
      echo "dev: $what on Debian ($suite)"
      in_debian_root "$root" bash /groundray/try_packages.sh "$what"
    done
  done
}
