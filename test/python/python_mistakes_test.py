"""Mistakes in calls of the Python package."""

import re

import groundray
import numpy as np
import pytest
import small_scene
from user_mistakes import check_words, state_of

FLAT = np.zeros((20, 20), np.float32)
CORNERS = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
DOWN = [[0, 0, -1]]
TRIANGLE = [[0, 1, 2]]

# name, call with the names below and those of the fixture, exception, parts of the message
MISTAKES = [
    (
        "one ray that is not a list of rays",
        "scene.cast_rays([30, 30, 10], [0, 0, -1])",
        TypeError,
        ["cast_rays: origins_m", "shape (n, 3)", "but is shape (3,) and type int64"],
    ),
    (
        "rays in rows",
        "terrain.cast_rays(np.zeros((3, 8)), np.zeros((3, 8)))",
        TypeError,
        ["cast_rays: origins_m", "shape (n, 3)", "but is shape (3, 8) and type float64"],
    ),
    (
        "a single direction",
        "terrain.cast_rays(np.zeros((8, 3)), [0, 0, -1])",
        TypeError,
        ["cast_rays: directions", "shape (n, 3)", "but is shape (3,)"],
    ),
    (
        "fewer directions than origins",
        "terrain.cast_rays(np.zeros((8, 3)), DOWN)",
        groundray.Error,
        ["cast_rays: there are 8 origins but 1 directions; the numbers must be equal"],
    ),
    (
        "a direction of no length",
        "terrain.cast_rays([[1, 1, 1]], [[0, 0, 0]])",
        groundray.Error,
        ["ray 0: origin (1, 1, 1) and direction (0, 0, 0)", "not zero"],
    ),
    (
        "an origin that is not a number",
        "terrain.cast_rays([[1, np.nan, 1]], DOWN)",
        groundray.Error,
        ["ray 0: origin (1, nan, 1)", "must be finite"],
    ),
    (
        "words as origins",
        "terrain.cast_rays([['a', 'b', 'c']], DOWN)",
        TypeError,
        ["cast_rays: origins_m", "shape (n, 3)", "type <U1"],
    ),
    (
        "rows of unequal length",
        "terrain.cast_rays([[0, 0], [1, 1, 1]], DOWN)",
        TypeError,
        ["cast_rays: origins_m", "shape (n, 3)", "but is a list"],
    ),
    (
        "nothing as origins",
        "terrain.cast_rays({}, DOWN)",
        TypeError,
        ["cast_rays: origins_m", "shape (n, 3)", "type object"],
    ),
    (
        "a time after the run",
        "scene.cast_rays([[30, 30, 10]], DOWN, t_s=9)",
        groundray.Error,
        ["cast_rays: t_s = 9 must be within the scene's time, 0 to 0.25 s"],
    ),
    (
        "heights at one place",
        "scene.heights_at([30, 30])",
        TypeError,
        ["heights_at: places_m", "shape (n, 2)", "but is shape (2,)"],
    ),
    (
        "heights at points",
        "terrain.heights_at([[3, 3, 3]])",
        TypeError,
        ["heights_at: places_m", "shape (n, 2)", "but is shape (1, 3)"],
    ),
    (
        "one point to project",
        "scene.camera('eye').project([0, 0, 1])",
        TypeError,
        ["project: points_m", "shape (n, 3)", "but is shape (3,)"],
    ),
    (
        "a profile as terrain",
        "groundray.Terrain([0, 1, 2])",
        TypeError,
        ["Terrain: heights_m", "shape (rows, columns)", "but is shape (3,)"],
    ),
    (
        "a picture as terrain",
        "groundray.Terrain(np.zeros((4, 4, 3)))",
        TypeError,
        ["Terrain: heights_m", "shape (rows, columns)", "but is shape (4, 4, 3)"],
    ),
    (
        "cells of negative size",
        "groundray.Terrain(FLAT, -1)",
        groundray.Error,
        ["Terrain", "cell_m = -1 must be positive"],
    ),
    (
        "one row of terrain",
        "groundray.Terrain(np.zeros((1, 5)))",
        groundray.Error,
        ["2"],
    ),
    (
        "a CRS that is none",
        "groundray.Terrain(FLAT, 1, crs_wkt='UTM 15')",
        groundray.Error,
        ["UTM 15", "CRS"],
    ),
    (
        "vertices in the plane",
        "groundray.Mesh([[0, 0], [1, 0], [1, 1]], TRIANGLE)",
        TypeError,
        ["Mesh: vertices_m", "shape (n, 3)", "but is shape (3, 2)"],
    ),
    (
        "quadrilaterals",
        "groundray.Mesh(CORNERS, [[0, 1, 2, 0]])",
        TypeError,
        ["Mesh: triangles must be integers of shape (n, 3), but is shape (1, 4)"],
    ),
    (
        "fractional indices",
        "groundray.Mesh(CORNERS, [[0, 1, 1.5]])",
        TypeError,
        ["Mesh: triangles must be integers of shape (n, 3)", "type float64"],
    ),
    (
        "indices from 1",
        "groundray.Mesh(CORNERS, [[1, 2, 3]])",
        groundray.Error,
        ["triangle 0 names vertex 3, but vertices are numbered from 0 to 2"],
    ),
    (
        "one standard deviation",
        "groundray.Mesh(CORNERS, TRIANGLE, sd_m=[0.1])",
        groundray.Error,
        ["3 vertices, but 1 values of sd_m; there must be one for each"],
    ),
    (
        "a column of standard deviations",
        "groundray.Mesh(CORNERS, TRIANGLE, sd_m=[[0.1], [0.1], [0.1]])",
        TypeError,
        ["Mesh: sd_m", "shape (n,)", "but is shape (3, 1)"],
    ),
    (
        "a number as standard deviations of points",
        "groundray.fuse_points(CORNERS, CORNERS, 0.1, cell_m=1)",
        TypeError,
        ["fuse_points: range_sd_m", "shape (n,)", "but is shape ()"],
    ),
    (
        "one origin for all points",
        "groundray.fuse_points(CORNERS, [[0, 0, 5]], [0.1] * 3, cell_m=1)",
        groundray.Error,
        ["fuse_points: there are 3 points, 1 origins, 3 values of range_sd_m"],
    ),
    (
        "cells of no size",
        "groundray.fill_dem(FLAT, cell_m=0)",
        groundray.Error,
        ["cell_m = 0 must be positive"],
    ),
    (
        "an unknown reach",
        "groundray.fill_dem(FLAT, cell_m=1, reach='all')",
        groundray.Error,
        ["reach = 'all' must be one of enclosed, hull, everywhere"],
    ),
    (
        "bounds of another size",
        "groundray.fill_dem(FLAT, cell_m=1, most_m=np.zeros((3, 3)))",
        groundray.Error,
        ["fill_dem: most_m has 3 x 3 samples, but heights_m has 20 x 20"],
    ),
    (
        "variances of one row",
        "groundray.smooth_dem(FLAT, [0.1] * 20, cell_m=1)",
        TypeError,
        ["smooth_dem: variance_m2", "shape (rows, columns)", "but is shape (20,)"],
    ),
    (
        "an unknown lidar",
        "scene.lidar('top')",
        Exception,
        ["top", "roof", "light"],
    ),
    (
        "a frame after the last",
        "scene.lidar('roof').scan(frame=7)",
        groundray.Error,
        ["frame", "7"],
    ),
    (
        "a time and a frame",
        "scene.lidar('roof').scan(t_s=0.1, frame=0)",
        groundray.Error,
        ["t_s", "frame"],
    ),
    (
        "a column without its unit",
        "scene.lidar('roof').scan(frame=0)['range_true']",
        KeyError,
        ["range_true_m"],
    ),
    (
        "a misspelled scene",
        "groundray.load_scene('scen.yaml')",
        groundray.Error,
        ["scen.yaml: there is no such file", "did you mean 'scene.yaml'?"],
    ),
    (
        "a misspelled DEM",
        "groundray.load_terrain('grund.tif')",
        groundray.Error,
        ["grund.tif: there is no such file", "did you mean 'ground.tif'?"],
    ),
    (
        "a misspelled mesh",
        "groundray.load_mesh('ground.ply')",
        groundray.Error,
        ["ground.ply: there is no such file", "did you mean 'ground.tif'?"],
    ),
    (
        "a text as points",
        "groundray.load_points('scene.yaml')",
        groundray.Error,
        ["scene.yaml", "PLY"],
    ),
    (
        "a DEM as a scene",
        "groundray.load_scene('ground.tif')",
        groundray.Error,
        ["ground.tif: not YAML", "terrain.dem"],
    ),
    (
        "a mistake in a scene of dicts",
        "groundray.scene({**spec, 'frobnicate': 8}, folder='.', terrain=terrain)",
        groundray.Error,
        ["scene:65:1: key 'frobnicate': unknown; the keys here are cameras, classes, duration_s"],
    ),
    (
        "a mesh in an unknown format",
        "groundray.Mesh(CORNERS, TRIANGLE).save('mesh.dae')",
        groundray.Error,
        ["mesh.dae: the name of a mesh must end in .ply, .obj, .stl or .glb"],
    ),
    (
        "a terrain as a picture",
        "terrain.save('terrain.png')",
        groundray.Error,
        ["terrain.png", ".tif"],
    ),
    (
        "a scan in another format",
        "scene.lidar('roof').scan(frame=0).save('scan.xyz')",
        groundray.Error,
        ["scan.xyz: its name must end in .ply"],
    ),
    (
        "no stop criterion",
        "groundray.simplify(groundray.Mesh(CORNERS, TRIANGLE))",
        groundray.Error,
        ["max_error_m"],
    ),
    (
        "a comparison of different kinds",
        "groundray.compare('ground.tif', 'scene.yaml')",
        groundray.Error,
        ["scene.yaml"],
    ),
]


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def names(home):
    """What the calls of the table may use."""
    terrain = groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)
    spec = small_scene.spec(home, camera=True)
    terrain.save(home / "ground.tif")
    (home / "scene.yaml").write_text("groundray: 1\n")
    scene = groundray.scene(spec, folder=home, terrain=terrain)
    return {**globals(), "terrain": terrain, "scene": scene, "spec": spec}


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [row[1:] for row in MISTAKES],
    ids=[row[0] for row in MISTAKES],
)
def test_a_mistake_in_a_call_is_explained(call, error, words, names, home, monkeypatch):
    monkeypatch.chdir(home)
    before = state_of(home)
    with pytest.raises(error) as raised:
        eval(call, names)
    check_words(str(raised.value), tuple(words))
    assert state_of(home) == before


def test_arguments_of_all_calls_that_take_arrays_are_in_the_table():
    stub = (small_scene.PACKAGE / "groundray/_core.pyi").read_text()
    calls = re.findall(r"def (\w+)\(([^\n]*)\)", stub)
    classes = {"self, vertices_m": "Mesh", "self, heights_m": "Terrain"}
    wanted = set()
    for name, arguments in calls:
        owner = next((c for start, c in classes.items() if arguments.startswith(start)), name)
        for argument in re.findall(r"(\w+): numpy\.typing", arguments):
            wanted.add(f"{owner}: {argument}")
    assert len(wanted) >= 15
    source = " ".join(
        path.read_text() for path in sorted((small_scene.ROOT / "apps/python").glob("*.cpp"))
    )
    for each in sorted(wanted):
        name, argument = each.split(": ")
        direct = f'"{each}"' in source
        rule = name == "Mesh" and f'"{argument}"' in source and '"Mesh: {}"' in source
        alike = name in ("smooth_dem", "fill_dem") and f'"{name}", heights_m' in source
        assert direct or rule or alike, each
