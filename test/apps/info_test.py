"""`groundray info` of meshes, clouds and images, compared with other software."""

import re

import cv2
import numpy as np
import OpenEXR
import pytest
import trimesh
from dataset_runs import groundray
from plyfile import PlyData, PlyElement


def facts(file):
    """Returns the lines of a description by their names."""
    result = groundray("info", file)
    assert result.returncode == 0, result.stderr
    assert not result.stderr
    lines = {}
    for line in result.stdout.splitlines():
        lines.setdefault(line[:10].strip(), []).append(line[10:])
    return lines


def numbers(text):
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?", text)]


def refused(file, *words):
    result = groundray("info", file)
    assert result.returncode == 1, result
    assert len(result.stderr.splitlines()) == 1
    for word in words:
        assert word in result.stderr


@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "glb"])
def test_a_closed_mesh_is_described_as_by_trimesh(tmp_path, ending):
    mesh = trimesh.creation.torus(2, 0.5)
    file = tmp_path / f"ring.{ending}"
    mesh.export(file)
    found = facts(file)
    assert found["kind"] == [f"mesh, {ending}"]
    assert numbers(found["triangles"][0]) == [len(mesh.faces), len(mesh.vertices)]
    # Six digits are printed; STL and glTF round to floats.
    assert numbers(found["area"][0])[0] == pytest.approx(mesh.area, rel=1e-5)
    assert found["surface"][0].startswith("closed, volume ")
    assert numbers(found["surface"][0])[0] == pytest.approx(mesh.volume, rel=1e-5)
    assert sorted(numbers(found["size"][0])) == pytest.approx(sorted(mesh.extents), rel=1e-5)


def test_boundaries_of_an_open_mesh_are_counted(tmp_path):
    mesh = trimesh.creation.box()
    mesh.update_faces(np.arange(len(mesh.faces)) != 3)
    mesh.export(tmp_path / "open.ply")
    text = facts(tmp_path / "open.ply")["surface"][0]
    assert text == "not closed: 3 boundary edges, 0 of three triangles or more"


def test_edges_of_three_triangles_and_of_opposite_orientation_are_counted(tmp_path):
    fan = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"
    (tmp_path / "fan.obj").write_text(fan)
    assert "6 boundary edges, 1 of three" in facts(tmp_path / "fan.obj")["surface"][0]
    (tmp_path / "twist.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nf 1 2 3\nf 1 2 4\n")
    text = facts(tmp_path / "twist.obj")["surface"][0]
    assert "4 boundary edges, 0 of three" in text
    assert "1 between triangles of opposite orientation" in text


def test_surfaces_and_images_of_a_mesh_are_listed(tmp_path):
    cv2.imwrite(str(tmp_path / "bark.png"), np.zeros((2, 2, 3), np.uint8))
    (tmp_path / "tree.mtl").write_text("newmtl bark\nmap_Kd bark.png\n")
    (tmp_path / "tree.obj").write_text(
        "mtllib tree.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
        "usemtl bark\nf 1/1 2/2 3/3\n"
    )
    found = facts(tmp_path / "tree.obj")
    assert found["model"] == ["with uv, no normals"]
    assert "bark, albedo: bark.png" in found["surface"]
    (tmp_path / "bark.png").unlink()
    found = facts(tmp_path / "tree.obj")
    assert found["model"][0].startswith("a scene cannot use it: ")
    assert "bark.png" in found["model"][0]


@pytest.fixture
def points():
    random = np.random.default_rng(5)
    rows = np.zeros(
        50,
        [(name, "f4") for name in ("x", "y", "z", "intensity", "time")]
        + [("ring", "u2"), ("label", "u2")],
    )
    for name in ("x", "y", "z", "intensity"):
        rows[name] = random.uniform(-8, 8, 50)
    rows["time"] = np.linspace(0, 0.1, 50)
    rows["ring"] = np.arange(50) % 4
    rows["label"] = np.arange(50) % 3
    return rows


