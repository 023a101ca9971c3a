"""Clouds written by other libraries are read exactly.

The oracles are the arrays that NumPy and Open3D were given.
"""

import subprocess
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
POINTS = 500


def peer(name: str) -> ModuleType:
    reason = f"{name} is not installed: pip install -r test/requirements.txt"
    return pytest.importorskip(name, reason=reason)


def run(source: Path, *columns: str) -> subprocess.CompletedProcess:
    program = ROOT / "build/release/bin/convert_cloud"
    command = [program, source, source.with_suffix(".out.ply"), *columns]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def convert(source: Path, *columns: str) -> tuple[np.ndarray, dict[str, int], list[str]]:
    """Returns the rows, the offsets subtracted from columns, and the columns not read."""
    done = run(source, *columns)
    assert done.returncode == 0, done.stderr
    rows = peer("plyfile").PlyData.read(source.with_suffix(".out.ply"))["vertex"].data
    lines = [line.split(" ", 1) for line in done.stdout.splitlines()]
    origins = {name: int(value) for name, value in (r.split() for k, r in lines if k == "origin")}
    return rows, origins, [rest for kind, rest in lines if kind == "unread"]


def random_values(kind: str, shape: tuple[int, ...], seed: int = 7) -> np.ndarray:
    """Returns random bits of a type; for 64-bit integers, stamps within a second."""
    random = np.random.default_rng(seed)
    dtype = np.dtype(kind)
    if dtype.kind == "b":
        return random.integers(0, 2, shape).astype(dtype)
    if dtype.kind in "iu" and dtype.itemsize == 8:
        return (1_673_400_471_837_873_222 + random.integers(0, 10**9, shape)).astype(dtype)
    return np.frombuffer(random.bytes(int(np.prod(shape)) * dtype.itemsize), dtype).reshape(shape)


def expect_column(read: np.ndarray, origin: int, expected: np.ndarray) -> None:
    if expected.dtype.kind in "iu" and expected.dtype.itemsize == 8:
        np.testing.assert_array_equal(read.astype(np.int64) + origin, expected.astype(np.int64))
    elif expected.dtype == np.float16:
        np.testing.assert_array_equal(read, expected.astype(np.float32))
    elif expected.dtype.kind == "f":
        assert read.tobytes() == expected.astype(expected.dtype.newbyteorder("=")).tobytes()
    else:
        np.testing.assert_array_equal(read, expected)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize(
    "kind", ["<f2", "<f4", ">f4", "<f8", ">f8", "<i1", ">i2", "<i4", ">i8", "<u1", ">u2", "<u8"]
)
def test_plain_numpy_arrays_are_read(tmp_path: Path, kind: str, order: str) -> None:
    for columns in (3, 4, 5):
        values = random_values(kind, (POINTS, columns))
        np.save(tmp_path / "a.npy", np.asarray(values, order=order))
        names = ["x", "y", "z", "intensity", "ring"][:columns]
        rows, origins, _ = convert(tmp_path / "a.npy", *names)
        assert rows.dtype.names == tuple(names)
        for i, name in enumerate(names):
            expect_column(rows[name], origins.get(name, 0), values[:, i])


def test_an_array_of_rows_and_columns_of_points_is_read(tmp_path: Path) -> None:
    values = random_values("<f4", (16, 32, 3))
    for order in ("C", "F"):
        np.save(tmp_path / "a.npy", np.asarray(values, order=order))
        rows, _, _ = convert(tmp_path / "a.npy")
        for i, name in enumerate("xyz"):
            expect_column(rows[name], 0, values[..., i].ravel())


@pytest.mark.parametrize("align", [False, True])
def test_numpy_record_arrays_are_read(tmp_path: Path, align: bool) -> None:
    fields = [("x", "<f8"), ("ring", "u1"), ("y", ">f4"), ("z", "<f2"), ("t", ">u8"), ("hit", "?")]
    dtype = np.dtype([*fields, ("name", "<U5"), ("n", "<i2", (2, 3))], align=align)
    values = np.zeros(POINTS, dtype)
    for name, kind in fields:
        values[name] = random_values(kind, (POINTS,))
    values["n"] = random_values("<i2", (POINTS, 2, 3))
    np.save(tmp_path / "a.npy", values)
    rows, origins, unread = convert(tmp_path / "a.npy")
    for name, _ in fields:
        expect_column(rows[name], origins.get(name, 0), values[name])
    for i in range(6):
        np.testing.assert_array_equal(rows[f"n_{i}"], values["n"].reshape(POINTS, 6)[:, i])
    assert unread == ["name (no numbers)"]


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_numpy_archives_are_read(tmp_path: Path, save) -> None:
    arrays = {
        "xyz": random_values("<f4", (POINTS, 3)),
        "t": random_values("<i8", (POINTS,)),
        "ring": random_values("<u2", (POINTS,)),
        "normals": np.asfortranarray(random_values("<f8", (POINTS, 3), seed=8)),
    }
    save(tmp_path / "a.npz", pose=np.eye(4), sensor=np.array("top"), **arrays)
    rows, origins, unread = convert(tmp_path / "a.npz")
    assert rows.dtype.names == ("x", "y", "z", "t", "ring", "normals_0", "normals_1", "normals_2")
    for i, name in enumerate("xyz"):
        expect_column(rows[name], 0, arrays["xyz"][:, i])
        expect_column(rows[f"normals_{i}"], 0, arrays["normals"][:, i])
    expect_column(rows["t"], origins["t"], arrays["t"])
    expect_column(rows["ring"], 0, arrays["ring"])
    assert unread == ["pose (of 4 rows)", "sensor (it contains no numbers)"]


@pytest.mark.parametrize("form", ["ascii", "binary", "compressed"])
def test_pcd_files_of_open3d_are_read(tmp_path: Path, form: str) -> None:
    o3d = peer("open3d")
    random = np.random.default_rng(7)
    columns = {
        "positions": random.normal(size=(POINTS, 3)).astype(np.float32),
        "intensity": np.repeat(random.normal(size=(POINTS // 10, 1)), 10, axis=0),
        "ring": random.integers(0, 64, (POINTS, 1)).astype(np.uint16),
        "t": random.integers(0, 2**32, (POINTS, 1)).astype(np.uint32),
    }
    columns["positions"][:100] = 1  # runs that can be packed
    cloud = o3d.t.geometry.PointCloud()
    for name, values in columns.items():
        cloud.point[name] = o3d.core.Tensor(values)
    settings = {"write_ascii": form == "ascii", "compressed": form == "compressed"}
    assert o3d.t.io.write_point_cloud(str(tmp_path / "a.pcd"), cloud, **settings)
    rows, _, _ = convert(tmp_path / "a.pcd")
    relative = 1e-9 if form == "ascii" else 0  # Open3D writes 10 digits
    for i, name in enumerate("xyz"):
        np.testing.assert_allclose(rows[name], columns["positions"][:, i], rtol=relative)
    for name in ("intensity", "ring", "t"):
        np.testing.assert_allclose(rows[name], columns[name][:, 0], rtol=relative)
