"""nuScenes folders, read by nuscenes-devkit where installed, and by the words of its schema."""

import json
import shutil
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from detection_runs import (
    SIGNS,
    boxed_folder,
    boxes_of,
    corners_of_box,
    half_of_box,
    matrix,
    mount_of,
    moved,
    pinhole_of,
    pose_of,
    pose_of_box,
    projected,
    scan_of,
    speed,
    stamps_s,
)
from export_runs import export, fails, names_in, run_folder, still, world_of
from scipy.spatial.transform import Rotation

VERSION = "v1.0-trainval"
# Foreign keys of each table, by the schema in the documentation of nuscenes-devkit.
KEYS = {
    "attribute": {},
    "calibrated_sensor": {"sensor_token": "sensor"},
    "category": {},
    "ego_pose": {},
    "instance": {
        "category_token": "category",
        "first_annotation_token": "sample_annotation",
        "last_annotation_token": "sample_annotation",
    },
    "log": {},
    "map": {"log_tokens": "log"},
    "sample": {"scene_token": "scene", "prev": "sample", "next": "sample"},
    "sample_annotation": {
        "sample_token": "sample",
        "instance_token": "instance",
        "attribute_tokens": "attribute",
        "visibility_token": "visibility",
        "prev": "sample_annotation",
        "next": "sample_annotation",
    },
    "sample_data": {
        "sample_token": "sample",
        "ego_pose_token": "ego_pose",
        "calibrated_sensor_token": "calibrated_sensor",
        "prev": "sample_data",
        "next": "sample_data",
    },
    "scene": {
        "log_token": "log",
        "first_sample_token": "sample",
        "last_sample_token": "sample",
    },
    "sensor": {},
    "visibility": {},
}
CHANNELS = {"LIDAR_TOP": "top", "LIDAR_FRONT": "front", "CAM_LEFT": "left", "CAM_RIGHT": "right"}
MIDDLE_S = 0.001  # of the exposure
# The path between its lines by slerp, not by screws: well below a millimetre.
PLACE_M = 3e-4
NAMES = {
    4: "static.other",
    6: "static.vegetation",
    10: "vehicle.car",
    11: "human.pedestrian.adult",
}


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    out = tmp_path_factory.mktemp("nuscenes") / "out"
    assert export("nuscenes", out, "--keyframe-s", "0.3", source=boxed_folder()) == 0
    return out


class Own:
    """Reads the tables by the words of the schema."""

    def __init__(self, out):
        self.out = out
        self.rows = {
            name: json.loads((out / VERSION / f"{name}.json").read_text()) for name in KEYS
        }
        self.by_token = {
            name: {row["token"]: row for row in rows} for name, rows in self.rows.items()
        }

    def get(self, table, token):
        return self.by_token[table][token]

    def pose(self, row):
        w, x, y, z = row["rotation"]
        return matrix(Rotation.from_quat([x, y, z, w]), row["translation"])

    def sensor_pose(self, data):
        """Returns the pose of the sensor in the global frame."""
        ego = self.get("ego_pose", data["ego_pose_token"])
        mount = self.get("calibrated_sensor", data["calibrated_sensor_token"])
        return self.pose(ego) @ self.pose(mount)

    def corners(self, data, annotation):
        """Returns the corners of a box in a sensor's frame, in the order of SIGNS."""
        width, length, height = annotation["size"]
        corners = moved(self.pose(annotation), SIGNS * np.array([length, width, height]) / 2)
        return moved(np.linalg.inv(self.sensor_pose(data)), corners)

    def velocity(self, token):
        here = self.get("sample_annotation", token)
        ends = [
            self.get("sample_annotation", here[end]) if here[end] else here
            for end in ("prev", "next")
        ]
        times_us = [self.get("sample", each["sample_token"])["timestamp"] for each in ends]
        if times_us[0] == times_us[1]:
            return np.full(3, np.nan)
        first, last = (np.array(each["translation"]) for each in ends)
        return (last - first) / ((times_us[1] - times_us[0]) * 1e-6)

    def points(self, data):
        """Returns x, y, z, intensity."""
        return np.fromfile(self.out / data["filename"], np.float32).reshape(-1, 5)[:, :4]


