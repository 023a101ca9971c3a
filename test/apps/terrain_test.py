"""Terrain of any size from the command line, compared with runs at full resolution."""

import os
import re
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from dem_runs import Raster, done, triangle_heights
from plyfile import PlyData

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/release/bin/groundray"
PRAIRIE = ROOT / "data/terrain/prairie_1m.tif"
JACKSBORO = ROOT / "data/terrain/jacksboro.tif"

SCENE = """\
groundray: 1
seed: 7
duration_s: 0.2
terrain: {dem: DEM, DETAIL}
platform:
  drive:
    waypoints_m: [[429440, 5150660], [429448, 5150668], [429456, 5150671], [429470, 5150676]]
    speed_m_s: 10
    height_m: 0.5
lidars:
  - name: top
    preset: velodyne_vlp16
    error_bound: report
    mount: {translation_m: [0, 0, 1.5], pitch_deg: 3}
"""


def groundray(*arguments, **options):
    return subprocess.run(
        [PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=300, **options
    )


def generate(folder, dem, detail, out, *more, **options):
    text = SCENE.replace("DEM", str(dem)).replace("DETAIL", detail)
    (folder / f"{out}.yaml").write_text(text)
    result = groundray("generate", folder / f"{out}.yaml", "-o", folder / out, *more, **options)
    assert result.returncode == 0, result.stderr
    return [PlyData.read(p)["vertex"] for p in sorted((folder / out).glob("lidar/top/*.ply"))]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return generate(tmp_path_factory.mktemp("whole"), PRAIRIE, "label: 1", "whole")


@pytest.fixture
def dem(tmp_path):
    """A copy, since its certificate is written beside it."""
    return Path(shutil.copy(PRAIRIE, tmp_path))


def check_against_whole(scans, whole):
    """Every range differs from that at full resolution by no more than its bound."""
    moved = bounded = total = 0
    for scan, truth in zip(scans, whole, strict=True):
        ranges = {
            (t, ring): r
            for t, ring, r in zip(truth["time"], truth["ring"], truth["range_true"], strict=True)
        }
        for t, ring, r, bound in zip(
            scan["time"], scan["ring"], scan["range_true"], scan["error_bound"], strict=True
        ):
            error = abs(r - ranges.get((t, ring), np.inf))
            assert error <= bound
            moved += error > 1e-6
            bounded += np.isfinite(bound)
            total += 1
    assert bounded > 0.5 * total
    return moved / total


def test_bounds_are_the_accuracy_of_ranges_at_full_resolution(whole):
    for scan in whole:
        accuracy_m = 1e-9 * scan["range_true"] + 1e-9
        assert (scan["error_bound"] >= accuracy_m).all(), "rounded up to a float"
        np.testing.assert_allclose(scan["error_bound"], accuracy_m, rtol=1.2e-7)
        assert (scan["error_estimate"] == 0).all()


def test_error_bound_holds_for_every_echo_of_a_simplified_terrain(tmp_path, dem, whole):
    scans = generate(tmp_path, dem, "tolerance_m: 0.3, tolerance_mrad: 1", "coarse")
    assert check_against_whole(scans, whole) > 0.2
    assert not list(tmp_path.glob("*.groundray")), "a DEM that fits in memory needs no certificate"


def test_dem_larger_than_its_memory_limit_is_read_through_its_certificate(tmp_path, dem, whole):
    scans = generate(tmp_path, dem, "memory_mib: 3", "capped")
    assert (tmp_path / "prairie_1m.tif.groundray/certificate.txt").exists()
    assert check_against_whole(scans, whole) < 0.5
    one = {0}  # the same bytes on a single processor
    generate(
        tmp_path, dem, "memory_mib: 3", "single", preexec_fn=lambda: os.sched_setaffinity(0, one)
    )
    for ply in sorted((tmp_path / "capped/lidar/top").glob("*.ply")):
        assert ply.read_bytes() == (tmp_path / "single/lidar/top" / ply.name).read_bytes()


def test_frames_do_not_depend_on_earlier_frames(tmp_path, dem):
    generate(tmp_path, dem, "memory_mib: 3, tolerance_mrad: 0.5", "run")
    last = tmp_path / "run/lidar/top/000001.ply"
    before = last.read_bytes()
    last.unlink()
    generate(tmp_path, dem, "memory_mib: 3, tolerance_mrad: 0.5", "run", "--resume")
    assert last.read_bytes() == before


def test_info_lists_levels_triangles_and_bound(tmp_path, dem):
    (tmp_path / "s.yaml").write_text(
        SCENE.replace("DEM", str(dem)).replace("DETAIL", "memory_mib: 3")
    )
    said = groundray("info", tmp_path / "s.yaml")
    assert said.returncode == 0, said.stderr
    rows = re.findall(r"^ +([\d.]+) +\d+ x +\d+ +(\d+) +([\d.e-]+) +(\d+)$", said.stdout, re.M)
    assert [float(row[0]) for row in rows] == [2.0**k for k in range(len(rows))]
    assert len(rows) > 1
    total = int(re.search(r"^triangles (\d+)", said.stdout, re.M)[1])
    assert total == sum(int(row[1]) for row in rows)


def test_certify_prints_the_deviation_of_each_level(tmp_path):
    dem = Path(shutil.copy(JACKSBORO, tmp_path))
    first = groundray("terrain", "certify", dem)
    assert first.returncode == 0, first.stderr
    again = groundray("terrain", "certify", dem)
    assert again.stdout == first.stdout
    assert again.stderr == "", "nothing is certified twice"
    rows = [line.split() for line in first.stdout.splitlines() if re.match(r" *\d+ ", line)]
    raw = tmp_path / "dem.bin"
    subprocess.run(["gdal_translate", "-q", "-of", "ENVI", "-ot", "Float64", dem, raw], check=True)
    heights = np.fromfile(raw, "<f8").reshape(344, 403)
    # The root is one cell: two triangles over everything.
    v, u = np.mgrid[0:1:344j, 0:1:403j]
    nw, ne, sw, se = heights[0, 0], heights[0, -1], heights[-1, 0], heights[-1, -1]
    near = nw + u * (ne - nw) + v * (sw - nw)
    far = se + (1 - u) * (sw - se) + (1 - v) * (ne - se)
    at_samples = np.abs(np.where(u + v <= 1, near, far) - heights).max()
    # Between samples, along the root's diagonal, it may be a little more.
    assert at_samples <= float(rows[-1][5]) <= at_samples + 20


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-o", "m.xyz", "--max-error-m", "1"], ".ply, .obj, .stl or .glb"),
        (["-o", "no/such/folder/m.ply", "--max-error-m", "1"], "m.ply"),
    ],
)
def test_mesh_rejects_invalid_options(tmp_path, arguments, words):
    said = groundray("terrain", "mesh", JACKSBORO, *arguments, cwd=tmp_path)
    assert said.returncode == 1
    assert said.stderr.startswith("groundray: ")
    assert words in said.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "arguments",
    [
        ["-o", "m.ply"],
        ["-o", "m.ply", "--max-error-m", "-1"],
        ["-o", "m.ply", "--max-error-m", "1", "--viewpoint", "1,2,3"],
        ["-o", "m.ply", "--max-error-m", "1", "--angle-mrad", "1"],
        ["-o", "m.ply", "--max-error-m", "1", "--angle-mrad", "1", "--viewpoint", "1,2"],
        ["-o", "m.ply", "--max-error-m=1", "--fewest", "--angle-mrad=1", "--viewpoint=1,2,3"],
    ],
)
def test_mesh_prints_its_usage(tmp_path, arguments):
    said = groundray("terrain", "mesh", JACKSBORO, *arguments, cwd=tmp_path)
    assert said.returncode == 2
    assert not list(tmp_path.iterdir())


