"""Interpolation and extrapolation of paths, and rotations as quaternions."""

import numpy as np
import pytest
from export_runs import dataset
from groundray.export.sensor_path import SensorPath, quaternion_wxyz
from scipy.linalg import expm
from scipy.spatial.transform import Rotation


def write(file, times_s, poses):
    lines = []
    for time_s, pose in zip(times_s, poses, strict=True):
        q = Rotation.from_matrix(pose[:3, :3]).as_quat()
        lines.append(" ".join(f"{value:.17g}" for value in (time_s, *pose[:3, 3], *q)))
    file.write_text("# t x y z qx qy qz qw\n" + "\n".join(lines) + "\n")
    return SensorPath(file)


def twist(turn, move):
    generator = np.zeros((4, 4))
    x, y, z = turn
    generator[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    generator[:3, 3] = move
    return generator


@pytest.mark.parametrize("turn", [(0.3, -1.7, 2.1), (0, 0, 1e-9), (0, 0, 0), (0, 3.1, 0)])
def test_a_constant_twist_is_interpolated_and_extrapolated_exactly(tmp_path, turn):
    """The oracle is SciPy's exponential of a matrix; lines are a second apart."""
    generator, begin = twist(turn, (5.0, -2.0, 0.4)), twist((0.2, 0.5, -0.9), (100, -30, 7))
    path = write(
        tmp_path / "a.tum", [0, 1, 2], [expm(begin) @ expm(generator * t) for t in range(3)]
    )
    times_s = np.array([0, 0.25, 0.999, 1, 1.5, 2, 2.75])
    rotations, positions_m = path.at(np.rint(times_s * 1e9).astype(np.int64))
    for time_s, R, p_m in zip(times_s, rotations, positions_m, strict=True):
        expected = expm(begin) @ expm(generator * time_s)
        # 17 digits of a quaternion make 1e-15 rad, over 100 m.
        np.testing.assert_allclose(R, expected[:3, :3], atol=1e-13)
        np.testing.assert_allclose(p_m, expected[:3, 3], atol=1e-11)


def test_a_single_pose_is_constant_and_earlier_times_are_rejected(tmp_path):
    pose = expm(twist((0.1, 0.2, 0.3), (1, 2, 3)))
    path = write(tmp_path / "a.tum", [5], [pose])
    np.testing.assert_allclose(path.pose_at(9 * 10**9), pose, atol=1e-15)
    with pytest.raises(
        Exception, match=r"a\.tum: the path begins at 5\.0 s, but 4\.0 s is requested"
    ):
        path.pose_at(4 * 10**9)
    path.pose_at(3605 * 10**9)
    with pytest.raises(
        Exception, match=r"a\.tum: the path ends at 5\.0 s, but 3606\.0 s is requested"
    ):
        path.pose_at(3606 * 10**9)
    rotations, positions_m = path.at(np.zeros(0, np.int64))
    assert rotations.shape == (0, 3, 3)
    assert positions_m.shape == (0, 3)


def test_poses_match_the_lines_of_the_file():
    for sensor in (*dataset().lidars, *dataset().cameras):
        file = dataset().path_file(sensor)
        table = np.loadtxt(file)
        path = SensorPath(file)
        rotations, positions_m = path.at(path.times_ns)
        np.testing.assert_array_equal(path.times_ns, np.rint(table[:, 0] * 1e9))
        np.testing.assert_allclose(positions_m, table[:, 1:4], atol=1e-11)
        expected = Rotation.from_quat(table[:, 4:]).as_matrix()
        np.testing.assert_allclose(rotations, expected, atol=1e-14)


def test_quaternions_match_scipy_at_any_angle():
    turns = Rotation.random(1000, rng=np.random.default_rng(4)).as_matrix()
    axes = np.eye(3)
    half_turns = [2 * np.outer(a, a) - np.eye(3) for a in (*axes, np.ones(3) / np.sqrt(3))]
    for R in (*turns, *half_turns, np.eye(3)):
        q = np.array(quaternion_wxyz(R))
        assert q[0] >= 0
        assert np.linalg.norm(q) == pytest.approx(1, abs=1e-15)
        np.testing.assert_allclose(Rotation.from_quat([*q[1:], q[0]]).as_matrix(), R, atol=1e-14)