class Devkit(Own):
    """The same by nuscenes-devkit."""

    def __init__(self, out):
        super().__init__(out)
        nuscenes = pytest.importorskip(
            "nuscenes.nuscenes",
            reason="nuscenes-devkit requires numpy<2, which the other checks do not have: install "
            "it by pip --no-deps, with pyquaternion, cachetools, shapely, descartes and fire",
            exc_type=ImportError,
        )
        self.kit = nuscenes.NuScenes(VERSION, str(out), verbose=False)

    def corners(self, data, annotation):
        from nuscenes.utils.geometry_utils import BoxVisibility

        _, (box,), _ = self.kit.get_sample_data(
            data["token"], BoxVisibility.NONE, [annotation["token"]]
        )
        theirs = [[x, y, z] for x in (1, -1) for y, z in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
        corners = box.corners().T  # in front, then behind, from above on the left clockwise
        return np.stack([corners[theirs.index(signs)] for signs in SIGNS.tolist()])

    def velocity(self, token):
        return self.kit.box_velocity(token)

    def points(self, data):
        from nuscenes.utils.data_classes import LidarPointCloud

        path = self.kit.get_sample_data_path(data["token"])
        return LidarPointCloud.from_file(path).points.T


@pytest.fixture(scope="module", params=[Own, Devkit])
def reader(request, exported):
    return request.param(exported)


@pytest.fixture(scope="module")
def own(exported):
    return Own(exported)


def test_every_token_is_unique_and_every_key_leads_to_a_row(own):
    tokens = [row["token"] for name in KEYS for row in own.rows[name]]
    assert len(set(tokens)) == len(tokens)
    for name, keys in KEYS.items():
        assert own.rows[name], name
        assert len({frozenset(row) for row in own.rows[name]}) == 1
        for row in own.rows[name]:
            for field, table in keys.items():
                value = row[field]
                for token in value if isinstance(value, list) else [value]:
                    assert token in own.by_token[table] or (
                        token == "" and field in ("prev", "next")
                    ), (name, field)


def chains_of(rows):
    """Follows next from each first row; returns the chains."""
    by_token = {row["token"]: row for row in rows}
    chains = []
    for row in (row for row in rows if not row["prev"]):
        chain = [row]
        while chain[-1]["next"]:
            following = by_token[chain[-1]["next"]]
            assert following["prev"] == chain[-1]["token"]
            chain.append(following)
        chains.append(chain)
    assert sum(map(len, chains)) == len(rows)  # no row is outside of all, or in a circle
    return chains


def test_chains_are_complete_and_in_order_of_time(own):
    (scene,) = own.rows["scene"]
    (samples,) = chains_of(own.rows["sample"])
    assert scene["nbr_samples"] == len(samples) == 4
    assert scene["first_sample_token"] == samples[0]["token"]
    assert scene["last_sample_token"] == samples[-1]["token"]
    for before, after in pairwise(samples):
        assert 297_000 <= after["timestamp"] - before["timestamp"] < 400_000
    order = {row["token"]: i for i, row in enumerate(samples)}
    chains = chains_of(own.rows["sample_data"])
    assert len(chains) == len(CHANNELS)
    for chain in chains:
        assert len({row["calibrated_sensor_token"] for row in chain}) == 1
        assert all(a["timestamp"] < b["timestamp"] for a, b in pairwise(chain))
        keys = [order[row["sample_token"]] for row in chain if row["is_key_frame"]]
        assert keys == list(range(4))
        for row in chain:
            sample = samples[order[row["sample_token"]]]
            if row["is_key_frame"]:
                nearest = min(abs(each["timestamp"] - sample["timestamp"]) for each in chain)
                assert abs(row["timestamp"] - sample["timestamp"]) == nearest
            elif sample is not samples[-1]:  # it belongs to the sample that follows it
                assert row["timestamp"] <= sample["timestamp"]
                before = samples[order[row["sample_token"]] - 1]
                assert row["timestamp"] > before["timestamp"]
    chains = {
        chain[0]["instance_token"]: chain for chain in chains_of(own.rows["sample_annotation"])
    }
    assert set(chains) == set(own.by_token["instance"])
    for token, chain in chains.items():
        instance = own.get("instance", token)
        assert {row["instance_token"] for row in chain} == {token}
        assert instance["nbr_annotations"] == len(chain)
        assert instance["first_annotation_token"] == chain[0]["token"]
        assert instance["last_annotation_token"] == chain[-1]["token"]
        places = [order[row["sample_token"]] for row in chain]
        assert places == sorted(set(places))


def channel_of(own, data):
    mount = own.get("calibrated_sensor", data["calibrated_sensor_token"])
    return own.get("sensor", mount["sensor_token"])["channel"]


def frame_of(own, data):
    """Returns the sensor and the number of a frame, by its time."""
    sensor = CHANNELS[channel_of(own, data)]
    later_s = MIDDLE_S if sensor in ("left", "right") else 0
    apart_s = np.abs(np.array(stamps_s(sensor)) + later_s - data["timestamp"] * 1e-6)
    assert apart_s.min() < 1e-6
    return sensor, int(apart_s.argmin())


def test_files_are_those_of_the_tables(own, exported):
    listed = {row["filename"] for row in own.rows["sample_data"] + own.rows["map"]}
    listed |= {f"{VERSION}/{name}.json" for name in (*KEYS, "splits")}
    found = {p.relative_to(exported).as_posix() for p in exported.rglob("*") if p.is_file()}
    assert found == listed
    for data in own.rows["sample_data"]:
        assert data["filename"].startswith("samples/" if data["is_key_frame"] else "sweeps/")
        assert data["filename"].split("/")[1] == channel_of(own, data)
        sensor, frame = frame_of(own, data)
        if sensor in ("left", "right"):
            recorded = boxed_folder() / f"camera/{sensor}/{frame:06}.png"
            assert (exported / data["filename"]).read_bytes() == recorded.read_bytes()
            assert (data["width"], data["height"], data["fileformat"]) == (96, 72, "png")
        else:
            assert (data["width"], data["height"], data["fileformat"]) == (0, 0, "pcd")


def test_calibration_and_poses_are_those_of_the_dataset(own):
    for mount in own.rows["calibrated_sensor"]:
        sensor = CHANNELS[own.get("sensor", mount["sensor_token"])["channel"]]
        np.testing.assert_allclose(own.pose(mount), mount_of(sensor), atol=1e-12)
        if sensor in ("left", "right"):
            K = np.array(mount["camera_intrinsic"])
            np.testing.assert_allclose(K, pinhole_of(sensor), rtol=1e-12)
        else:
            assert mount["camera_intrinsic"] == []
    for data in own.rows["sample_data"]:
        ego = own.get("ego_pose", data["ego_pose_token"])
        assert ego["timestamp"] == data["timestamp"]
        sensor, _ = frame_of(own, data)
        X_DS = pose_of(sensor, data["timestamp"] * 1e-6)
        np.testing.assert_allclose(own.sensor_pose(data), X_DS, atol=PLACE_M)


def sample_frames(own):
    """Yields each sample with its time and the key frame of each sensor."""
    for sample in own.rows["sample"]:
        keys = {}
        for data in own.rows["sample_data"]:
            if data["is_key_frame"] and data["sample_token"] == sample["token"]:
                sensor, frame = frame_of(own, data)
                keys[sensor] = (data, frame)
        yield sample, sample["timestamp"] * 1e-6, keys


def tables_of(keys):
    """Returns the first box of each instance, with the stamp of its frame, and all of images."""
    boxes, seen = {}, {}
    for sensor in ("top", "left", "right"):
        frame = keys[sensor][1]
        for row in boxes_of(sensor, frame):
            boxes.setdefault(int(row["instance"]), (row, stamps_s(sensor)[frame]))
            if sensor != "top":
                seen.setdefault(int(row["instance"]), []).append(row)
    return boxes, seen


def annotations_of(own, sample):
    """Returns the annotations of a sample by the dataset's instances."""
    return {
        own.get("instance", row["instance_token"])["groundray_instance"]: row
        for row in own.rows["sample_annotation"]
        if row["sample_token"] == sample["token"]
    }


def test_corners_lie_where_the_dataset_places_them(reader):
    checked = 0
    for sample, time_s, keys in sample_frames(reader):
        boxes, _ = tables_of(keys)
        annotations = annotations_of(reader, sample)
        assert set(annotations) == set(boxes)
        for instance, annotation in annotations.items():
            row, begin_s = boxes[instance]
            in_world = corners_of_box(row, time_s - begin_s)
            for sensor in ("top", "left"):
                data, frame = keys[sensor]
                at_s = stamps_s(sensor)[frame] + (MIDDLE_S if sensor == "left" else 0)
                expected = moved(np.linalg.inv(pose_of(sensor, at_s)), in_world)
                corners = reader.corners(data, annotation)
                # Angles of the slerp differ by 1e-5 or less.
                atol = PLACE_M + 1e-5 * np.linalg.norm(expected, axis=1).max()
                np.testing.assert_allclose(corners, expected, atol=atol)
                if sensor == "left" and expected[:, 2].min() > 3:
                    mount = reader.get("calibrated_sensor", data["calibrated_sensor_token"])
                    in_image = projected(np.array(mount["camera_intrinsic"]), corners)
                    in_picture = projected(pinhole_of("left"), expected)
                    # 66 px a radian: 3e-4 m at 3 m, and the angle of 1e-5.
                    np.testing.assert_allclose(in_image, in_picture, atol=0.03)
                    checked += 1
    assert checked > 50


def test_velocities_are_differences_of_poses(reader):
    centres, speeds = {}, {}
    for sample, time_s, keys in sample_frames(reader):
        boxes, _ = tables_of(keys)
        for instance, annotation in annotations_of(reader, sample).items():
            row, begin_s = boxes[instance]
            centre = pose_of_box(row, time_s - begin_s)[:3, 3]
            centres.setdefault(instance, []).append((time_s, centre, annotation))
            speeds.setdefault(instance, []).append(row)
    moving = 0
    for instance, track in centres.items():
        for i, (_, _, annotation) in enumerate(track):
            first, last = track[max(i - 1, 0)], track[min(i + 1, len(track) - 1)]
            velocity = reader.velocity(annotation["token"])
            if first[0] == last[0]:
                assert np.isnan(velocity).all()
                continue
            expected = (last[1] - first[1]) / (last[0] - first[0])
            # Times are rounded to microseconds: half of one at 6 m/s, twice, in 0.3 s.
            np.testing.assert_allclose(velocity, expected, rtol=1e-5, atol=2e-5)
            row = speeds[instance][i]
            if row["label"] in (4, 6):
                assert not velocity.any()
            else:  # the car turns and pitches, as in boxes_test.py
                stated = np.array([row[f"v{k}_m_s"] for k in "xyz"])
                assert np.linalg.norm(velocity - stated) < (1.5 if row["label"] == 10 else 0.5)
                moving += 1
    assert moving >= 4


def test_points_are_placed_by_the_poses_and_lie_in_boxes(reader):
    checked = 0
    for sample, time_s, keys in sample_frames(reader):
        boxes, _ = tables_of(keys)
        annotations = annotations_of(reader, sample)
        counts = dict.fromkeys(annotations, 0)
        for sensor in ("top", "front"):
            data, frame = keys[sensor]
            rows = scan_of(sensor, frame)
            points = reader.points(data)
            np.testing.assert_allclose(points[:, 3], 255 * rows["intensity"], rtol=1e-6)
            raw = np.fromfile(reader.out / data["filename"], np.float32).reshape(-1, 5)
            np.testing.assert_array_equal(raw[:, 4], rows["ring"])
            in_world = moved(reader.sensor_pose(data), points[:, :3].astype(float))
            np.testing.assert_allclose(
                in_world[still(rows)], world_of(rows)[still(rows)], atol=PLACE_M
            )
            begin_s = stamps_s(sensor)[frame]
            for instance, annotation in annotations.items():
                own = np.flatnonzero(rows["instance"] == instance)
                counts[instance] += len(own)
                if sensor == "front" or not len(own):
                    continue
                row, _ = boxes[instance]
                in_box = moved(np.linalg.inv(reader.pose(annotation)), in_world[own])
                off_m = (np.abs(in_box) - half_of_box(row)).max(axis=1)
                # Limbs are up to three times as fast as the body.
                apart_s = np.abs(rows["time"][own] + begin_s - time_s)
                assert np.all(off_m <= 3 * speed(row) * apart_s + PLACE_M)
                checked += len(own)
        for instance, annotation in annotations.items():
            assert annotation["num_lidar_pts"] == counts[instance]
            assert annotation["num_radar_pts"] == 0
    assert checked > 1000


def test_levels_of_visibility_and_attributes_are_those_of_the_boxes(own):
    levels = {row["token"]: row["level"] for row in own.rows["visibility"]}
    names = {row["token"]: row["name"] for row in own.rows["attribute"]}
    used, attributes = set(), {}
    for sample, _, keys in sample_frames(own):
        boxes, seen = tables_of(keys)
        for instance, annotation in annotations_of(own, sample).items():
            row, _ = boxes[instance]
            share = 0.0
            for image in seen.get(instance, []):
                # b / (b + alone) is the share beside the image.
                beside = image["alone"] / (1 - image["truncated_share"]) - image["alone"]
                share = max(share, image["pixels"] / (image["alone"] + beside))
            low, high = (
                int(n) / 100 for n in levels[annotation["visibility_token"]][1:].split("-")
            )
            assert low - 1e-12 <= share <= high + 1e-12
            used.add(annotation["visibility_token"])
            category = own.get(
                "category", own.get("instance", annotation["instance_token"])["category_token"]
            )
            assert category["name"] == NAMES[row["label"]]
            for token in annotation["attribute_tokens"]:
                attributes.setdefault(category["name"], set()).add(names[token])
    assert used == {"1", "2", "3", "4"}
    assert attributes == {
        "vehicle.car": {"vehicle.moving"},
        "human.pedestrian.adult": {"pedestrian.moving"},
    }


def test_the_devkits_evaluation_reads_boxes_and_the_split(exported):
    kit = Devkit(exported).kit
    from nuscenes.eval.common.loaders import load_gt_of_sample_tokens
    from nuscenes.eval.detection.data_classes import DetectionBox
    from nuscenes.utils.splits import get_scenes_of_split

    assert get_scenes_of_split("groundray", kit) == ["scene-0000"]
    tokens = [row["token"] for row in kit.sample]
    truth = load_gt_of_sample_tokens(kit, tokens, DetectionBox)
    found = [box for token in tokens for box in truth[token]]
    assert {box.detection_name for box in found} == {"car", "pedestrian"}
    assert {box.attribute_name for box in found} == {"vehicle.moving", "pedestrian.moving"}


def test_without_images_visibility_is_unknown(tmp_path, capsys):
    options = ["--no-images", "--sequence", "7", "--lidar", "top"]
    assert export("nuscenes", tmp_path / "out", *options, source=boxed_folder()) == 0
    own = Own(tmp_path / "out")
    assert {row["channel"] for row in own.rows["sensor"]} == {"LIDAR_TOP"}
    assert {row["visibility_token"] for row in own.rows["sample_annotation"]} == {""}
    assert own.rows["scene"][0]["name"] == "scene-0007"
    assert len(own.rows["sample"]) == 3  # half a second apart
    assert names_in(tmp_path / "out/sweeps") == ["LIDAR_TOP"]


def test_a_set_of_labels_gives_the_categories(tmp_path, capsys):
    options = ["--labels", "cityscapes", "--boxes-of", "vehicle,person"]
    run = shutil.copytree(boxed_folder(), tmp_path / "run")
    record = run / "dataset.yaml"
    record.write_text(record.read_text().replace("11: person", "11: animal"))
    assert export("nuscenes", tmp_path / "none", *options, source=run) == 1
    assert "--boxes-of person: it is no class or label of an object" in capsys.readouterr().err
    options[-1] = "vehicle,11"
    assert export("nuscenes", tmp_path / "out", *options, source=run) == 0
    assert "has no category for animal: it is added as number 34" in capsys.readouterr().out
    own = Own(tmp_path / "out")
    used = {own.get("category", row["category_token"])["name"] for row in own.rows["instance"]}
    assert used == {"car", "animal"}


def test_a_dataset_without_boxes_has_one_message(tmp_path, capsys):
    run = shutil.copytree(run_folder(), tmp_path / "run")
    line = fails(capsys, run, "nuscenes", "--camera", "left")
    assert (
        "it has neither scans nor pictures with boxes, which nuscenes needs; set boxes: rep" in line
    )


def test_times_are_those_of_the_clock_of_the_dataset(tmp_path, capsys):
    run = shutil.copytree(boxed_folder(), tmp_path / "run")
    text = (run / "dataset.yaml").read_text()
    later = text.replace("time_origin_s: 0.000000000", "time_origin_s: 1782057600.250000001", 1)
    assert later != text
    (run / "dataset.yaml").write_text(later)
    assert export("nuscenes", tmp_path / "out", source=run) == 0
    own = Own(tmp_path / "out")
    assert own.rows["log"][0]["date_captured"] == "2026-06-21"
    # Ten scans a second, and two samples.
    for row, stamp_s in zip(own.rows["sample"], stamps_s("top")[::5], strict=True):
        nanoseconds = 1782057600250000001 + round(stamp_s * 1e9)
        assert row["timestamp"] == (nanoseconds + 500) // 1000


def test_stamps_that_do_not_increase_have_one_message(tmp_path, capsys):
    run = shutil.copytree(boxed_folder(), tmp_path / "run")
    text = (run / "dataset.yaml").read_text()
    stamps = [f"frame: {i}, stamp_s: {stamps_s('left')[i]:.9f}" for i in (3, 4)]
    assert all(text.count(f'sensor: "left", {each}') == 1 for each in stamps)
    same = text.replace(f'"left", {stamps[1]}', f'"left", frame: 4, stamp_s: {stamps_s("left")[3]}')
    (run / "dataset.yaml").write_text(same)
    line = fails(capsys, run, "nuscenes")
    assert "the stamps of left do not increase by microseconds; was it edited?" in line


def test_two_sensors_of_one_channel_have_one_message(tmp_path):
    from groundray.dataset import Dataset, Error
    from groundray.export.boxes import BoxChoice
    from groundray.export.categories import Categories
    from groundray.export.notes import Notes
    from groundray.export.nuscenes import NuscenesOptions, write_nuscenes
    from groundray.export.scan import FullScale

    data = Dataset(boxed_folder())
    lidars = [data.lidars[0], replace(data.lidars[1], name="TOP")]
    categories = Categories(data, None, Notes())
    options = NuscenesOptions(FullScale(None), categories, BoxChoice(data, None), 0, 10**9)
    with pytest.raises(Error, match="two of its sensors would be the channel LIDAR_TOP; choose"):
        write_nuscenes(data, lidars, [], options, tmp_path, Notes())
