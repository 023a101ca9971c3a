"""Readers of nuScenes folders: nuscenes-devkit where installed, and one by the schema's words."""

import atexit
import functools
import json
import shutil
import tempfile
from pathlib import Path

import numpy as np
from detection_runs import SIGNS, boxed_folder, boxes_of, matrix, moved, stamps_s
from export_runs import export
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


@functools.cache
def nuscenes_folder() -> Path:
    """The dataset with boxes as nuScenes, exported once for all tests."""
    folder = Path(tempfile.mkdtemp(prefix="groundray_nuscenes_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    assert export("nuscenes", folder / "out", "--keyframe-s", "0.3", source=boxed_folder()) == 0
    return folder / "out"


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
        from nuscenes.nuscenes import NuScenes

        self.kit = NuScenes(VERSION, str(out), verbose=False)

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


__all__ = [
    "CHANNELS",
    "KEYS",
    "MIDDLE_S",
    "PLACE_M",
    "VERSION",
    "Devkit",
    "Own",
    "annotations_of",
    "channel_of",
    "frame_of",
    "nuscenes_folder",
    "sample_frames",
    "tables_of",
]