def test_mesh_requires_a_viewpoint_on_the_dem(tmp_path):
    result = groundray(
        *("terrain", "mesh", JACKSBORO, "-o", tmp_path / "m.ply", "--max-error-m", 5),
        *("--viewpoint", "nan,0,0", "--angle-mrad", 1),
    )
    assert result.returncode == 1
    assert "must be finite" in result.stderr
    assert not list(tmp_path.iterdir())


def test_sparse_dem_far_from_the_sensor_is_traced(tmp_path):
    """None of the few heights is a sample of the coarse levels that cover them."""
    heights = np.full((400, 400), -9999.0)
    heights[377:384, 377:384] = 50
    grid = tmp_path / "island.asc"
    header = "ncols 400\nnrows 400\nxllcorner 429400\nyllcorner 5150400\ncellsize 1\n"
    with grid.open("w") as file:
        file.write(header + "NODATA_value -9999\n")
        np.savetxt(file, heights, fmt="%g")
    dem = tmp_path / "island.tif"
    subprocess.run(["gdal_translate", "-q", "-a_srs", "EPSG:32611", grid, dem], check=True)
    (tmp_path / "path.tum").write_text("".join(f"{t} 429410 5150790 60 0 0 0 1\n" for t in (0, 10)))
    text = SCENE.replace("DEM", str(dem)).replace("DETAIL", "memory_mib: 1")
    driven = text[text.index("platform:") : text.index("lidars:")]
    text = text.replace(driven, "platform: {trajectory: path.tum}\n")
    (tmp_path / "scene.yaml").write_text(text)
    result = groundray("generate", tmp_path / "scene.yaml", "-o", tmp_path / "out")
    assert result.returncode == 0, result.stderr


