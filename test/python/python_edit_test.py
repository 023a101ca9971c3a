"""Edited scenes: the bytes of a scene file with that edit, without building the ground again."""

import datetime
import pickle

import groundray
import pytest
import small_scene
import yaml
from groundray._scene import to_yaml

SUN = {"azimuth_deg": 200, "elevation_deg": 35}
MOUNT = {"translation_m": [0.1, 0, 1.7], "pitch_deg": 4.5}


def spec_of(folder):
    groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M).save(folder / "ground.tif")
    spec = small_scene.spec(folder, camera=True)
    spec["terrain"]["dem"] = "ground.tif"
    spec["weather"] = {"visibility_m": 800}
    spec["scatter"] = [
        {"name": "rocks, small", "label": 71, "models": [{"asset": "rock"}], "density_per_m2": 0.02}
    ]
    return spec


def written(folder, spec, name):
    (folder / name).write_text(to_yaml(spec))
    return folder / name


def frames(scene):
    scans = [scene.lidar(name).scan(frame=1) for name in scene.lidars]
    things = [*scans, scene.camera("eye").expose(frame=0)]
    return [(name, thing[name].tobytes()) for thing in things for name in thing]


def test_times_of_a_loaded_file_are_accepted():
    given = yaml.safe_load("sun: {utc: 2026-06-21T16:30:00Z}\n")
    assert isinstance(given["sun"]["utc"], datetime.datetime)
    assert to_yaml(given) == 'sun:\n  utc: "2026-06-21T16:30:00Z"\n'
    offset = datetime.timezone(datetime.timedelta(hours=-5))
    given["sun"]["utc"] = datetime.datetime(2026, 6, 21, 11, 30, tzinfo=offset)
    assert "2026-06-21T16:30:00Z" in to_yaml(given)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("python_edit")


@pytest.fixture(scope="module")
def base(folder):
    """A scene that has made frames, with a seed that is not its file's."""
    scene = groundray.load_scene(written(folder, spec_of(folder), "scene.yaml"), seed=5)
    frames(scene)
    return scene


def with_mounts(spec):
    roof, *others = spec["lidars"]
    spec["lidars"] = [{**roof, "mount": MOUNT}, *others]
    spec["cameras"][0]["mount"] = {"translation_m": [0, 0, 2]}


EDITS = {
    "seed": ({"seed": 99}, lambda spec: spec.update(seed=99)),
    "weather": (
        {"weather": {"rain_mm_h": 20}},
        lambda spec: spec.update(weather={"rain_mm_h": 20}),
    ),
    "vacuum": ({"weather": {}}, lambda spec: spec.pop("weather")),
    "sky": (
        {"sky": {"analytic": {}, "sun": SUN}},
        lambda spec: spec.update(sky={"analytic": {}, "sun": SUN}),
    ),
    "sun": ({"sun": SUN}, lambda spec: spec["sky"].update(sun=SUN)),
    "mounts": ({"mounts": {"roof": MOUNT, "eye": {"translation_m": [0, 0, 2]}}}, with_mounts),
    "density": (
        {"density_per_m2": {"rocks, small": 0.1}},
        lambda spec: spec["scatter"][0].update(density_per_m2=0.1),
    ),
}


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_scene_makes_the_frames_of_a_file_with_that_edit(folder, base, name):
    changes, change = EDITS[name]
    spec = spec_of(folder)
    spec["seed"] = 5
    change(spec)
    of_file = groundray.load_scene(written(folder, spec, f"{name}.yaml"))
    edited = base.edited(**changes)
    assert (edited.seed, edited.objects) == (of_file.seed, of_file.objects)
    assert frames(edited) == frames(of_file)
    assert frames(edited) != frames(base)
    assert frames(edited.edited()) == frames(of_file)
    assert frames(pickle.loads(pickle.dumps(edited))) == frames(of_file)


