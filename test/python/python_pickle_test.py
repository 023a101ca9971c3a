"""Pickles of the package's objects: equal values, equal bytes of frames, and faults by name."""

import copy
import io
import os
import pickle
import pickletools
import subprocess
import sys

import groundray
import numpy as np
import pytest
import small_scene
from groundray._scene import to_yaml

PROTOCOLS = range(2, pickle.HIGHEST_PROTOCOL + 1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A scene file with all that it names."""
    folder = tmp_path_factory.mktemp("python_pickle")
    local_terrain().save(folder / "ground.tif")
    spec = small_scene.spec(folder, camera=True)
    spec["terrain"]["dem"] = "ground.tif"
    (folder / "scene.yaml").write_text(to_yaml(spec))
    return folder


@pytest.fixture(scope="module")
def scene(folder):
    return groundray.load_scene(folder / "scene.yaml", seed=12)


def terrain():
    return groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M, (500_000.25, 4_600_000))


def contents(thing):
    """Returns everything that can be read of an object, arrays as type, shape and bytes."""
    if isinstance(thing, np.ndarray):
        return str(thing.dtype), thing.shape, thing.tobytes()
    if isinstance(thing, dict):
        return {key: contents(value) for key, value in thing.items()}
    if isinstance(thing, list | tuple):
        return [contents(value) for value in thing]
    if thing is None or isinstance(thing, str | int | float):
        return thing
    computed = ("_", "xyz_m")  # methods, and what other values give
    names = [name for name in dir(type(thing)) if not name.startswith(computed)]
    values = {name: getattr(thing, name) for name in names}
    table = {name: thing[name] for name in thing} if hasattr(thing, "keys") else {}
    return contents({**{n: v for n, v in values.items() if not callable(v)}, "[]": table})


class Recording(pickle.Unpickler):
    """Keeps the names of the functions that a pickle calls, apart from NumPy's for arrays."""

    def __init__(self, data):
        super().__init__(io.BytesIO(data))
        self.named = set()

    def find_class(self, module, name):
        if module.split(".")[0] != "numpy":
            self.named.add((module, name))
        return super().find_class(module, name)


def named_functions(data):
    reader = Recording(data)
    reader.load()
    return reader.named


def frame_bytes(scene):
    scans = [scene.lidar(name).scan(frame=1) for name in scene.lidars]
    images = [scene.camera(name).expose(frame=1) for name in scene.cameras]
    return contents([scans, images])


def samples(scene):
    """One object of each class that pickles by value."""
    scan = scene.lidar("light").scan(frame=1)
    plain = scene.lidar("roof").scan(frame=0)
    mesh, _ = groundray.reconstruct_mesh([plain])
    return {
        "Scan": scan,
        "Points": scan[scan["label"] == 70],
        "slice": scan[::-3],
        "no rows": scan[:0],
        "no_returns": scan.no_returns,
        "rays": scene.cast_rays([[0, 0, 90]], [[0, 0, -1]], error_bound=True),
        "Image": scene.camera("eye").expose(frame=0),
        "Mesh": mesh,
        "bare mesh": groundray.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.zeros((0, 3), int)),
        "levels": terrain().mesh(0.1),
        "Terrain": terrain(),
        "FusedDem": groundray.fuse_dem([scan, plain], cell_m=1),
    }


@pytest.fixture(scope="module")
def by_value(scene):
    return samples(scene)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_values_are_equal_after_a_round_trip(by_value, protocol):
    for name, thing in by_value.items():
        again = pickle.loads(pickle.dumps(thing, protocol))
        assert type(again) is type(thing)
        assert repr(again) == repr(thing)
        assert contents(again) == contents(thing), name
        assert contents(thing), name


def test_arrays_may_travel_beside_the_pickle(by_value):
    for thing in by_value.values():
        buffers = []
        data = pickle.dumps(thing, 5, buffer_callback=buffers.append)
        assert contents(pickle.loads(data, buffers=buffers)) == contents(thing)


def test_reconstructions_of_restored_scans_have_the_same_bytes(scene):
    scans = [scene.lidar(name).scan(frame=1) for name in ("roof", "light")]
    again = pickle.loads(pickle.dumps(scans))
    for make in (
        lambda scans: groundray.reconstruct_mesh(scans)[0],
        lambda scans: groundray.fuse_dem(scans, cell_m=0.5),
    ):
        assert contents(make(again)) == contents(make(scans))


