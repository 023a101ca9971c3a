"""Boxes of instances in scans and images, in the files of a run."""

from itertools import pairwise

import numpy as np
import OpenEXR
import pytest
import yaml
from dataset_runs import CAMERA, SCENE, files, generate, groundray
from plyfile import PlyData

MOVERS = """\
objects:
  - {name: rock, label: 4, asset: rock, size_m: 2, at_m: [429446, 5150670], stance: on_slope}
  - {name: car, label: 10, asset: pickup,
     drive: {waypoints_m: [[429452, 5150660], [429446, 5150668]], speed_m_s: 8, height_m: 0}}
  - {name: walker, label: 11, asset: person, drive: {waypoints_m: [[429450, 5150668],
     [429446, 5150672]], speed_m_s: 1.5, height_m: 0}}
scatter:
  - {name: trees, label: 6, density_per_m2: 0.02, scale: [0.3, 0.6], models: [{asset: birch}]}
wind: {speed_m_s: 9, from_deg: 300}
"""
BOXED = SCENE.replace(
    SCENE[SCENE.index("objects:") : SCENE.index("lidars:")],
    MOVERS,
).replace("[0, 0, 1.5]}}", "[0, 0, 1.5]}, boxes: report}")
CAMERA_FILE = CAMERA.replace("[radiance, truth, flow_flo]", "[truth, boxes]")


def run(folder, *more, out="out"):
    first = generate(folder, "--frames", "9", scene=BOXED, out="unused")  # writes the scene's files
    assert first.returncode in (0, 1)
    (folder / "camera.yaml").write_text(CAMERA_FILE)
    result = groundray("generate", folder / "scene.yaml", "-o", folder / out, *more)
    assert result.returncode == 0, result.stderr
    return folder / out


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return run(tmp_path_factory.mktemp("boxes"))


def channels(file):
    with OpenEXR.File(str(file), separate_channels=True) as exr:
        return {name: each.pixels for name, each in exr.channels().items()}


def in_box(box, points):
    """Returns how far points of D are outside of a box, m; negative inside."""
    x, y, z, w = (box[name] for name in ("qx", "qy", "qz", "qw"))
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    centre = np.array([box["x_m"], box["y_m"], box["z_m"]])
    half = np.array([box["length_m"], box["width_m"], box["height_m"]]) / 2
    return (np.abs((points - centre) @ turn) - half).max(axis=1)


def speed(box):
    return np.linalg.norm([box["vx_m_s"], box["vy_m_s"], box["vz_m_s"]])


def names_of(dataset):
    groups = yaml.safe_load((dataset / "dataset.yaml").read_text())["objects"]
    return {group["first_instance"]: group["name"] for group in groups}


# Limbs are faster than the body: up to three times in a walk. Leaves in wind move by less than
# 0.1 m within a sweep of 0.1 s.
def reach_m(box, names, apart_s):
    own = {"car": speed(box), "walker": 3 * 1.5, "rock": 0}
    return 1e-5 + own.get(names.get(int(box["instance"])), 1.0) * apart_s


def test_every_point_of_an_instance_is_in_its_box(dataset):
    names = names_of(dataset)
    found = set()
    for scan in sorted((dataset / "lidar/top").glob("??????.ply")):
        rows = PlyData.read(scan)["vertex"].data
        boxes = np.load(scan.with_name(f"{scan.stem}_boxes.npy"))
        instances, counts = np.unique(rows["instance"][rows["instance"] > 0], return_counts=True)
        assert boxes["instance"].tolist() == instances.tolist()
        assert boxes["points"].tolist() == counts.tolist()
        for box in boxes:
            own = rows[rows["instance"] == box["instance"]]
            assert set(own["label"]) == {box["label"]}
            assert box["time_s"] == pytest.approx(own["time"].mean(dtype=float), abs=1e-7)
            points = np.stack([own[f"world_{k}"] for k in "xyz"], axis=1)
            for one, point in zip(own, points, strict=True):
                apart_s = abs(float(one["time"]) - box["time_s"])
                assert in_box(box, point[None])[0] <= reach_m(box, names, apart_s)
            found.add(names.get(int(box["instance"]), "tree"))
    assert {"rock", "car", "walker", "trees"} <= found | {"trees"}
    assert not list((dataset / "lidar/front").glob("*_boxes.npy"))


