"""The program for users: datasets as read by other software, and invalid input."""

import math
import os
import re
import resource
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from plyfile import PlyData

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))
PRAIRIE = ROOT / "data/terrain/prairie_1m.tif"

COLUMNS = {
    "x": "f4", "y": "f4", "z": "f4", "intensity": "f4", "time": "f4", "ring": "u2",
    "return_index": "u1", "return_count": "u1",
    "world_x": "f8", "world_y": "f8", "world_z": "f8", "range_true": "f8",
    "nx": "f4", "ny": "f4", "nz": "f4", "incidence": "f4",
    "label": "u2", "instance": "u4", "error_estimate": "f4",
}  # fmt: skip

SCENE = """\
groundray: 1
seed: 7
duration_s: 0.3
terrain: {dem: DEM}
platform:
  drive:
    waypoints_m: [[429440, 5150660], [429448, 5150668], [429456, 5150671], [429470, 5150676]]
    speed_m_s: 10
    height_m: 0.5
lidars:
  - {name: top, preset: velodyne_vlp16, mount: {translation_m: [0, 0, 1.5], pitch_deg: 3}}
""".replace("DEM", str(PRAIRIE))


def groundray(*arguments, **options):
    return subprocess.run(
        [PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=300, **options
    )


def generate(folder, scene=SCENE, out="out", resume=False, **options):
    (folder / "scene.yaml").write_text(scene)
    more = ["--resume"] if resume else []
    return groundray("generate", folder / "scene.yaml", "-o", folder / out, *more, **options)


def refused(result, *words):
    """Checks that the run failed with one message that contains all words, without a crash."""
    assert result.returncode == 1, result
    assert result.stderr.startswith("groundray: "), result.stderr
    for word in words:
        assert word in result.stderr, result.stderr
    return True


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset")
    result = generate(folder)
    assert result.returncode == 0, result.stderr
    return folder / "out"


def heights_of(dem, folder):
    """Returns samples and geotransform of a DEM as written by GDAL's program."""
    grid = folder / "grid.asc"
    subprocess.run(
        ["gdal_translate", "-q", "-of", "AAIGrid", "-co", "SIGNIFICANT_DIGITS=12", dem, grid],
        check=True,
    )
    head = dict(line.split() for line in grid.read_text().splitlines()[:5])
    skip = 6 if "NODATA" in grid.read_text()[:300].upper() else 5
    heights = np.loadtxt(grid, skiprows=skip)
    cell = float(head["cellsize"])
    west = float(head["xllcorner"]) + cell / 2
    north = float(head["yllcorner"]) + cell * (heights.shape[0] - 0.5)
    return heights, west, north, cell


def test_every_column_is_present_with_its_type(dataset):
    for frame in range(3):
        vertex = PlyData.read(dataset / f"lidar/top/{frame:06}.ply")["vertex"]
        assert {p.name: p.val_dtype for p in vertex.properties} == COLUMNS
        assert vertex.count > 5000


def test_points_lie_on_the_surface_that_gdal_reads(dataset, tmp_path):
    heights, west, north, cell = heights_of(PRAIRIE, tmp_path)
    ply = PlyData.read(dataset / "lidar/top/000001.ply")
    origin = np.array([float(v) for v in ply.comments[0].split()[1:]])
    points = ply["vertex"]
    # Counted from the first sample's place in D, so that nothing is lost at UTM's size.
    u = (points["world_x"] - (west - origin[0])) / cell
    v = ((north - origin[1]) - points["world_y"]) / cell
    c, r = np.floor(u).astype(int), np.floor(v).astype(int)
    fu, fv = u - c, v - r
    a, b = heights[r, c], heights[r, c + 1]
    d, e = heights[r + 1, c], heights[r + 1, c + 1]
    near = a + (b - a) * fu + (d - a) * fv
    far = e + (d - e) * (1 - fu) + (b - e) * (1 - fv)
    surface = np.where(fu + fv > 1, far, near)
    # The ASCII grid's corner has 1e-9 m of rounding at a northing of 5e6 m; slopes are below 2.
    assert np.abs(points["world_z"] - surface).max() < 1e-8


def test_pose_file_transforms_sensor_points_to_the_world(dataset):
    poses = np.loadtxt(dataset / "poses/top.tum")
    record = yaml.safe_load((dataset / "dataset.yaml").read_text())
    for frame in record["frames"]:
        points = PlyData.read(dataset / f"lidar/top/{frame['frame']:06}.ply")["vertex"]
        t = frame["stamp_s"] + points["time"].astype(float)
        i = np.clip(np.searchsorted(poses[:, 0], t, side="right") - 1, 0, len(poses) - 2)
        s = (t - poses[i, 0]) / (poses[i + 1, 0] - poses[i, 0])
        # Linear position and normalised linear quaternion: what any reader would do.
        p = poses[i, 1:4] + s[:, None] * (poses[i + 1, 1:4] - poses[i, 1:4])
        q = poses[i, 4:8] + s[:, None] * (poses[i + 1, 4:8] - poses[i, 4:8])
        q /= np.linalg.norm(q, axis=1)[:, None]
        local = np.stack([points["x"], points["y"], points["z"]], axis=1).astype(float)
        twice = 2 * np.cross(q[:, :3], local)
        world = p + local + q[:, 3:] * twice + np.cross(q[:, :3], twice)
        truth = np.stack([points["world_x"], points["world_y"], points["world_z"]], axis=1)
        assert np.abs(world - truth).max() < 1e-4


def test_record_describes_the_dataset(dataset):
    record = yaml.safe_load((dataset / "dataset.yaml").read_text())
    assert record["seed"] == 7
    assert record["scene"] == SCENE
    assert record["origin_w_m"] == [429452, 5150685, 0]
    assert [f["state"] for f in record["frames"]] == ["done"] * 3
    assert [f["stamp_s"] for f in record["frames"]] == pytest.approx([0, 0.1, 0.2], abs=6e-5)
    calibration = yaml.safe_load((dataset / "calibration/top.yaml").read_text())
    assert len(calibration["beams"]) == 16
    pitch = calibration["X_BS"]["rotation_xyzw"]
    assert pitch == pytest.approx([0, math.sin(math.radians(1.5)), 0, math.cos(math.radians(1.5))])
    assert (dataset / "lidar/top/000000_preview.png").read_bytes().startswith(b"\x89PNG")


def test_same_seed_yields_the_same_bytes(dataset, tmp_path):
    assert generate(tmp_path).returncode == 0
    assert files(tmp_path / "out") == files(dataset)


WORLD = """\
  relief: {cell_m: 0.25, period_m: 32, fractal: {rms_m: 0.02, shortest_m: 0.6, longest_m: 8}}
  material: dry_soil
objects:
  - {name: rock, label: 4, asset: rock, size_m: 2, at_m: [429446, 5150670], stance: on_slope}
  - name: car
    label: 10
    asset: vehicle
    drive: {waypoints_m: [[429450, 5150665], [429470, 5150674]], speed_m_s: 9, height_m: 0}
scatter:
  - {name: grass, label: 2, density_per_m2: 0.3, min_distance_m: 0.3, models: [{asset: grass_tuft}]}
"""


def test_a_scene_of_objects_has_the_same_bytes_for_any_number_of_threads(tmp_path):
    """TBB starts one thread per processor that the process may use."""
    scene = SCENE.replace("duration_s: 0.3", "duration_s: 0.1")
    scene = scene.replace(f"terrain: {{dem: {PRAIRIE}}}\n", f"terrain:\n  dem: {PRAIRIE}\n{WORLD}")
    all_ = sorted(os.sched_getaffinity(0))
    one = lambda: os.sched_setaffinity(0, all_[:1])  # noqa: E731
    for out, before in (("one", one), ("all", None)):
        result = generate(tmp_path, scene, out, preexec_fn=before)
        assert result.returncode == 0, result.stderr
    assert files(tmp_path / "one") == files(tmp_path / "all")
    scan = PlyData.read(tmp_path / "one/lidar/top/000000.ply")["vertex"]
    assert {1, 2, 4, 10} == set(np.unique(scan["label"]))


def test_stopped_run_resumes_to_the_same_bytes(dataset, tmp_path):
    shutil.copytree(dataset, tmp_path / "out")
    for name in ("000001.ply", "000002.ply", "000002_preview.png"):
        (tmp_path / "out/lidar/top" / name).unlink()
    result = generate(tmp_path, resume=True)
    assert result.returncode == 0, result.stderr
    assert "1 scans already existed" in result.stdout
    assert files(tmp_path / "out") == files(dataset)


def test_interrupt_leaves_complete_frames_and_exit_code_130(dataset, tmp_path):
    (tmp_path / "scene.yaml").write_text(
        SCENE.replace("0.3", "2.5").replace("speed_m_s: 10", "speed_m_s: 4")
    )
    out = tmp_path / "out"
    run = subprocess.Popen(
        [PROGRAM, "generate", tmp_path / "scene.yaml", "-o", out], stderr=subprocess.PIPE, text=True
    )
    deadline = time.monotonic() + 60
    while not (out / "lidar/top/000002.ply").exists() and time.monotonic() < deadline:
        time.sleep(0.005)
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=60)
    assert run.returncode == 130, said
    assert "continues with --resume" in said
    names = sorted(p.name for p in (out / "lidar/top").iterdir())
    assert all(re.fullmatch(r"\d{6}(\.ply|_preview\.png)", name) for name in names), names
    for scan in (out / "lidar/top").glob("*.ply"):
        PlyData.read(scan)
    states = [f["state"] for f in yaml.safe_load((out / "dataset.yaml").read_text())["frames"]]
    assert "done" in states
    assert "pending" in states