def test_the_ground_is_built_once_for_a_scene_and_its_edits(folder, base):
    built = groundray.load_scene(folder / "scene.yaml")
    assert built.grounds_built == 0
    frames(built)
    once = built.grounds_built
    assert once == 1
    edited = built.edited(sun=SUN).edited(seed=3, density_per_m2={"rocks, small": 0.05})
    frames(edited)
    frames(built)
    assert edited.grounds_built == built.grounds_built == once
    del built
    frames(edited)
    assert edited.grounds_built == once


def test_files_of_terrain_and_objects_are_not_read_again(tmp_path):
    spec = spec_of(tmp_path)
    corners = "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 1 1 2\n"
    (tmp_path / "block.obj").write_text(corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    spec["objects"] = [
        {"name": "block", "label": 9, "model": "block.obj", "material": "metal", "at_m": [37, 35]}
    ]
    scene = groundray.load_scene(written(tmp_path, spec, "scene.yaml"))
    expected = frames(scene.edited(sun=SUN, mounts={"roof": MOUNT}))
    (tmp_path / "ground.tif").unlink()
    (tmp_path / "block.obj").unlink()
    assert frames(scene.edited(sun=SUN, mounts={"roof": MOUNT})) == expected
    with pytest.raises(groundray.Error, match=r"block\.obj"):
        scene.edited(density_per_m2={"rocks, small": 0.1})


@pytest.mark.parametrize("detail", [{}, {"tolerance_m": 0.1}])
def test_scenes_with_objects_and_terrain_in_memory_can_be_edited(tmp_path, detail):
    spec = small_scene.spec(tmp_path, camera=True)
    spec["terrain"] = {"material": "dry_grass", **detail}
    block = groundray.Mesh(
        [[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 1, 2]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    )
    spec["objects"] = [
        {"name": "block", "label": 9, "model": block, "material": "metal", "at_m": [37, 35]}
    ]
    terrain = groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)
    edited = groundray.scene(spec, folder=tmp_path, terrain=terrain).edited(sun=SUN)
    spec["sky"]["sun"] = SUN
    expected = frames(groundray.scene(spec, folder=tmp_path, terrain=terrain))
    assert frames(edited) == expected  # the scene that it came from is gone
    assert frames(pickle.loads(pickle.dumps(edited))) == expected


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"terrain": {}},
            "'terrain' cannot be changed .* only seed, weather, sky, sun, mounts, density_per_m2",
        ),
        ({"duration_s": 1}, "'duration_s' cannot be changed"),
        ({"mounts": {"front": MOUNT}}, "no lidar or camera 'front'; it has roof, light, eye"),
        ({"density_per_m2": {"trees": 1}}, "no layer 'trees'; it has rocks, small"),
        ({"mounts": {"roof": {"up_m": 1}}}, "key 'up_m': unknown"),
        ({"density_per_m2": {"rocks, small": -1}}, "'density_per_m2': is -1, but must be >= 0"),
        ({"sun": {"azimuth_deg": 10}}, "'elevation_deg'"),
        ({"seed": -1}, "key 'seed'"),
        ({"mounts": {"roof": {"translation_m": [0, 0, -9]}}}, r"m below the ground"),
    ],
)
def test_other_changes_are_refused_by_name(base, changes, words):
    with pytest.raises(groundray.Error, match=words):
        base.edited(**changes)


def test_sun_needs_a_sky_and_changes_need_dicts(tmp_path):
    terrain = groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)
    scene = groundray.scene(small_scene.spec(tmp_path), folder=tmp_path, terrain=terrain)
    with pytest.raises(groundray.Error, match="the scene has no 'sky'"):
        scene.edited(sun=SUN)
    for changes in ({"weather": 3}, {"mounts": ["roof"]}, {"sky": 1.5}):
        with pytest.raises(groundray.Error, match=f"'{next(iter(changes))}' must be a dict"):
            scene.edited(**changes)
