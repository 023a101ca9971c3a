"""The path of a sensor through D: poses at any time, interpolated as in the simulation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Error, nanoseconds_of
from groundray.file_content import read_text

Floats = NDArray[np.float64]
Times = NDArray[np.int64]

_LONGEST_NS = 3600 * 10**9  # limit of extrapolation, longer than any sweep


def _cross_matrices(v: Floats) -> Floats:
    x, y, z = np.moveaxis(v, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*v.shape[:-1], 3, 3)


def _rotations(q: Floats) -> Floats:
    """Converts unit quaternions x, y, z, w to matrices."""
    K = _cross_matrices(q[..., :3])
    return np.eye(3) + 2 * (q[..., 3, None, None] * K + K @ K)


def _rotation_vectors(q: Floats) -> Floats:
    """Converts unit quaternions to rotation vectors with angles up to pi."""
    q = np.where(q[..., 3:] < 0, -q, q)
    sine = np.linalg.norm(q[..., :3], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., 3:])
    return q[..., :3] * np.where(sine > 0, angle / np.where(sine > 0, sine, 1), 2.0)


def _exponentials(phi: Floats) -> tuple[Floats, Floats]:
    """Returns the rotation exp([phi]x) and the left Jacobian of SO(3), its mean along the way."""
    angle = np.linalg.norm(phi, axis=-1)[..., None, None]
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1 - angle**2 / 6, np.sin(safe) / safe)
    b = np.where(small, 0.5 - angle**2 / 24, 2 * (np.sin(safe / 2) / safe) ** 2)
    c = np.where(small, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    K = _cross_matrices(phi)
    return np.eye(3) + a * K + b * (K @ K), np.eye(3) + b * K + c * (K @ K)


def _quaternion_products(p: Floats, q: Floats) -> Floats:
    u, s = p[..., :3], p[..., 3:]
    v, t = q[..., :3], q[..., 3:]
    vector = s * v + t * u + np.cross(u, v)
    return np.concatenate([vector, s * t - np.sum(u * v, axis=-1, keepdims=True)], axis=-1)


class SensorPath:
    """Poses interpolated with constant twist between the lines of a TUM file."""

    def __init__(self, file: Path) -> None:
        """Reads the path. Raises Error if the file is invalid or its times do not increase."""
        self.file = file
        self.times_ns, self.positions_m, self.quaternions_xyzw = _read_tum(file)
        self.rotations = _rotations(self.quaternions_xyzw)
        q = self.quaternions_xyzw
        inverse = q[:-1] * [-1, -1, -1, 1]
        self._turns = _rotation_vectors(_quaternion_products(inverse, q[1:]))
        steps = np.diff(self.positions_m, axis=0)[..., None]
        moved = np.swapaxes(self.rotations[:-1], 1, 2) @ steps
        self._moves = np.linalg.solve(_exponentials(self._turns)[1], moved)[..., 0]

    def at(self, times_ns: Times) -> tuple[Floats, Floats]:
        """Returns rotations (n, 3, 3) and positions (n, 3) in D.

        Beyond its end the path continues with its last twist for up to an hour. Raises Error for
        times before its begin or after that hour.
        """
        if times_ns.size and times_ns.min() < self.times_ns[0]:
            first_s, asked_s = self.times_ns[0] * 1e-9, times_ns.min() * 1e-9
            rule = f"the path begins at {first_s} s, but {asked_s} s is requested"
            raise Error(f"{self.file}: {rule}")
        if times_ns.size and times_ns.max() - self.times_ns[-1] > _LONGEST_NS:
            last_s, asked_s = self.times_ns[-1] * 1e-9, times_ns.max() * 1e-9
            rule = f"the path ends at {last_s} s, but {asked_s} s is requested"
            raise Error(f"{self.file}: {rule}")
        if self.times_ns.size == 1:
            return self.rotations[[0] * times_ns.size], self.positions_m[[0] * times_ns.size]
        i = np.searchsorted(self.times_ns, times_ns, side="right") - 1
        i = np.minimum(i, self.times_ns.size - 2)
        share = (times_ns - self.times_ns[i]) / (self.times_ns[i + 1] - self.times_ns[i])
        turns, means = _exponentials(self._turns[i] * share[:, None])
        moves = means @ (self._moves[i] * share[:, None])[..., None]
        before = self.rotations[i]
        return before @ turns, self.positions_m[i] + (before @ moves)[..., 0]

    def pose_at(self, time_ns: int) -> Floats:
        """Returns the pose in D as a 4 x 4 matrix."""
        rotations, positions_m = self.at(np.array([time_ns], dtype=np.int64))
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = rotations[0], positions_m[0]
        return X


def quaternion_wxyz(R: Floats) -> tuple[float, float, float, float]:
    """Returns the unit quaternion of a rotation, w >= 0."""
    # The largest of the four components is at least 1/2.
    squares = [
        1 + R[0, 0] + R[1, 1] + R[2, 2],
        1 + R[0, 0] - R[1, 1] - R[2, 2],
        1 - R[0, 0] + R[1, 1] - R[2, 2],
        1 - R[0, 0] - R[1, 1] + R[2, 2],
    ]
    most = int(np.argmax(squares))
    rows = np.array(
        [
            [squares[0], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
            [R[2, 1] - R[1, 2], squares[1], R[1, 0] + R[0, 1], R[0, 2] + R[2, 0]],
            [R[0, 2] - R[2, 0], R[1, 0] + R[0, 1], squares[2], R[2, 1] + R[1, 2]],
            [R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2], squares[3]],
        ]
    )
    q = rows[most] / np.linalg.norm(rows[most])
    w, x, y, z = (float(value) for value in (q if q[0] >= 0 else -q))
    return w, x, y, z


def _read_tum(file: Path) -> tuple[Times, Floats, Floats]:
    times: list[int] = []
    values: list[list[float]] = []
    for number, line in enumerate(read_text(file).split("\n"), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        time_ns, pose = _read_pose(words, f"{file}:{number}")
        times.append(time_ns)
        values.append(pose)
    if not times:
        raise Error(f"{file}: it has no pose; is the dataset complete?")
    times_ns = np.array(times, dtype=np.int64)
    if np.any(np.diff(times_ns) <= 0):
        raise Error(f"{file}: its times do not increase; was it edited?")
    table = np.array(values)
    q = table[:, 3:] / np.linalg.norm(table[:, 3:], axis=1, keepdims=True)
    return times_ns, table[:, :3], q


def _read_pose(words: list[str], place: str) -> tuple[int, list[float]]:
    """Returns the time, ns, and position and quaternion."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != 8 or not np.all(np.isfinite(numbers)):
        rule = "a pose must be eight finite numbers: t x y z qx qy qz qw"
        raise Error(f"{place}: {rule}; was the file cut short?")
    if abs(np.linalg.norm(numbers[4:]) - 1) > 1e-6:
        rule = "the quaternion must have length 1"
        raise Error(f"{place}: {rule}; are its values in the order qx qy qz qw?")
    try:
        return nanoseconds_of(words[0]), numbers[1:]
    except ValueError as fault:
        raise Error(f"{place}: the time {words[0]} {fault}") from None