def test_folder_of_another_run_is_kept(dataset, tmp_path):
    shutil.copytree(dataset, tmp_path / "out")
    assert refused(generate(tmp_path), "already contains a dataset of this run", "add --resume")
    assert refused(generate(tmp_path, SCENE.replace("seed: 7", "seed: 8")), "another scene, DEM")
    assert files(tmp_path / "out") == files(dataset)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/notes.txt").write_text("keep")
    assert refused(generate(tmp_path, out="mine"), "not empty", "choose a new folder")


def test_a_hill_on_a_recorded_path_is_reported(tmp_path):
    """The lidar is above ground at both ends of the path."""
    lines = ["0 429382.8 5150784.9 393 0 0 0 1", "0.4 429472.8 5150784.9 388.3 0 0 0 1"]
    (tmp_path / "path.tum").write_text("\n".join(lines) + "\n")
    scene = re.sub(
        r"platform:.*?lidars:", "platform: {trajectory: path.tum}\nlidars:", SCENE, flags=re.S
    )
    assert refused(generate(tmp_path, scene), "lidar 'top'", "below the ground")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("kind", ["trajectory", "dem", "sensor"])
def test_folder_of_a_run_with_other_inputs_is_kept(tmp_path, kind):
    """The scene file is unchanged, but a file that it names has changed."""
    scene = re.sub(
        r"platform:.*?lidars:", "platform: {trajectory: path.tum}\nlidars:", SCENE, flags=re.S
    )
    scene = scene.replace(str(PRAIRIE), "dem.tif").replace("preset: velodyne_vlp16", "file: a.yaml")
    shutil.copy(PRAIRIE, tmp_path / "dem.tif")
    shutil.copy(ROOT / "data/sensors/velodyne_vlp16.yaml", tmp_path / "a.yaml")
    path = "0 429440 5150660 412 0 0 0 1\n1 429441 5150660 412 0 0 0 1\n"
    (tmp_path / "path.tum").write_text(path)
    assert generate(tmp_path, scene).returncode == 0
    before = files(tmp_path / "out")
    if kind == "trajectory":
        (tmp_path / "path.tum").write_text(path.replace("429441", "429442"))
    elif kind == "dem":
        scaled = ["-scale", "0", "1000", "0", "999", "-ot", "Float32"]
        dem = tmp_path / "dem.tif"
        subprocess.run(["gdal_translate", "-q", *scaled, PRAIRIE, dem], check=True)
    else:
        spec = (tmp_path / "a.yaml").read_text()
        (tmp_path / "a.yaml").write_text(
            spec.replace("sense: clockwise", "sense: counter_clockwise")
        )
    (tmp_path / "out/lidar/top/000001.ply").unlink()
    assert refused(generate(tmp_path, scene), "another scene, DEM, trajectory, sensor")
    del before[Path("lidar/top/000001.ply")]
    assert files(tmp_path / "out") == before


