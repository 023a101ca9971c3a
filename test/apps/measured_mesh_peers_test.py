"""Meshes are exchanged between groundray and other readers and writers in every format.

The oracle is numpy: a ball with a value for each vertex, near D's origin or in UTM itself.
"""

import subprocess
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/release/bin/convert_mesh"
FORMS = ["ply", "obj", "stl", "glb"]


def peer(name: str) -> ModuleType:
    reason = f"{name} is not installed: pip install -r test/requirements.txt"
    return pytest.importorskip(name, reason=reason)


@pytest.fixture(scope="module")
def program() -> Path:
    if not PROGRAM.exists():
        pytest.skip(f"{PROGRAM} is not built")
    return PROGRAM


def convert(program: Path, source: Path, to: Path) -> str:
    return subprocess.run([program, source, to], check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="module")
def ball() -> tuple[np.ndarray, np.ndarray]:
    """642 vertices and 1280 triangles, which have no symmetry."""
    made = peer("trimesh").creation.icosphere(3, 10)
    vertices = np.array(made.vertices)
    vertices *= 1 + 0.1 * np.random.default_rng(3).random((len(vertices), 1))
    return vertices, np.array(made.faces)


def write_ply(path: Path, vertices: np.ndarray, faces: np.ndarray, *comments: str) -> np.ndarray:
    """Writes doubles, with columns of other types than ours; returns the rows."""
    plyfile = peer("plyfile")
    columns = [("label", "u1"), ("x", "f8"), ("y", "f8"), ("z", "f8")]
    columns += [("confidence", "f8"), ("sd_m", "f4"), ("colour", "i4")]
    rows = np.zeros(len(vertices), columns)
    for name, values in zip("xyz", vertices.T, strict=True):
        rows[name] = values
    rng = np.random.default_rng(4)
    rows["label"] = rng.integers(0, 256, len(rows))
    rows["confidence"] = rng.integers(0, 257, len(rows)) / 256
    rows["sd_m"] = rng.random(len(rows))
    triangles = np.empty(len(faces), [("vertex_indices", "i4", 3)])
    triangles["vertex_indices"] = faces
    elements = [plyfile.PlyElement.describe(rows, "vertex")]
    elements.append(plyfile.PlyElement.describe(triangles, "face"))
    plyfile.PlyData(elements, byte_order=">", comments=comments).write(path)
    return rows


def origin_of(path: Path) -> np.ndarray:
    """D's origin as stored in each format."""
    head = path.read_bytes()[:4096].decode("latin-1")
    if path.suffix == ".glb":
        words = head.split('"origin_w_m":[')[1].split("]")[0].split(",")
    else:
        words = head.split("origin_w ")[1].split()[:3]
    return np.array(words, float)


def corners_of(path: Path, reader: str) -> np.ndarray:
    """Returns triangles as read by a peer, in D."""
    if reader == "trimesh":
        loaded = peer("trimesh").load(path, process=False)
        mesh = loaded.to_mesh() if path.suffix == ".glb" else loaded
        corners = np.asarray(mesh.vertices)[np.asarray(mesh.faces)]
    else:
        mesh = peer("open3d").io.read_triangle_mesh(str(path))
        corners = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]
    if path.suffix == ".glb":
        x, y, z = np.moveaxis(corners, -1, 0)
        corners = np.stack([x, -z, y], axis=-1)
    return corners


@pytest.mark.parametrize("reader", ["trimesh", "open3d"])
@pytest.mark.parametrize("form", FORMS)
def test_peers_read_millimetres_of_large_coordinates(program, ball, tmp_path, form, reader):
    vertices, faces = ball
    at = np.array([435000.1, 5150500.7, 312.3])
    places = {"near": (vertices, at), "far": (vertices + at, np.zeros(3))}
    for name, (placed, origin) in places.items():
        source = tmp_path / f"{name}.ply"
        write_ply(source, placed, faces, "origin_w " + " ".join(map(str, origin)))
        written = tmp_path / f"{name}_written.{form}"
        assert convert(program, source, written) == "dropped 0\nskipped 0\n"
        corners = corners_of(written, reader) + origin_of(written)
        # Floats hold 312 m to 1.5e-5 m. Open3D reads an OBJ into floats: half a metre at 5e6 m.
        atol = 0.5 if (form, reader, name) == ("obj", "open3d", "far") else 3e-5
        np.testing.assert_allclose(corners, vertices[faces] + at, rtol=0, atol=atol)


