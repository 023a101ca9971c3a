#!/usr/bin/env bash
# Installs the wheel beside this script into a new environment and uses it as a stranger would; run by ./dev wheel try in
# systems that have Python and no development package.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
rm -rf environment out
SECONDS=0
python3 -m venv environment
environment/bin/pip install --quiet --disable-pip-version-check groundray-*.whl
environment/bin/python - <<'END'
import groundray

print(len(groundray.load_scene("data/scenes/first_light.yaml").lidar("top").scan(frame=0)), "points")
END
echo "first scan $SECONDS s after the wheel"
((SECONDS <= 60)) || { echo "which is more than a minute" >&2; exit 1; }

# PROJ finds its database.
environment/bin/python - <<'END'
import groundray

terrain = groundray.load_terrain("data/terrain/prairie_1m.tif", reproject_to="EPSG:5070")
assert "Conus Albers" in terrain.crs, terrain.crs
END
environment/bin/groundray info data/terrain/prairie_1m.tif
environment/bin/groundray generate data/scenes/first_light.yaml -o out/first_light --quiet
environment/bin/groundray-export out/first_light --to npz -o out/npz
environment/bin/groundray-golden run -o out/golden | tail -n 3
environment/bin/pip install --quiet --disable-pip-version-check "$(echo groundray-*.whl)[index]"
environment/bin/groundray-index out -o out/index.parquet --report out/index.html
environment/bin/python -c 'from groundray.index import Frames; print(len(Frames("out/index.parquet")), "frames")'
if ldd environment/lib/python3*/site-packages/groundray/bin/groundray | grep 'not found'; then exit 1; fi
environment/bin/pip install --quiet --disable-pip-version-check "$(echo groundray-*.whl)[cluster]"
environment/bin/groundray-cluster run data/scenes/first_light.yaml --shards 2 --store "file://$PWD/out/store" --workers 2
cmp out/first_light/lidar/top/000000.ply out/store/dataset/lidar/top/000000.ply
