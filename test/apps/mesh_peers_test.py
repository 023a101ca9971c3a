"""Other readers load groundray's terrain mesh in every format.

The oracle is numpy, given the layout that docs/reference/formats.md promises, and GDAL's own view
of the DEM.
"""

import json
import re
import subprocess
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/release/bin/groundray"
DEM = ROOT / "data/terrain/prairie_1m.tif"

FACE = np.dtype([("count", "u1"), ("vertices", "<u4", 3), ("level", "u1"), ("colour", "u1", 3)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("mesh")
    for form in ("ply", "obj", "stl", "glb"):
        command = [PROGRAM, "terrain", "mesh", DEM, "-o", out / f"mesh.{form}"]
        subprocess.run([*command, "--max-error-m", "0.5"], check=True, capture_output=True)
    return out


class Mesh:
    """The PLY file read by NumPy."""

    def __init__(self, path: Path) -> None:
        header, end, body = path.read_bytes().partition(b"end_header\n")
        assert end, "the header has no end"
        self.header = header.decode("ascii")
        assert self.header.startswith("ply\nformat binary_little_endian 1.0\n")
        vertices, faces = (
            int(re.search(rf"^element {name} (\d+)$", self.header, re.MULTILINE)[1])
            for name in ("vertex", "face")
        )
        assert len(body) == 24 * vertices + FACE.itemsize * faces
        self.vertices = np.frombuffer(body, "<f8", 3 * vertices).reshape(-1, 3)
        rows = np.frombuffer(body, FACE, offset=24 * vertices)
        assert (rows["count"] == 3).all()
        self.faces, self.levels = rows["vertices"], rows["level"]
        assert len(self.faces) > 100, "the mesh is too small to tell anything"

    def comment(self, key: str) -> str:
        """All lines of one key, joined."""
        lines = re.findall(rf"^comment {key} (.*)$", self.header, re.MULTILINE)
        assert lines, key
        return "".join(lines)


@pytest.fixture(scope="module")
def mesh(folder: Path) -> Mesh:
    return Mesh(folder / "mesh.ply")


def peer(name: str) -> ModuleType:
    reason = f"{name} is not installed: pip install -r test/requirements.txt"
    return pytest.importorskip(name, reason=reason)


def test_vertices_are_the_samples_that_gdal_reads(mesh: Mesh, tmp_path: Path) -> None:
    raw = tmp_path / "dem.bin"
    subprocess.run(["gdal_translate", "-q", "-of", "ENVI", "-ot", "Float32", DEM, raw], check=True)
    said = json.loads(subprocess.run(["gdalinfo", "-json", DEM], capture_output=True).stdout)
    columns, rows = said["size"]
    x0, dx, _, y0, _, dy = said["geoTransform"]
    heights = np.fromfile(raw, "<f4").reshape(rows, columns)
    in_crs = mesh.vertices + np.array(mesh.comment("origin_w").split(), float)
    column = (in_crs[:, 0] - x0) / dx - 0.5
    row = (in_crs[:, 1] - y0) / dy - 0.5
    # An ulp at a northing of 5e6 m is 1e-9 m, and cells are 1 m wide.
    np.testing.assert_allclose(column, np.rint(column), atol=1e-8)
    np.testing.assert_allclose(row, np.rint(row), atol=1e-8)
    expected = heights[np.rint(row).astype(int), np.rint(column).astype(int)]
    np.testing.assert_array_equal(mesh.vertices[:, 2], expected)
    assert "EPSG:26915" in mesh.comment("crs")
    assert 'ID["EPSG",26915]' in mesh.comment("crs_wkt")


def test_triangles_face_up_and_cover_the_dem_once(mesh: Mesh) -> None:
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    up = np.cross(b - a, c - a)[:, 2]
    assert (up > 0).all()
    extent = np.ptp(mesh.vertices, axis=0)
    assert up.sum() / 2 == pytest.approx(extent[0] * extent[1], rel=1e-12)
    assert (np.diff(mesh.levels.astype(int)) >= 0).all()


def test_plyfile_reads_the_ply(folder: Path, mesh: Mesh) -> None:
    ply = peer("plyfile").PlyData.read(folder / "mesh.ply")
    vertices = np.column_stack([ply["vertex"][name] for name in "xyz"])
    np.testing.assert_array_equal(vertices, mesh.vertices)
    np.testing.assert_array_equal(np.vstack(ply["face"]["vertex_indices"]), mesh.faces)
    np.testing.assert_array_equal(ply["face"]["level"], mesh.levels)


@pytest.mark.parametrize("form", ["ply", "obj"])
def test_trimesh_reads_every_double_and_triangle(folder: Path, mesh: Mesh, form: str) -> None:
    path = folder / f"mesh.{form}"
    read = peer("trimesh").load(path, process=False, maintain_order=True)
    np.testing.assert_array_equal(read.vertices, mesh.vertices)
    np.testing.assert_array_equal(read.faces, mesh.faces)


def test_open3d_reads_the_ply(folder: Path, mesh: Mesh) -> None:
    read = peer("open3d").io.read_triangle_mesh(str(folder / "mesh.ply"))
    np.testing.assert_array_equal(np.asarray(read.vertices), mesh.vertices)
    np.testing.assert_array_equal(np.asarray(read.triangles), mesh.faces)


def test_open3d_reads_the_obj(folder: Path, mesh: Mesh) -> None:
    read = peer("open3d").io.read_triangle_mesh(str(folder / "mesh.obj"))
    corners = np.asarray(read.vertices)[np.asarray(read.triangles)]  # it numbers vertices anew
    # It reads floats: half an ulp at 400 m.
    np.testing.assert_allclose(corners, mesh.vertices[mesh.faces], rtol=0, atol=2e-5)


@pytest.mark.parametrize("reader", ["trimesh", "open3d"])
def test_peers_read_the_stl(folder: Path, mesh: Mesh, reader: str) -> None:
    path = folder / "mesh.stl"
    if reader == "trimesh":
        read = peer("trimesh").load(path, process=False)
        corners = np.asarray(read.vertices)[np.asarray(read.faces)]
    else:
        read = peer("open3d").io.read_triangle_mesh(str(path))
        corners = np.asarray(read.vertices)[np.asarray(read.triangles)]
    np.testing.assert_array_equal(corners, mesh.vertices[mesh.faces].astype(np.float32))
    header = path.read_bytes()[:80].decode("ascii")
    assert header.rstrip() == "origin_w " + mesh.comment("origin_w")


def test_trimesh_reads_the_glb(folder: Path, mesh: Mesh) -> None:
    scene = peer("trimesh").load(folder / "mesh.glb", process=False)
    (node,) = scene.graph.nodes_geometry
    to_gltf, name = scene.graph[node]
    read = scene.geometry[name]
    np.testing.assert_array_equal(read.vertices, mesh.vertices.astype(np.float32))
    np.testing.assert_array_equal(read.faces, mesh.faces)
    # D's east, north and up are glTF's x, -z and y.
    np.testing.assert_array_equal(to_gltf @ [1, 2, 3, 1], [1, 3, -2, 1])
    assert scene.metadata["origin_w_m"] == [float(x) for x in mesh.comment("origin_w").split()]
    assert scene.metadata["crs_name"] == mesh.comment("crs")


def test_open3d_reads_the_glb(folder: Path, mesh: Mesh) -> None:
    read = peer("open3d").io.read_triangle_mesh(str(folder / "mesh.glb"))
    corners = np.asarray(read.vertices)[np.asarray(read.triangles)]  # it numbers vertices anew
    x, y, z = np.moveaxis(mesh.vertices[mesh.faces].astype(np.float32), -1, 0)
    np.testing.assert_array_equal(corners, np.stack([x, z, -y], axis=-1))
