"""Numbers do not depend on the locale: Python's setlocale holds for the whole process."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DEM = ROOT / "data/terrain/prairie_1m.tif"
SCRIPT = """
import hashlib, locale, sys
from pathlib import Path
locale.setlocale(locale.LC_ALL, sys.argv[1])
import groundray, small_scene
from groundray._scene import to_yaml
out, dem = Path(sys.argv[2]), sys.argv[3]
groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M).save(out / "ground.tif")
spec = small_scene.spec(out, camera=True)
spec["terrain"]["dem"] = "ground.tif"
(out / "scene.yaml").write_text(to_yaml(spec))
scene = groundray.load_scene(out / "scene.yaml")
for name in ("roof", "light"):
    scan = scene.lidar(name).scan(frame=0)
    for column in scan:
        (out / f"{name}_{column}").write_bytes(scan[column].tobytes())
terrain = groundray.load_terrain(dem, reproject_to="EPSG:32616")
print(locale.str(1.5), repr(terrain))
for name in ("a.obj", "a.ply", "a.stl", "a.glb"):
    terrain.mesh(max_error_m=1).save(out / name)
    groundray.load_mesh(out / name).save(out / f"again_{name}.obj")
for path in sorted(out.iterdir()):
    if path.suffix != ".tif":
        print(path.name, hashlib.sha256(path.read_bytes()).hexdigest())
"""


@pytest.fixture(scope="module")
def decimal_comma(tmp_path_factory):
    """Returns the folder of a locale that is compiled here, as most systems have none."""
    if not Path("/usr/share/i18n/locales/de_DE").exists() or shutil.which("localedef") is None:
        pytest.skip("Debian's package locales is missing")
    folder = tmp_path_factory.mktemp("locales")
    compile_it = ["localedef", "-i", "de_DE", "-f", "UTF-8", folder / "de_DE.UTF-8"]
    subprocess.run(compile_it, check=False)  # warnings are faults, too
    return folder


def outputs(folder, locale, locales, dem):
    folder.mkdir()
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, locale, folder, dem],
        env={**os.environ, "LOCPATH": str(locales), "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_a_decimal_comma_changes_no_byte(tmp_path, decimal_comma):
    coarse = tmp_path / "coarse.tif"  # of 10 m, written 1.0e+01 on the way to GDAL
    subprocess.run(["gdal_translate", "-q", "-outsize", "10%", "10%", DEM, coarse], check=True)
    plain = outputs(tmp_path / "a", "C", decimal_comma, coarse)
    comma = outputs(tmp_path / "b", "de_DE.UTF-8", decimal_comma, coarse)
    assert plain[0].startswith("1.5 ")
    assert comma[0] == "1,5 " + plain[0].removeprefix("1.5 ")
    assert comma[1:] == plain[1:]
    assert len(plain) > 30