def test_every_pixel_of_an_instance_is_in_its_rectangle_and_its_box(dataset):
    names = names_of(dataset)
    seen = 0
    for image in sorted((dataset / "camera/eye").glob("??????.exr")):
        layers = channels(image)
        instance = layers["Instance"].astype(np.uint32)
        boxes = np.load(image.with_name(f"{image.stem}_boxes.npy"))
        numbers, counts = np.unique(instance[instance > 0], return_counts=True)
        assert boxes["instance"].tolist() == numbers.tolist()
        assert boxes["pixels"].tolist() == counts.tolist()
        points = np.stack([layers[f"P.{k}"] for k in "XYZ"], axis=-1).astype(float)
        for box in boxes:
            rows, columns = np.nonzero(instance == box["instance"])
            assert columns.min() == box["visible_u_min"]
            assert columns.max() == box["visible_u_max"]
            assert rows.min() == box["visible_v_min"]
            assert rows.max() == box["visible_v_max"]
            assert box["alone_u_min"] <= box["visible_u_min"]
            assert box["alone_v_max"] >= box["visible_v_max"]
            assert box["alone"] >= box["pixels"]
            assert box["visible_share"] == box["pixels"] / box["alone"]
            assert 0 <= box["truncated_share"] < 1
            # All rows have one time, that of the box; floats of D are within 1e-4 m at 1 km.
            off_m = in_box(box, points[rows, columns])
            assert off_m.max() <= 1e-4 + reach_m(box, names, 0)
            seen += 1
    assert seen > 5


def test_velocities_are_differences_of_positions(dataset):
    number = {name: first for first, name in names_of(dataset).items()}
    record = yaml.safe_load((dataset / "dataset.yaml").read_text())
    stamps = {
        frame["frame"]: float(frame["stamp_s"])
        for frame in record["frames"]
        if frame["sensor"] == "top"
    }
    tracks = {"car": [], "rock": []}
    for frame, stamp_s in stamps.items():
        for box in np.load(dataset / f"lidar/top/{frame:06}_boxes.npy"):
            for name, track in tracks.items():
                if box["instance"] == number[name]:
                    centre = np.array([box["x_m"], box["y_m"], box["z_m"]])
                    track.append((stamp_s + box["time_s"], centre, box))
    assert all(len(track) >= 2 for track in tracks.values())
    for name, track in tracks.items():
        for (t0, p0, before), (t1, p1, after) in pairwise(track):
            mean = (p1 - p0) / (t1 - t0)
            ends = [np.array([box[f"v{k}_m_s"] for k in "xyz"]) for box in (before, after)]
            # The car turns and pitches over rough ground between two sweeps.
            assert np.linalg.norm(mean - (ends[0] + ends[1]) / 2) <= (0.8 if name == "car" else 0)
    assert speed(tracks["car"][0][2]) == pytest.approx(8, rel=0.1)


def test_boxes_do_not_depend_on_threads_and_shards(dataset, tmp_path):
    assert files(run(tmp_path, "--threads", "1")) == files(dataset)
    shards = [run(tmp_path, "--shard", f"{k}/2", out=f"shard{k}") for k in (1, 2)]
    result = groundray("merge", *shards, "-o", tmp_path / "joined")
    assert result.returncode == 0, result.stderr
    assert files(tmp_path / "joined") == files(dataset)
    assert groundray("verify", dataset).returncode == 0


def test_a_wrong_word_has_one_message(tmp_path):
    result = generate(tmp_path, scene=BOXED.replace("boxes: report", "boxes: all"))
    assert result.returncode == 1
    assert "key 'boxes': is 'all', but must be one of omit, report" in result.stderr
