#!/usr/bin/env bash
# Installs the packages or the archive beside this script and uses them; run by ./dev packages try in bare systems.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

install() {
  apt-get -qq update
  DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends "$@" >/dev/null
}

if [[ $1 == packages ]]; then
  install --reinstall ./groundray_*.deb ./groundray-view_*.deb  # of the same version, if this system has been used before
  bin=/usr/bin data=/usr/share/groundray/data
else
  install zstd libgl1 libegl1 libopengl0 libx11-6 libx11-xcb1 libxcb1 libxext6 libxrender1 libsm6 libice6 libglib2.0-0
  tar --zstd -xf groundray-*.tar.zst
  top=(groundray-*-x86_64/)
  bin=$PWD/${top[0]}bin data=$PWD/${top[0]}share/groundray/data
fi
if ldd "$bin"/groundray{,-golden,-view} | grep 'not found'; then exit 1; fi
"$bin/groundray" --version
"$bin/groundray" generate "$data/scenes/first_light.yaml" -o out/first_light --quiet
"$bin/groundray-golden" run -o out/golden | tail -n 3

# The viewer off screen, and in a window under an X server, which is open until the time is over.
install libgl1-mesa-dri xvfb xauth
"$bin/groundray-view" "$data/scenes/first_light.yaml" out/first_light --screenshot out/view.png --size 640x480
[[ -s out/view.png ]]
code=0
timeout 20 xvfb-run -a "$bin/groundray-view" "$data/scenes/first_light.yaml" 2>out/window.log || code=$?
((code == 124)) || { cat out/window.log >&2; exit 1; }
if grep -i opengl out/window.log; then exit 1; fi

[[ $1 == packages ]] || exit 0
install --reinstall ./libgroundray-dev_*.deb g++ cmake ninja-build
cmake -G Ninja -S consumer -B out/consumer -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build out/consumer
points=$(sed -n 's/^element vertex //p;/^end_header/q' out/first_light/lidar/top/000000.ply)
out/consumer/consumer out/first_light "$points"
