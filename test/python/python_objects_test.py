"""Objects of a scene that are given as arrays: the bytes are those of the same objects in files."""

import pickle

import groundray
import numpy as np
import pytest
import small_scene

# A tetrahedron, vertices that no float32 holds; its last triangle shares corners with all others.
CORNERS_M = np.array([[-1, -0.9, 0], [1.1, -1, 0], [0.1, 1.3, 0], [0.2, 0.1, 2.3]]) / 3
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
POSES = np.array(
    [
        [0, 36, 33, 3, 0, 0, 0, 1],
        [0.1, 36.5, 33.25, 3.1, 0, 0, 0.1, 0.99498743710662],
        [0.3, 37, 34, 3, 0, 0, 0.2, 0.979795897113271],
    ]
)


def mesh():
    return groundray.Mesh(CORNERS_M, TRIANGLES, labels=[1, 2, 3, 4])


def objects(model, trajectory):
    """A standing object, a moving one and a layer, all of one model."""
    common = {"model": model, "material": "metal"}
    return {
        "objects": [
            {**common, "name": "still", "label": 8, "at_m": [38, 35.3], "yaw_deg": 30, "scale": 4},
            {**common, "name": "moving", "label": 9, "scale": 2, "trajectory": trajectory},
        ],
        "scatter": [
            {
                "name": "many",
                "label": 10,
                "models": [{**common, "weight": 2}, {"asset": "rock"}],
                "density_per_m2": 0.05,
            }
        ],
    }


def scene_of(folder, model, trajectory):
    spec = small_scene.spec(folder, camera=True) | objects(model, trajectory)
    terrain = groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)
    return groundray.scene(spec, folder=folder, terrain=terrain)


def frames(scene):
    scan = scene.lidar("light").scan(frame=1)
    image = scene.camera("eye").expose(frame=1)
    return [(n, thing[n].tobytes()) for thing in (scan, image) for n in thing]


@pytest.fixture(scope="module")
def in_memory(tmp_path_factory):
    return scene_of(tmp_path_factory.mktemp("python_objects"), mesh(), POSES)


def write_obj(path):
    corners = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in CORNERS_M.tolist())
    path.write_text(corners + "".join(f"f {a} {b} {c}\n" for a, b, c in (TRIANGLES + 1).tolist()))


@pytest.mark.parametrize("ending", ["ply", "obj"])
def test_a_mesh_in_memory_is_seen_as_the_same_mesh_in_a_file(in_memory, tmp_path, ending):
    if ending == "ply":
        mesh().save(tmp_path / "block.ply")
    else:
        write_obj(tmp_path / "block.obj")
    rows = [" ".join(repr(float(value)) for value in row) for row in POSES]
    (tmp_path / "path.tum").write_text("\n".join(rows) + "\n")
    of_files = scene_of(tmp_path, f"block.{ending}", "path.tum")
    assert in_memory.objects == of_files.objects
    assert frames(in_memory) == frames(of_files)


def test_objects_in_memory_have_their_labels_and_instances(in_memory):
    still, moving = (group for group in in_memory.objects if group["name"] in ("still", "moving"))
    # From above the still object's centroid, and above that of the moving one at 0.1 s.
    x, y = CORNERS_M.mean(0)[:2] * 4
    turn = np.radians(30)
    places = np.array(
        [
            [38 + x * np.cos(turn) - y * np.sin(turn), 35.3 + x * np.sin(turn) + y * np.cos(turn)],
            [36.5, 33.25],
        ]
    ) - np.array(in_memory.origin_w_m[:2])
    rays = in_memory.cast_rays(np.c_[places, [50, 50]], [[0, 0, -1]] * 2, t_s=0.1)
    assert rays["label"].tolist() == [8, 9]
    assert rays["instance"].tolist() == [still["first"], moving["first"]]
    # Two sides of the tetrahedron meet there; the top of the still one is below 4 * 2.3 / 3 m.
    assert (rays["world_z_m"] > in_memory.heights_at(places)).all()


def test_scenes_with_objects_in_memory_can_be_pickled(in_memory):
    again = pickle.loads(pickle.dumps(in_memory))
    assert again.objects == in_memory.objects
    assert frames(again) == frames(in_memory)
    assert frames(pickle.loads(pickle.dumps(again))) == frames(in_memory)


def test_a_platform_may_have_poses_in_memory(tmp_path):
    spec = small_scene.spec(tmp_path)
    poses = np.array([[5, 30, 30, 6, 0, 0, 0, 1], [6, 36, 30, 6, 0, 0, 0, 1]], float)
    spec["platform"] = {"trajectory": poses.tolist()}
    terrain = groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)
    lidar = groundray.scene(spec, folder=tmp_path, terrain=terrain).lidar("roof")
    assert np.allclose(lidar.pose(0.2)[:3, 3] - lidar.pose(0.0)[:3, 3], [1.2, 0, 0], atol=1e-9)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (
            {"model": groundray.Mesh(CORNERS_M, np.zeros((0, 3), int))},
            groundray.Error,
            r"object 'still': its Mesh: there is no triangle",
        ),
        (
            {"model": groundray.Mesh(CORNERS_M, [[0, 1, 1]])},
            groundray.Error,
            r"object 'still': its Mesh:\n?.*1 polygons or triangles have no area",
        ),
        ({"metres_per_unit": 2}, groundray.Error, r"object 'still': metres_per_unit, up, broken"),
        ({"up": "y"}, groundray.Error, r"its model is a Mesh, which is in metres with z up"),
        ({"model": "memory:mesh 7"}, groundray.Error, r"object 'still': memory:mesh 7"),
        ({"colour": "red"}, groundray.Error, r"key 'colour': unknown"),
        ({"model": CORNERS_M}, groundray.Error, r"key 'model'"),
        ({"trajectory": POSES[:, :7]}, TypeError, r"shape \(n, 8\).* is \(3, 7\)"),
        ({"trajectory": POSES * np.nan}, ValueError, r"numbers that are not finite"),
        ({"trajectory": POSES[::-1]}, groundray.Error, r"memory:trajectory 0"),
    ],
)
def test_faults_of_objects_in_memory_name_the_object(tmp_path, change, error, words):
    spec = small_scene.spec(tmp_path)
    entry = {"name": "still", "label": 8, "material": "metal", "model": mesh(), **change}
    if "trajectory" not in change:
        entry["at_m"] = [38, 35.3]
    spec["objects"] = [entry]
    terrain = groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)
    with pytest.raises(error, match=words):
        groundray.scene(spec, folder=tmp_path, terrain=terrain)