def test_interrupted_certification_leaves_no_files(tmp_path):
    vrt = tmp_path / "big.vrt"
    subprocess.run(
        ["python3", ROOT / "test/benchmark/make_big_vrt.py", PRAIRIE, "24", vrt], check=True
    )
    process = subprocess.Popen(
        [PROGRAM, "terrain", "certify", vrt], stderr=subprocess.PIPE, text=True
    )
    while not list(tmp_path.glob("*.part")) and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 130, process.stderr.read()
    assert list(tmp_path.iterdir()) == [vrt]


def test_too_small_a_memory_limit_is_rejected_before_anything_is_written(tmp_path, dem):
    text = SCENE.replace("DEM", str(dem)).replace("DETAIL", "memory_mib: 0")
    (tmp_path / "scene.yaml").write_text(text)
    result = groundray("generate", tmp_path / "scene.yaml", "-o", tmp_path / "out")
    assert result.returncode == 1
    assert "must be at least 1" in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("bound_m", [0.3, 2])
def test_fewest_triangles_stay_within_the_bound(tmp_path, bound_m):
    """At points of every triangle, by other programs' readers; the area is the DEM's."""
    mesh, out = tmp_path / "few.ply", {}
    for name, more in (("nodes", ()), ("few", ("--fewest",))):
        out[name] = done(
            *("terrain", "mesh", PRAIRIE, "--max-error-m", str(bound_m), *more),
            *("-o", tmp_path / f"{name}.ply"),
        )
    file = PlyData.read(mesh)
    (origin,) = (line for line in file.comments if line.startswith("origin_w "))
    vertices = np.column_stack([file["vertex"][axis] for axis in "xyz"])
    vertices += np.array(origin.split()[1:], float)
    corners = vertices[np.vstack(file["face"]["vertex_indices"])]
    fewer = len(corners), len(PlyData.read(tmp_path / "nodes.ply")["face"].data)
    assert fewer[0] < 0.9 * fewer[1], fewer
    assert f"{len(corners)} triangles" in out["few"]
    truth = Raster(PRAIRIE, tmp_path)
    shares = np.random.default_rng(1).dirichlet((1, 1, 1), (len(corners), 40))
    points = np.einsum("tpk,tkc->tpc", shares, corners).reshape(-1, 3)
    off_m = np.abs(points[:, 2] - triangle_heights(truth, points[:, 0], points[:, 1]))
    largest_m = float(re.search(r"largest deviation ([0-9.e-]+) m", out["few"])[1])
    rounding_m = 1e-5  # of the printed figure; heights are floats
    assert 0.5 * bound_m < np.max(off_m) <= largest_m + rounding_m
    assert largest_m <= bound_m
    edges = corners[:, 1:, :2] - corners[:, :1, :2]
    area = 0.5 * np.sum(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    rows, columns = truth.bands.shape[1:]
    assert np.isclose(area, (rows - 1) * (columns - 1) * truth.cell**2, rtol=1e-9)


def test_fewest_triangles_need_memory(tmp_path):
    result = groundray(
        *("terrain", "mesh", PRAIRIE, "--max-error-m", "1", "--fewest", "--memory-mb", "1"),
        *("-o", tmp_path / "few.ply"),
    )
    assert result.returncode == 1
    assert "MB" in result.stderr
    assert not os.listdir(tmp_path)