def test_a_restored_terrain_is_hit_at_the_same_points(by_value):
    rays = [[50, 40, 30]] * 3, [[0, 0, -1], [0.3, 0.2, -1], [-2, 1, -1]]
    again = pickle.loads(pickle.dumps(by_value["Terrain"]))
    assert contents(again.cast_rays(*rays)) == contents(by_value["Terrain"].cast_rays(*rays))


def test_a_scan_does_not_carry_its_scene(scene):
    data = pickle.dumps(scene.lidar("roof").scan(frame=0))
    assert named_functions(data) == {("groundray._pickle", "scan")}


def test_copies_are_the_object_itself(scene, by_value):
    for thing in [scene, scene.lidar("roof"), *by_value.values()]:
        assert copy.copy(thing) is thing
        assert copy.deepcopy({"kept": [thing]})["kept"][0] is thing


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_scene_of_a_file_makes_the_same_frames(scene, protocol):
    again = pickle.loads(pickle.dumps(scene, protocol))
    assert again.seed == 12
    assert frame_bytes(again) == frame_bytes(scene)


def test_a_scene_with_terrain_in_memory_makes_the_same_frames(tmp_path):
    spec = small_scene.spec(tmp_path, camera=True)
    for detail in ({}, {"tolerance_m": 0.1}):
        spec["terrain"] = {"material": "dry_grass", **detail}
        scene = groundray.scene(spec, folder=tmp_path, terrain=local_terrain())
        again = pickle.loads(pickle.dumps(scene))
        assert frame_bytes(again) == frame_bytes(scene)
        assert frame_bytes(pickle.loads(pickle.dumps(again))) == frame_bytes(scene)


def local_terrain():
    return groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)


# ----- processes


LOADER = """\
import hashlib
import multiprocessing
import sys

import groundray


def digest(thing):
    return hashlib.sha256(b"".join(thing[name].tobytes() for name in thing)).hexdigest()


def load(job):
    scene, frame = job
    return scene.lidar("light").scan(frame=frame), scene.camera("eye").expose(frame=frame)


if __name__ == "__main__":
    scene = groundray.load_scene(sys.argv[1])
    jobs = [(scene, 0), (scene, 1)]
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        results = pool.map_async(load, jobs, chunksize=1).get(timeout=100)
    for made, own in zip(results, map(load, jobs), strict=True):
        assert [each.frame for each in made] == [each.frame for each in own]
        assert list(map(digest, made)) == list(map(digest, own))
        print(*(each.frame for each in made))
"""


def test_a_spawned_pool_makes_the_frames_of_the_parent(folder, tmp_path):
    (tmp_path / "loader.py").write_text(LOADER)
    done = subprocess.run(
        [sys.executable, tmp_path / "loader.py", folder / "scene.yaml"],
        capture_output=True,
        text=True,
        env=dict(os.environ, PYTHONPATH=str(small_scene.PACKAGE)),
        timeout=200,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "0 0\n1 1\n", "")


def test_sensors_that_are_pickled_together_share_their_scene(scene):
    lidar, camera, again = pickle.loads(
        pickle.dumps([scene.lidar("roof"), scene.camera("eye"), scene])
    )
    assert contents(lidar.scan(frame=1)) == contents(scene.lidar("roof").scan(frame=1))
    assert (camera.name, contents(camera.times_s)) == ("eye", contents(again.camera("eye").times_s))
    data = pickle.dumps([scene.lidar("roof"), scene.camera("eye"), scene])
    names = ("lidar", "camera", "scene")
    assert named_functions(data) == {("groundray._pickle", name) for name in names}
    texts = [arg for code, arg, _ in pickletools.genops(data) if "UNICODE" in code.name]
    assert sum("groundray: 1" in text for text in texts) == 1


# ----- changes and damage


def test_an_edited_scene_file_does_not_change_a_pickled_scene(folder, tmp_path):
    file = folder / "edited.yaml"
    file.write_text((folder / "scene.yaml").read_text())
    data = pickle.dumps(groundray.load_scene(file))
    file.write_text("groundray: 1\n")
    assert len(pickle.loads(data).lidar("roof").scan(frame=0)) > 1000