def test_a_cloud_is_described_by_its_columns(tmp_path, points):
    PlyData([PlyElement.describe(points, "vertex")]).write(tmp_path / "cloud.ply")
    found = facts(tmp_path / "cloud.ply")
    assert found["points"] == ["50, of which 50 have a position"]
    assert [line.split(",")[0] for line in found["column"]] == list(points.dtype.names)
    for line, name in zip(found["column"], points.dtype.names, strict=True):
        expected = [float(points[name].min()), float(points[name].max())]
        assert numbers(line.split(", ", 2)[2])[:2] == pytest.approx(expected, rel=1e-6)
    place = np.stack([points[name].astype(float) for name in "xyz"], axis=1)
    expected = [*place.min(axis=0), *place.max(axis=0)]
    assert numbers(found["bounds"][0])[:6] == pytest.approx(expected, rel=1e-6)
    ranges = np.linalg.norm(place, axis=1)
    assert numbers(found["ranges"][0]) == pytest.approx([ranges.min(), ranges.max()], rel=1e-6)
    assert numbers(found["times"][0]) == pytest.approx([0, 0.1], rel=1e-6)
    assert found["rings"] == ["4 different"]
    assert found["labels"] == ["3 different"]


def test_arrays_and_files_of_floats_are_clouds(tmp_path, points):
    array = np.stack([points[name] for name in ("x", "y", "z", "intensity")], axis=1)
    array[7, :3] = np.nan
    np.save(tmp_path / "cloud.npy", array)
    np.savez(tmp_path / "cloud.npz", xyz=array[:, :3])
    array.tofile(tmp_path / "cloud.bin")
    for name in ("cloud.npy", "cloud.npz", "cloud.bin"):
        found = facts(tmp_path / name)
        assert found["points"] == ["50, of which 49 have a position"], name
        assert "1 NaN" in found["others"][0]
        assert found["column"][0].endswith("1 not finite")


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_png_is_described_by_its_stored_values(tmp_path, dtype):
    most = np.iinfo(dtype).max
    picture = np.random.default_rng(3).integers(1, most - 1, (6, 9, 3)).astype(dtype)
    cv2.imwrite(str(tmp_path / "picture.png"), picture)
    found = facts(tmp_path / "picture.png")
    assert found["kind"] == [f"image, PNG of {picture.itemsize * 8} bits"]
    assert found["size"] == ["9 x 6 px"]
    for line, name, values in zip(
        found["channel"], "RGB", np.moveaxis(picture, 2, 0)[::-1], strict=True
    ):
        assert line == f"{name}: {values.min()} to {values.max()}"


def test_a_png_that_a_world_file_places_is_a_dem_too(tmp_path):
    heights = np.arange(80 * 100, dtype=np.uint16).reshape(80, 100)
    cv2.imwrite(str(tmp_path / "dem.png"), heights)
    (tmp_path / "dem.wld").write_text("2\n0\n0\n-2\n500000\n4000000\n")
    found = facts(tmp_path / "dem.png")
    assert found["kind"] == ["image, PNG of 16 bits"]
    assert found["heights"] == ["0.000 to 7999.000 m"]
    assert found["cell"] == ["2 x 2 m"]


def test_an_exr_is_described_by_its_channels(tmp_path):
    depth = np.random.default_rng(4).uniform(1, 90, (4, 5)).astype(np.float32)
    depth[0, 0] = np.inf
    label = np.arange(20, dtype=np.uint32).reshape(4, 5)
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"Z": depth, "label": label}).write(
        str(tmp_path / "truth.exr")
    )
    found = facts(tmp_path / "truth.exr")
    assert found["size"] == ["5 x 4 px"]
    assert "label: 0 to 19" in found["channel"]
    line = next(line for line in found["channel"] if line.startswith("Z: "))
    finite = depth[np.isfinite(depth)]
    assert numbers(line)[:2] == pytest.approx([finite.min(), finite.max()], rel=1e-5)
    assert line.endswith("1 not finite")


def test_what_is_not_read_is_named_with_what_reads_it(tmp_path):
    for name, words in {
        "scan.e57": ("E57 is not read",),
    }.items():
        (tmp_path / name).write_bytes(b"x")
        refused(tmp_path / name, name, *words)


@pytest.mark.parametrize("name", ["cut.ply", "cut.obj", "cut.pcd", "cut.npy", "cut.png", "cut.exr"])
def test_a_damaged_file_gives_one_message(tmp_path, name):
    (tmp_path / name).write_bytes(b"ply\n\0\xff")
    refused(tmp_path / name, name)