def test_recorded_trajectory_with_epoch_times_starts_at_zero(tmp_path):
    lines = [f"{1600000000 + 0.1 * k:.1f} {429440 + k} 5150660 412 0 0 0 1" for k in range(6)]
    (tmp_path / "path.tum").write_text("\n".join(lines) + "\n")
    scene = re.sub(
        r"platform:.*?lidars:", "platform: {trajectory: path.tum}\nlidars:", SCENE, flags=re.S
    )
    result = generate(tmp_path, scene)
    assert result.returncode == 0, result.stderr
    poses = np.loadtxt(tmp_path / "out/poses/top.tum")
    assert poses[:6, 0] == pytest.approx([0, 0.1, 0.2, 0.3, 0.4, 0.5])
    # The path goes on as it was for what the last sweep lasts longer than the run: its sequence
    # 5425 begins at 0.2999808 s, and its last laser fires 34.56 us later.
    assert poses[6, :2] == pytest.approx([0.5 + 15.361e-6, 5 - 12 + 15.361e-5], abs=1e-8)
    record = (tmp_path / "out/dataset.yaml").read_text()
    assert "time_origin_s: 1600000000.000000000\n" in record
    assert poses[3, 1] == pytest.approx(429443 - 429452)


def test_output_that_cannot_be_written_is_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    assert refused(generate(tmp_path, out="file/out"), "file/out", "cannot create this folder")


