"""Transforms and camera infos of bags: positions of points in the world and in images."""

import cv2
import numpy as np
import pytest
import yaml
from export_bags import SHIFT_NS, of, points_of, stamp_ns, whole_bag
from export_runs import run_folder, scans, still, world_of
from scipy.spatial.transform import Rotation, Slerp


@pytest.fixture(scope="module")
def everything():
    return whole_bag()[1]


class Frames:
    """Transforms of /tf and /tf_static, interpolated as in tf2: linearly, and by slerp."""

    def __init__(self, everything):
        self.fixed, times, moved = {}, [], []
        for topic, time_ns, message in everything:
            if topic not in ("/tf", "/tf_static"):
                continue
            for each in message.transforms:
                q, p = each.transform.rotation, each.transform.translation
                pose = [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
                if topic == "/tf_static":
                    assert each.header.frame_id == "base_link"
                    self.fixed[each.child_frame_id] = pose
                else:
                    assert (each.header.frame_id, each.child_frame_id) == ("map", "base_link")
                    assert stamp_ns(each) == time_ns
                    times.append(time_ns)
                    moved.append(pose)
        self.times_ns, self.moved = np.array(times), np.array(moved)

    def in_map(self, points, frame, times_ns):
        """Transforms points of a frame, each at its time, to the map."""
        fixed = np.array(self.fixed[frame])
        points = Rotation.from_quat(fixed[3:]).apply(points) + fixed[:3]
        turns = Slerp(self.times_ns - self.times_ns[0], Rotation.from_quat(self.moved[:, 3:]))
        since = np.asarray(times_ns) - self.times_ns[0]
        places = [
            np.interp(since, self.times_ns - self.times_ns[0], column)
            for column in self.moved.T[:3]
        ]
        return turns(since).apply(points) + np.stack(places, axis=-1)

    def in_sensor(self, points, frame, time_ns):
        """Transforms points of the map to a frame at one time."""
        X = np.eye(4)
        for axis in range(3):
            X[:3, axis] = self.in_map(np.eye(3)[[axis]], frame, [time_ns])[0]
        X[:3, 3] = self.in_map(np.zeros((1, 3)), frame, [time_ns])[0]
        X[:3, :3] -= X[:3, [3]]
        return (points - X[:3, 3]) @ X[:3, :3]


@pytest.mark.parametrize("lidar", ["front", "bare-16"])
def test_transforms_place_points_at_their_true_positions(everything, lidar):
    frames = Frames(everything)
    topic = lidar.replace("-", "_")
    for _, message in of(everything, f"/{topic}/points"):
        points = points_of(message)
        is_fired = lidar == "bare-16"  # else they are of the stamp
        times_ns = stamp_ns(message) + np.rint(points["time"].astype(float) * 1e9 * is_fired)
        p = np.stack([points[axis] for axis in "xyz"], axis=-1)
        in_map = frames.in_map(p, message.header.frame_id, times_ns.astype(np.int64))
        # tf2 goes straight where the simulation drives bends: well below a millimetre at 100 Hz.
        np.testing.assert_allclose(in_map, world_of(points), atol=3e-4)


@pytest.mark.parametrize("camera", ["left", "eye"])
def test_transforms_and_camera_infos_project_points_to_their_pixels(everything, camera):
    """OpenCV projects; the oracle is the run's table of echoes and their pixels."""
    frames = Frames(everything)
    bare = list(scans("bare-16"))
    said = yaml.safe_load((run_folder() / f"calibration/{camera}.yaml").read_text())
    checked = 0
    for i, (_, info) in enumerate(of(everything, f"/{camera}/camera_info")):
        table = np.load(run_folder() / f"camera/{camera}/{i:06}_bare-16.npy")
        middle_s = (stamp_ns(info) - SHIFT_NS) * 1e-9
        scan = [rows for begin_s, rows in bare if begin_s <= middle_s][-1]  # the last one begun
        table = table[
            still(scan)[table["echo"]] & (table["is_inside"] == 1) & (table["depth_m"] > 1)
        ]
        if said["row_s"]:  # the transform is of the middle row alone
            table = table[np.abs(table["v_px"] - (said["size_px"][1] - 1) / 2) < 0.5]
        p = frames.in_sensor(world_of(scan[table["echo"]]), info.header.frame_id, stamp_ns(info))
        u, v = project(info, p)
        # The table is of the row's own time: within half a row the car moves 0.2 mm.
        np.testing.assert_allclose(u, table["u_px"], atol=0.02)
        np.testing.assert_allclose(v, table["v_px"], atol=0.02)
        checked += len(table)
    assert checked > (20 if said["row_s"] else 1000)


def project(info, points):
    K, D = info.k.reshape(3, 3), np.asarray(info.d)
    if info.distortion_model == "equidistant":
        pixels, _ = cv2.fisheye.projectPoints(points[:, None], np.zeros(3), np.zeros(3), K, D)
    else:
        assert info.distortion_model == "plumb_bob"
        pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, D)
    return pixels.reshape(-1, 2).T
