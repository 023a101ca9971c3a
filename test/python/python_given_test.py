"""Arguments from Python are converted, or rejected with a message."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import groundray
import numpy as np
import pytest
import small_scene
from groundray._scene import to_yaml

CORNERS = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


@pytest.mark.parametrize("scale", [1, 5e-324, 1e-310, 1e-200, 1e-160, 1e160, 3e305])
def test_directions_may_have_any_length(scale):
    # z = 0 from above: of a direction (a, b, -c) the range is height |direction| / c.
    terrain = groundray.Terrain(np.zeros((50, 50), np.float32))
    steps = np.array([[0, 0, -4.0], [1, 2, -2], [-3, 0, -4], [2, -1, -2]])
    directions = steps * scale
    rays = terrain.cast_rays(np.tile([25.0, 25, 10], (4, 1)), directions)
    expected_m = 10 * np.sqrt((steps**2).sum(1)) / -steps[:, 2]
    assert np.allclose(rays["range_true_m"], expected_m, rtol=1e-12, atol=0)
    assert np.allclose(rays["world_x_m"] - 25, 10 * steps[:, 0] / -steps[:, 2], atol=1e-11)


def test_zero_and_non_finite_directions_are_rejected():
    terrain = groundray.Terrain(np.zeros((5, 5), np.float32))
    for direction in ([0, 0, 0], [0, 0, -np.inf], [np.nan, 0, -1]):
        with pytest.raises(groundray.Error, match=r"ray 0: .* must be finite, and the direction"):
            terrain.cast_rays([[1, 1, 1]], [direction])


@pytest.mark.parametrize("dtype", [np.int8, np.uint16, np.int32, np.uint32, np.int64, np.uint64])
def test_vertex_indices_may_be_integers_of_any_width(dtype):
    triangles = np.array([[0, 1, 2], [0, 2, 3]], dtype)
    mesh = groundray.Mesh(CORNERS, triangles)
    assert np.array_equal(mesh.triangles, triangles)
    assert np.array_equal(
        groundray.Mesh(CORNERS, np.asfortranarray(triangles)).triangles, triangles
    )


@pytest.mark.parametrize(
    "triangles",
    [
        [[0, 1, 1.5]],
        [[0.0, 1.0, 2.0]],
        np.array([[0, 1, 2]], np.float32),
        [[False, True, True]],
        np.array([[False, True, True]]),
        [["0", "1", "2"]],
        [[0, 1]],
        [[0, 1, None]],
    ],
)
def test_vertex_indices_must_be_integers(triangles):
    with pytest.raises(TypeError, match="Mesh: triangles must be integers of shape"):
        groundray.Mesh(CORNERS, triangles)


def test_a_mesh_may_have_no_triangles():
    assert len(groundray.Mesh(CORNERS, np.zeros((0, 3))).triangles) == 0


class Failing:
    """An object whose conversion to an array fails."""

    def __init__(self, error):
        self.error = error

    def __array__(self, *_, **__):
        raise self.error


def test_reasons_of_a_failed_conversion_may_be_any_text():
    terrain = groundray.Terrain(np.zeros((5, 5), np.float32))
    with pytest.raises(TypeError, match=r"but is a Failing: an odd \\ud800 and \\x00 reason"):
        terrain.heights_at(Failing(ValueError("an odd \ud800 and \0 reason")))


@pytest.mark.parametrize("error", [MemoryError, KeyboardInterrupt, RuntimeError])
def test_exceptions_during_array_conversion_propagate(error):
    terrain = groundray.Terrain(np.zeros((5, 5), np.float32))
    failing = Failing(error("of its own"))
    with pytest.raises(error, match="of its own"):
        terrain.heights_at(failing)
    with pytest.raises(error, match="of its own"):
        terrain.cast_rays(failing, [[0, 0, -1]])
    with pytest.raises(error, match="of its own"):
        terrain.cast_rays([[0, 0, 1]], failing)
    with pytest.raises(error, match="of its own"):
        groundray.Terrain(failing)
    with pytest.raises(error, match="of its own"):
        groundray.Mesh(CORNERS, failing)
    with pytest.raises(error, match="of its own"):
        groundray.Mesh(CORNERS, [[0, 1, 2]], sd_m=failing)
    with pytest.raises(error, match="of its own"):
        groundray.fill_dem(np.zeros((4, 4)), cell_m=1, most_m=failing)


@pytest.mark.parametrize("error", [TypeError, ValueError])
def test_arguments_that_are_not_arrays_are_reported(error):
    with pytest.raises(
        TypeError, match=r"heights_at: places_m must be .*, but is a Failing: of its own"
    ):
        groundray.Terrain(np.zeros((5, 5))).heights_at(Failing(error("of its own")))


def test_rasters_of_one_call_must_have_the_same_shape():
    heights_m = np.zeros((4, 6), np.float32)
    with pytest.raises(
        groundray.Error,
        match=r"smooth_dem: variance_m2 has 6 x 4 samples, but heights_m has 4 x 6; they must",
    ):
        groundray.smooth_dem(heights_m, np.full((6, 4), 0.01), cell_m=1)
    with pytest.raises(groundray.Error, match=r"fill_dem: most_m has 3 x 8 samples, but .* 4 x 6"):
        groundray.fill_dem(heights_m, cell_m=1, most_m=np.zeros((3, 8)))


NOISE = {"divergence_rad": -1e-3, "position_sd_m": float("nan"), "attitude_sd_rad": float("inf")}


def test_invalid_noise_of_points_reports_every_fault():
    points = [[0, 0, 0]] * 2, [[0, 0, 1]] * 2, [0.1, 0.1]
    with pytest.raises(groundray.Error) as raised:
        groundray.fuse_points(*points, cell_m=1, **NOISE)
    lines = str(raised.value).splitlines()
    assert lines[0] == "fuse_points:"
    assert [line.split()[0] for line in lines[1:]] == list(NOISE)
    for name, value in NOISE.items():
        with pytest.raises(groundray.Error, match=f"{name} = .* must be 0 or more, and finite"):
            groundray.fuse_points(*points, cell_m=1, **{name: value})


def test_invalid_noise_of_scans_reports_every_fault(tmp_path):
    terrain = groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)
    scene = groundray.scene(small_scene.spec(tmp_path), folder=tmp_path, terrain=terrain)
    scan = scene.lidar("roof").scan(frame=0)
    with pytest.raises(groundray.Error) as raised:
        groundray.fuse_dem([scan], cell_m=1, **NOISE)
    assert str(raised.value).startswith("fuse_dem:\n")
    assert all(name in str(raised.value) for name in NOISE)


def test_an_invalid_mesh_reports_every_fault():
    with pytest.raises(groundray.Error) as raised:
        groundray.Mesh(
            CORNERS,
            [[0, 1, 2], [0, 2, 9]],
            sd_m=[0, 0.1, np.nan, 0],
            labels=[0, 1, 2, 70_000],
            confidence=[0, 1, 1.01, 0],
            origin_w_m=(0, np.inf, 0),
        )
    assert [line.strip() for line in str(raised.value).splitlines()] == [
        "mesh:",
        "triangle 1 names vertex 9, but vertices are numbered from 0 to 3",
        "sd_m of vertex 2, nan, must be 0 or more, and finite",
        "labels of vertex 3, 70000, must be a whole number from 0 to 65535",
        "confidence of vertex 2, 1.01, must be from 0 to 1",
        "origin_w_m = (0, inf, 0) must be finite",
    ]
    for wrong in ({"sd_m": [-1e-9] * 4}, {"confidence": [np.nan] * 4}, {"sd_m": [np.inf] * 4}):
        with pytest.raises(groundray.Error, match="of vertex 0"):
            groundray.Mesh(CORNERS, [[0, 1, 2]], **wrong)
    kept = groundray.Mesh(CORNERS, [[0, 1, 2]], sd_m=[0, 1, 2, 3], confidence=[0, 1, 0.5, 0.25])
    assert list(kept.sd_m) == [0, 1, 2, 3]
    assert list(kept.confidence) == [0, 1, 0.5, 0.25]


def test_within_m_is_rejected_for_anything_but_meshes(tmp_path):
    terrain = groundray.Terrain(small_scene.heights_m(20, 20))
    file = tmp_path / "ground.tif"
    terrain.save(file)
    with pytest.raises(
        groundray.Error, match=r"compare: within_m requires meshes, but .*ground\.tif"
    ):
        groundray.compare(file, file, within_m=[0.1])
    with pytest.raises(TypeError, match="within_m"):
        groundray.compare(terrain, terrain, within_m=[0.1])
    assert groundray.compare(file, file)["figures"]


def test_data_beside_the_module_takes_precedence_over_the_prefix(tmp_path):
    # A Python whose prefix has a share/groundray of somebody else, with another preset of the name.
    program = tmp_path / "stranger/bin/python"
    foreign = tmp_path / "stranger/share/groundray/data/sensors"
    own = tmp_path / "site/groundray"
    for folder in (program.parent, foreign):
        folder.mkdir(parents=True)
    shutil.copy(Path(sys.executable).resolve(), program)
    (foreign / "velodyne_vlp16.yaml").write_text("not: groundray's\n")
    shutil.copytree(small_scene.PACKAGE / "groundray", own)
    (own / "data").symlink_to(small_scene.ROOT / "data")
    groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M).save(tmp_path / "ground.tif")
    spec = small_scene.spec(tmp_path)
    spec["terrain"]["dem"] = "ground.tif"
    (tmp_path / "scene.yaml").write_text(to_yaml(spec))
    done = subprocess.run(
        [program, "-c", "import groundray\nprint(groundray.load_scene('scene.yaml').lidars)"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={
            "PYTHONHOME": sys.base_prefix,
            "PYTHONPATH": os.pathsep.join(map(str, [own.parent, Path(np.__file__).parents[1]])),
        },
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "['roof', 'light']\n"), done.stderr


def test_masked_heights_are_holes():
    heights_m = np.ma.masked_equal(np.full((20, 20), 3, np.int16), -1)
    heights_m[7, 9] = np.ma.masked
    terrain = groundray.Terrain(heights_m)
    assert np.isnan(terrain.heights_at([[9, 19 - 7]]))[0]
    assert (terrain.heights_at([[2, 2], [15.5, 3]]) == 3).all()
    assert np.isnan(groundray.Terrain(list(heights_m)).heights_at([[9, 19 - 7]]))[0]
    whole = np.ma.array(np.full((20, 20), 3.0), mask=False)
    assert groundray.Terrain(whole).heights_at([[9, 12]])[0] == 3
    dem = np.ma.array(np.full((20, 20), 3.0, np.float32), mask=np.zeros((20, 20), bool))
    dem[5:8, 5:8] = np.ma.masked
    dem.data[5:8, 5:8] = 99
    filled = groundray.fill_dem(dem, cell_m=1.0, reach="enclosed")
    assert np.allclose(filled["heights_m"], 3, atol=1e-3)


@pytest.mark.parametrize("dtype", [">f4", ">f8", ">i2", ">u8", np.float16, np.longdouble])
def test_numbers_may_have_any_form(dtype):
    heights_m = np.arange(12).reshape(3, 4).astype(dtype)
    assert groundray.Terrain(heights_m).heights_at([[1, 1]])[0] == 5  # the first row is north
    down = np.array([[0, 0, -1]], dtype=dtype if np.dtype(dtype).kind != "u" else ">f4")
    ground = groundray.Terrain(np.zeros((5, 5), np.float32))
    rays = ground.cast_rays(np.array([[1, 1, 7]], dtype), down)
    assert rays["range_true_m"][0] == 7


def test_vertex_indices_may_have_another_byte_order_but_not_exceed_64_bits():
    triangles = np.array([[0, 1, 2]], ">i4")
    assert np.array_equal(groundray.Mesh(CORNERS, triangles).triangles, triangles)
    rule = r"triangles must be integers of shape \(n, 3\), but is an array with 1844674407370955"
    with pytest.raises(TypeError, match=rule):
        groundray.Mesh(CORNERS, np.array([[0, 1, 2**64 - 1]], np.uint64))


def test_a_dem_larger_than_memory_is_refused():
    far = [[0, 0, 0], [1e5, 1e5, 0]]
    with pytest.raises(
        groundray.Error, match=r"a DEM of 10000\d x 10000\d samples takes 437\.\d GiB"
    ):
        groundray.fuse_points(far, far, [0.1, 0.1], cell_m=1.0)


def test_masked_values_are_rejected_elsewhere():
    terrain = groundray.Terrain(np.zeros((20, 20), np.float32))
    origins_m = np.ma.array([[5.0, 5, 5], [6, 6, 6]], mask=[[0, 0, 0], [0, 1, 0]])
    down = [[0, 0, -1.0]] * 2
    with pytest.raises(groundray.Error, match="an array has masked values"):
        terrain.cast_rays(origins_m, down)
    with pytest.raises(groundray.Error, match="an array has masked values"):
        terrain.cast_rays(tuple(origins_m), down)
    origins_m.mask = False
    assert np.allclose(terrain.cast_rays(origins_m, down)["range_true_m"], [5, 6])
    with pytest.raises(groundray.Error, match="an array has masked values"):
        groundray.Mesh(CORNERS, np.ma.array([[0, 1, 2], [0, 2, 3]], mask=[[0, 0, 0], [1, 0, 0]]))


def test_names_in_messages_do_not_control_the_terminal(tmp_path):
    with pytest.raises(groundray.Error) as fault:
        groundray.load_points(tmp_path / "a\x1b[2J.ply")
    assert "a\\x1b[2J.ply" in str(fault.value)
    assert "\x1b" not in str(fault.value)