@pytest.mark.parametrize(
    ("name", "change", "input_name"),
    [
        ("ground.tif", lambda path: raised(path), "terrain"),
        ("eye.yaml", lambda path: replaced(path, "depth: 2", "depth: 3"), "camera 'eye'"),
        ("rock.yaml", lambda path: replaced(path, "[0.0855,", "[0.0955,"), "materials"),
        ("block.obj", lambda path: replaced(path, "v 1 1 2", "v 1 1 2.5"), "objects"),
    ],
)
def test_a_changed_file_is_an_error_that_names_its_part(tmp_path, name, change, input_name):
    scene = groundray.load_scene(scene_with_own_files(tmp_path))
    data = pickle.dumps(scene)
    assert contents(pickle.loads(data).objects) == contents(scene.objects)
    change(tmp_path / name)
    with pytest.raises(groundray.Error, match="pickled scene cannot be restored") as raised_error:
        pickle.loads(data)
    assert f"its {input_name} has changed since" in str(raised_error.value)


def scene_with_own_files(folder):
    local_terrain().save(folder / "ground.tif")
    spec = small_scene.spec(folder, camera=True)
    spec["terrain"]["dem"] = "ground.tif"
    soil = (small_scene.ROOT / "data/materials/dry_soil.yaml").read_text()
    (folder / "rock.yaml").write_text(soil.replace("name: dry_soil", "name: my_rock"))
    (folder / "block.obj").write_text(
        "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 1 1 2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    )
    spec["objects"] = [
        {
            "name": "block",
            "label": 9,
            "model": "block.obj",
            "material": "rock.yaml",
            "at_m": [37, 35],
        }
    ]
    (folder / "scene.yaml").write_text(to_yaml(spec))
    return folder / "scene.yaml"


def raised(path):
    groundray.Terrain(small_scene.heights_m() + 0.25, small_scene.CELL_M).save(path)


def replaced(path, old, new):
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))


BAD = [
    None,
    "x",
    b"x",
    -1,
    2**70,
    float("nan"),
    (),
    [("a", 1)],
    [("x", np.zeros(3)), ("x", np.zeros(3))],
    (0, 0),
    (-1.0, 2.0, 3.0),
    np.zeros(1),
    np.zeros((1, 1), np.float32),
    np.full(3, 2**32 - 1, np.uint32),
    np.zeros((2, 3), object),
]


def test_damaged_values_are_errors_or_leave_a_sound_object(by_value):
    refused = 0
    for name, thing in by_value.items():
        restore, (state,) = thing.__reduce__()
        state = pickle.loads(pickle.dumps(state))
        damaged = [(*state[:i], bad, *state[i + 1 :]) for i in range(len(state)) for bad in BAD]
        for values in [*damaged, (), state[:-1], (*state, 1), (2, *state[1:])]:
            try:
                made = restore(values)
            except groundray.Error:
                refused += 1
                continue
            assert type(made) is type(thing), name
            assert contents(made)
    assert refused > 1000


def test_damage_is_named(by_value, scene):
    restore, (state,) = by_value["Scan"].__reduce__()
    state = pickle.loads(pickle.dumps(state))
    with pytest.raises(groundray.Error, match="pickled Scan is damaged: it has 3 values"):
        restore(state[:3])
    columns = [(n, array[:-1]) if n == "time" else (n, array) for n, array in state[2]]
    with pytest.raises(groundray.Error, match=r"its 'time' must be an array of \d+ numbers"):
        restore((*state[:2], columns, *state[3:]))
    with pytest.raises(groundray.Error, match=r"another format than 1: .* another version"):
        restore((9, *state[1:]))
    with pytest.raises(TypeError, match="restore_scan"):
        restore(list(state))
    restore, (state,) = scene.__reduce__()
    with pytest.raises(groundray.Error, match=r"pickled by groundray 0\.0\.9, but this is"):
        restore((state[0], "0.0.9", *state[2:]))
    with pytest.raises(groundray.Error, match="scene cannot be restored: its terrain has changed"):
        restore((*state[:-1], []))
    restore, (state,) = scene.lidar("roof").__reduce__()
    with pytest.raises(groundray.Error, match="'index' is that of no sensor of its scene"):
        restore((*state[:-1], 7))


def test_subclasses_are_not_pickled_as_their_base(by_value):
    class Own(groundray.Mesh):
        pass

    own = Own([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(TypeError, match="pickles hold objects of groundray's own classes"):
        pickle.dumps(own)
