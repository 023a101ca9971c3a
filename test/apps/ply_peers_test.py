"""Other PLY readers load every column of a scan as groundray wrote it.

The oracle is numpy, given the layout that docs/reference/formats.md promises.
"""

import subprocess
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

COLUMNS = np.dtype(
    [(name, "<f4") for name in ("x", "y", "z", "intensity", "time")]
    + [("ring", "<u2"), ("return_index", "u1"), ("return_count", "u1")]
    + [(name, "<f8") for name in ("world_x", "world_y", "world_z", "range_true")]
    + [(name, "<f4") for name in ("nx", "ny", "nz", "incidence")]
    + [("label", "<u2"), ("instance", "<u4"), ("error_estimate", "<f4")]
)


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = Path(__file__).resolve().parents[2]
    out = tmp_path_factory.mktemp("scan") / "out"
    program = root / "build/release/bin/groundray"
    scene = root / "data/scenes/first_light.yaml"
    subprocess.run([program, "generate", scene, "-o", out], check=True, capture_output=True)
    return out / "lidar/top/000000.ply"


@pytest.fixture(scope="module")
def table(sample: Path) -> np.ndarray:
    header, end, body = sample.read_bytes().partition(b"end_header\n")
    assert end, "the header has no end"
    assert header.startswith(b"ply\nformat binary_little_endian 1.0\n")
    rows = np.frombuffer(body, COLUMNS)
    assert len(rows) > 0, "the scan has no row, so that nothing is tested"
    return rows


def peer(name: str) -> ModuleType:
    reason = f"{name} is not installed: pip install -r test/requirements.txt"
    return pytest.importorskip(name, reason=reason)


def test_plyfile_reads_every_column(sample: Path, table: np.ndarray) -> None:
    ply = peer("plyfile").PlyData.read(sample)
    assert any(comment.startswith("origin_w ") for comment in ply.comments)
    vertex = ply["vertex"].data
    assert vertex.dtype.names == table.dtype.names
    for name in table.dtype.names:
        assert vertex.dtype[name] == table.dtype[name], name
        np.testing.assert_array_equal(vertex[name], table[name], name)


def test_trimesh_reads_every_column(sample: Path, table: np.ndarray) -> None:
    cloud = peer("trimesh").load(sample, process=False)
    positions = np.column_stack([table[name] for name in "xyz"])
    np.testing.assert_array_equal(cloud.vertices, positions)
    raw = cloud.metadata["_ply_raw"]["vertex"]["data"]
    for name in table.dtype.names:
        np.testing.assert_array_equal(np.ravel(raw[name]), table[name], name)


def test_open3d_reads_every_column_of_a_supported_type(sample: Path, table: np.ndarray) -> None:
    cloud = peer("open3d").t.io.read_point_cloud(str(sample))
    columns = {name: cloud.point[name].numpy() for name in cloud.point}
    seen = dict(zip(("x", "y", "z"), columns.pop("positions").T, strict=True))
    seen |= dict(zip(("nx", "ny", "nz"), columns.pop("normals").T, strict=True))
    seen |= {name: values[:, 0] for name, values in columns.items()}
    # Open3D 0.20 leaves out ushort and uint, with a warning.
    unknown = {"ring", "label", "instance"}
    assert set(seen) | unknown == set(table.dtype.names)
    for name, values in seen.items():
        np.testing.assert_array_equal(values, table[name], name)