def test_ply_columns_are_kept(program, ball, tmp_path):
    vertices, faces = ball
    rows = write_ply(tmp_path / "a.ply", vertices, faces, "made by hand", "origin_w 1 2 3")
    convert(program, tmp_path / "a.ply", tmp_path / "b.ply")
    ply = peer("plyfile").PlyData.read(tmp_path / "b.ply")
    kept = ply["vertex"].data
    assert kept.dtype.names == ("x", "y", "z", "sd_m", "label", "confidence")
    for name, kind in {
        "x": "f8",
        "z": "f8",
        "sd_m": "f4",
        "label": "u2",
        "confidence": "f4",
    }.items():
        assert kept.dtype[name] == np.dtype(kind), name
        np.testing.assert_array_equal(kept[name], rows[name])
    np.testing.assert_array_equal(np.vstack(ply["face"]["vertex_indices"]), faces)
    np.testing.assert_array_equal(origin_of(tmp_path / "b.ply"), [1, 2, 3])


@pytest.mark.parametrize("writer", ["trimesh", "open3d"])
@pytest.mark.parametrize("form", [*FORMS, "gltf"])
def test_meshes_written_by_peers_are_read_as_one_surface(program, ball, tmp_path, form, writer):
    vertices, faces = ball
    path = tmp_path / f"theirs.{form}"
    trimesh = peer("trimesh")
    if writer == "trimesh":
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        # Normals at the vertices, and none shared: what is at one place is to be joined.
        mesh.unmerge_vertices()
        if form == "gltf":
            for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh)).items():
                (tmp_path / ("theirs.gltf" if name.endswith(".gltf") else name)).write_bytes(data)
        else:
            mesh.export(path)
    else:
        open3d = peer("open3d")
        mesh = open3d.geometry.TriangleMesh(
            open3d.utility.Vector3dVector(vertices), open3d.utility.Vector3iVector(faces)
        )
        mesh.compute_vertex_normals()
        assert open3d.io.write_triangle_mesh(str(path), mesh)
    if form == "ply" and writer == "trimesh":
        convert(program, path, tmp_path / "joined.stl")  # a .ply is read as stored
        path = tmp_path / "joined.stl"
    convert(program, path, tmp_path / "ours.ply")
    ours = peer("plyfile").PlyData.read(tmp_path / "ours.ply")
    read = np.column_stack([ours["vertex"][name] for name in "xyz"])
    triangles = np.vstack(ours["face"]["vertex_indices"])
    assert (len(read), len(triangles)) == (len(vertices), len(faces))
    expected = vertices[faces]
    if form in ("glb", "gltf"):  # their z is glTF's: D's y is the other way
        expected = np.stack([expected[..., 0], -expected[..., 2], expected[..., 1]], axis=-1)
    # Open3D writes 6 digits of text; floats hold 11 m to 1e-6 m, and trimesh writes 8 digits.
    atol = 6e-5 if (form, writer) == ("obj", "open3d") else 1e-6
    np.testing.assert_allclose(read[triangles], expected, rtol=0, atol=atol)
    assert trimesh.Trimesh(read, triangles, process=False).is_watertight


@pytest.mark.parametrize("form", FORMS)
def test_a_truncated_mesh_file_is_rejected(program, ball, tmp_path, form):
    vertices, faces = ball
    write_ply(tmp_path / "a.ply", vertices, faces)
    whole, cut = tmp_path / f"b.{form}", tmp_path / f"cut.{form}"
    convert(program, tmp_path / "a.ply", whole)
    size = whole.stat().st_size
    cut.write_bytes(whole.read_bytes()[: size // 3])
    result = subprocess.run([program, cut, tmp_path / "c.ply"], capture_output=True, text=True)
    assert result.returncode == 1
    assert f"cut.{form}" in result.stderr
    assert len(result.stderr.splitlines()) <= 2
    assert not (tmp_path / "c.ply").exists()