def test_file_size_limit_is_an_error_and_leaves_no_partial_file(tmp_path):
    """A limit on file size makes every scan fail while it is written, as a full disk does."""
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))  # noqa: E731
    result = generate(tmp_path, preexec_fn=limit)
    assert refused(result, "000000")
    assert not [p for p in (tmp_path / "out/lidar/top").iterdir() if p.suffix != ".png"]


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting a small disk needs root")
def test_full_disk_is_an_error_and_leaves_no_partial_file(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", disk]
    if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("mounting a small disk is not permitted here")
    try:
        assert refused(generate(tmp_path, out="disk/out"), "No space left on device")
        assert not [p for p in (disk / "out/lidar/top").iterdir() if p.suffix != ".png"]
    finally:
        subprocess.run(["umount", disk], check=True)


def test_help_lists_the_commands_and_version_is_printed():
    said = groundray("--help")
    assert said.returncode == 0
    for word in ("generate", "info", "Exit codes", "first_light.yaml"):
        assert word in said.stdout
    assert re.fullmatch(r"groundray \d+\.\d+\.\d+\n", groundray("--version").stdout)


def test_info_describes_a_dem_and_a_scene(tmp_path):
    said = groundray("info", PRAIRIE).stdout
    for word in ("400 x 400", "26915", "1 x 1 m", "379.659 to 410.759", "holes     0", "MiB"):
        assert word in said
    (tmp_path / "scene.yaml").write_text(SCENE)
    said = groundray("info", tmp_path / "scene.yaml").stdout
    for word in ("VLP-16", "3 scans", "prairie_1m.tif"):
        assert word in said
