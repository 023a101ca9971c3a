"""`groundray reconstruct` as a user meets it: meshes from datasets and from other people's scans.

The oracles: what a scan without noise says of the truth, numpy on the poses, Open3D's rays and
triangles, and for the closed loop the scene itself, with other people's meshes of the same points.
"""

import gzip
import json
import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
from plyfile import PlyData, PlyElement

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/release/bin/groundray"
PRAIRIE = ROOT / "data/terrain/prairie_1m.tif"
sys.path.insert(0, str(ROOT / "test/benchmark"))

SCENE = f"""\
groundray: 1
seed: 7
duration_s: 0.3
terrain: {{dem: {PRAIRIE}}}
platform:
  drive:
    waypoints_m: [[429440, 5150660], [429448, 5150668], [429456, 5150671], [429470, 5150676]]
    speed_m_s: 10
    height_m: 0.5
lidars:
  - {{name: top, preset: velodyne_vlp16, mount: {{translation_m: [0, 0, 1.5], pitch_deg: 3}}}}
  - name: rear
    preset: velodyne_vlp32c
    mount: {{translation_m: [-1, 0, 1.5], yaw_deg: 90}}
    points: at_stamp
"""
FLOAT_M = 1e-4  # what docs/reference/formats.md says of x, y, z as floats, at its poses


def groundray(*arguments, **options):
    return subprocess.run(
        [PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=600, **options
    )


def reconstruct(*arguments, **options):
    result = groundray("reconstruct", *arguments, **options)
    assert result.returncode == 0, result.stderr
    return result.stdout


def refused(*arguments, words):
    """Checks for one message that contains all words, and no new file."""
    out = Path(arguments[arguments.index("-o") + 1])
    before = sorted(out.parent.iterdir()) if out.parent.is_dir() else []
    result = groundray("reconstruct", *arguments)
    assert result.returncode == 1, result
    message = result.stderr.splitlines()[-1]
    assert message.startswith("groundray: "), result.stderr
    for word in words:
        assert word in result.stderr, result.stderr
    assert before == (sorted(out.parent.iterdir()) if out.parent.is_dir() else [])
    return True


class Mesh:
    """A PLY file read by plyfile."""

    def __init__(self, path: Path) -> None:
        self.ply = PlyData.read(path)
        self.vertex = self.ply["vertex"].data
        self.p = np.stack([self.vertex[axis] for axis in "xyz"], axis=1)
        faces = self.ply["face"].data["vertex_indices"]
        self.faces = np.stack(faces) if len(faces) else np.empty((0, 3), int)

    def comment(self, key: str) -> str:
        return "".join(c[len(key) + 1 :] for c in self.ply.comments if c.startswith(key + " "))

    def area(self) -> float:
        a, b, c = (self.p[self.faces[:, k]] for k in range(3))
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    def edge_counts(self) -> np.ndarray:
        """Returns the number of triangles of each directed edge."""
        edges = np.concatenate([self.faces[:, [k, (k + 1) % 3]] for k in range(3)])
        return np.unique(edges, axis=0, return_counts=True)[1]


def write_mesh(path: Path, p: np.ndarray, faces: np.ndarray) -> Path:
    vertex = np.rec.fromarrays(p.T.astype("f8"), names="x,y,z")
    face = np.empty(len(faces), dtype=[("vertex_indices", "i4", (3,))])
    face["vertex_indices"] = faces
    PlyData(
        [PlyElement.describe(vertex, "vertex"), PlyElement.describe(face, "face")], byte_order="<"
    ).write(path)
    return path


def rotated(q: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Turns p by the quaternion (x, y, z, w)."""
    t = 2 * np.cross(q[:3], p)
    return p + q[3] * t + np.cross(q[:3], t)


def scan_of(dataset: Path, lidar: str, frame: int) -> np.ndarray:
    return PlyData.read(dataset / f"lidar/{lidar}/{frame:06}.ply")["vertex"].data


def world(scan: np.ndarray) -> np.ndarray:
    return np.stack([scan[f"world_{axis}"] for axis in "xyz"], axis=1)


def distances_from(points: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Returns the distance of each of p to the nearest point."""
    tree = o3d.geometry.KDTreeFlann(o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)))
    return np.array([np.sqrt(tree.search_knn_vector_3d(q, 1)[2][0]) for q in p])


def farthest_from(points: np.ndarray, p: np.ndarray) -> float:
    return distances_from(points, p).max()


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dataset")
    (folder / "scene.yaml").write_text(SCENE)
    result = groundray("generate", folder / "scene.yaml", "-o", folder / "out")
    assert result.returncode == 0, result.stderr
    return folder / "out"


@pytest.fixture(scope="module")
def terrain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The prairie's DEM as a mesh: a height field of some 10^4 triangles."""
    path = tmp_path_factory.mktemp("terrain") / "terrain.ply"
    result = groundray("terrain", "mesh", PRAIRIE, "-o", path, "--max-error-m", "0.2")
    assert result.returncode == 0, result.stderr
    return path


@pytest.mark.parametrize("lidar", ["top", "rear"])
def test_vertices_match_the_truth_without_noise(dataset, tmp_path, lidar):
    out = tmp_path / "mesh.ply"
    reconstruct("mesh", dataset, "--sensor", lidar, "--frames", "1", "-o", out)
    mesh = Mesh(out)
    assert len(mesh.faces) > 5000
    assert farthest_from(world(scan_of(dataset, lidar, 1)), mesh.p[::7]) < FLOAT_M
    assert mesh.edge_counts().max() == 1, "some edge is wound twice the same way"
    assert set(mesh.vertex["label"]) == set(scan_of(dataset, lidar, 1)["label"])
    assert (mesh.vertex["sd_m"] == 0).all()
    assert ((mesh.vertex["confidence"] > 0) & (mesh.vertex["confidence"] <= 1)).all()


def test_mesh_keeps_the_datasets_origin_and_crs(dataset, tmp_path):
    out = tmp_path / "mesh.ply"
    reconstruct("mesh", dataset, "--sensor", "top", "--frames", "0", "-o", out)
    scan = PlyData.read(dataset / "lidar/top/000000.ply")
    mesh = Mesh(out)
    assert "origin_w " + mesh.comment("origin_w") in scan.comments
    assert "UTM zone 15N" in mesh.comment("crs")
    assert mesh.comment("crs_wkt").startswith("PROJCRS")


def test_triangles_face_the_sensor_and_lie_on_the_ground(dataset, tmp_path):
    """The DEM at full resolution is the truth; all incidences are within the limit."""
    out, dem = tmp_path / "mesh.ply", tmp_path / "dem.ply"
    reconstruct("mesh", dataset, "--sensor", "rear", "--frames", "0", "-o", out)
    groundray("terrain", "mesh", PRAIRIE, "-o", dem, "--max-error-m", "0")
    mesh, truth = Mesh(out), Mesh(dem)
    sensor = np.loadtxt(dataset / "poses/rear.tum")[0, 1:4]
    a, b, c = (mesh.p[mesh.faces[:, k]] for k in range(3))
    middle = (a + b + c) / 3
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), sensor - middle) > 0).all()
    # The two files have origins of their own.
    to_d = np.array(list(map(float, truth.comment("origin_w").split()))) - np.array(
        list(map(float, mesh.comment("origin_w").split()))
    )
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles((truth.p + to_d).astype(np.float32), truth.faces.astype(np.uint32))
    near = np.linalg.norm(middle - sensor, axis=1) < 15
    distance = scene.compute_distance(middle[near].astype(np.float32)).numpy()
    assert near.sum() > 1000
    assert np.percentile(distance, 95) < 0.05


def test_scans_merge_to_one_manifold_surface(dataset, tmp_path):
    out, report = tmp_path / "mesh.ply", tmp_path / "report.json"
    said = reconstruct("mesh", dataset, "-o", out, "--report", report)
    mesh, figures = Mesh(out), json.loads(report.read_text())
    assert mesh.edge_counts().max() == 1
    assert [scan["name"] for scan in figures["scans"]] == [
        f"{lidar}/{frame:06}" for lidar in ("top", "rear") for frame in range(3)
    ]
    accepted = sum(scan["accepted_faces"] for scan in figures["scans"])
    assert figures["mesh"]["triangles"] == len(mesh.faces) < accepted
    assert figures["mesh"]["vertices"] == len(mesh.p)
    assert figures["mesh"]["area_m2"] == pytest.approx(mesh.area(), rel=1e-9)
    assert figures["merged"]["redundant"] > 0
    assert str(len(mesh.faces)) in said
    for scan in figures["scans"]:
        lidar, frame = scan["name"].split("/")
        rows = len(scan_of(dataset, lidar, int(frame)))
        assert scan["rows"] == rows
        left_out = scan["no_returns"] + scan["other_returns"] + scan["crowded"]
        assert scan["used"] + left_out == rows


def test_frames_and_sensors_are_selected(dataset, tmp_path):
    def names(*choice):
        report = tmp_path / "report.json"
        reconstruct("mesh", dataset, "-o", tmp_path / "mesh.ply", "--report", report, *choice)
        return [scan["name"] for scan in json.loads(report.read_text())["scans"]]

    assert names("--sensor", "rear", "--frames", "::2") == ["rear/000000", "rear/000002"]
    assert names("--sensor", "top", "--frames", "1:") == ["top/000001", "top/000002"]
    assert names("--frames", "2") == ["top/000002", "rear/000002"]


def test_occlusion_faces_are_exactly_the_rejected_triangles(dataset, tmp_path):
    out, occlusion, report = (tmp_path / name for name in ("m.ply", "o.ply", "r.json"))
    chosen = ["--sensor", "top", "--frames", "0:2"]
    command = ["mesh", dataset, *chosen, "-o", out, "--occlusion", occlusion, "--report", report]
    reconstruct(*command)
    faces = Mesh(occlusion)
    figures = json.loads(report.read_text())
    assert len(faces.faces) == sum(scan["rejected_faces"] for scan in figures["scans"]) > 0
    origins = np.stack([faces.vertex[f"origin_{axis}"] for axis in "xyz"], axis=1)
    poses = np.loadtxt(dataset / "poses/top.tum")[:, 1:4]
    # The beams of a VLP-16 leave within 12 mm of its centre, which moved 0.1 m between two poses.
    assert farthest_from(poses, origins[::50]) < 0.07


def as_table(scan: np.ndarray, names: str) -> np.ndarray:
    return np.stack([scan[name].astype("f4") for name in names.split()], axis=1)


def test_files_of_other_software_with_poses_yield_the_same_mesh(dataset, tmp_path):
    """Scans at the stamp as arrays, with a pose for each."""
    ours, theirs = tmp_path / "ours.ply", tmp_path / "theirs.ply"
    poses = np.loadtxt(dataset / "poses/rear.tum")
    stamps = [0.0, 0.1, 0.2]
    lines = []
    for frame, stamp in enumerate(stamps):
        scan = scan_of(dataset, "rear", frame)
        np.savez(
            tmp_path / f"{frame}.npz",
            xyz=as_table(scan, "x y z"),
            ring=scan["ring"],
            time=scan["time"],
            label=scan["label"],
        )
        nearest = np.abs(poses[:, 0] - stamp).argmin()
        lines.append(" ".join(map(repr, map(float, poses[nearest]))))
    (tmp_path / "poses.tum").write_text("\n".join(lines) + "\n")
    files = [tmp_path / f"{frame}.npz" for frame in range(3)]
    command = ["--poses", tmp_path / "poses.tum", "--report", tmp_path / "theirs.json"]
    reconstruct("mesh", *files, *command, "-o", theirs)
    reconstruct("mesh", dataset, "--sensor", "rear", "-o", ours, "--report", tmp_path / "ours.json")
    a, b = (json.loads((tmp_path / name).read_text()) for name in ("ours.json", "theirs.json"))
    # Their columns come from times, the sensor's motion from the points: some returns share a cell.
    for ours_scan, theirs_scan in zip(a["scans"], b["scans"], strict=True):
        for count in ("used", "accepted_faces"):
            assert ours_scan[count] == pytest.approx(theirs_scan[count], rel=0.03)
    # A few vertices are where borders were clipped; the others where a beam met the ground,
    # or a little above or below: merging moves them to the mean of what scans interpolate.
    truth = np.concatenate([world(scan_of(dataset, "rear", frame)) for frame in range(3)])
    for path in (ours, theirs):
        assert np.quantile(distances_from(truth, Mesh(path).p[::7]), 0.9) < 0.05


def test_kitti_points_without_rings_are_meshed(dataset, tmp_path):
    """Beams are distinguished by elevation; the frame is the sensor's, since there is no pose."""
    scan = scan_of(dataset, "top", 0)
    as_table(scan, "x y z intensity").tofile(tmp_path / "scan.bin")
    said = reconstruct("mesh", tmp_path / "scan.bin", "-o", tmp_path / "mesh.ply")
    mesh = Mesh(tmp_path / "mesh.ply")
    assert farthest_from(as_table(scan, "x y z").astype("f8"), mesh.p[::7]) < 1e-6
    assert "sensor's frame" in said
    reconstruct("mesh", dataset, "--sensor", "top", "--frames", "0", "-o", tmp_path / "ours.ply")
    assert len(mesh.faces) == pytest.approx(len(Mesh(tmp_path / "ours.ply").faces), rel=0.03)


def test_file_names_select_poses_and_large_coordinates_get_an_origin(tmp_path):
    """File names are stamps between two poses; UTM coordinates get an origin in whole metres."""
    rows, columns = 8, 60
    elevation = np.radians(np.linspace(-30, -10, rows))[:, None] + np.zeros(columns)
    azimuth = np.zeros((rows, 1)) + np.linspace(-0.5, 0.5, columns)
    u = np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth),
         np.sin(elevation)], axis=-1
    )  # fmt: skip
    image = (u * (-2 / u[..., 2])[..., None]).astype("f4")  # the plane z = -2
    np.save(tmp_path / "1317354879.250000000.npy", image)
    big = np.array([429440.0, 5150660.0, 400.0])
    half = np.sqrt(0.5)
    (tmp_path / "poses.tum").write_text(
        f"1317354879 {big[0]} {big[1]} {big[2]} 0 0 {half} {half}\n"
        f"1317354880 {big[0] + 4} {big[1]} {big[2]} 0 0 {half} {half}\n"
    )
    out = tmp_path / "mesh.ply"
    options = ["--poses", tmp_path / "poses.tum", "--pose-by", "name", "--grid", "file"]
    reconstruct("mesh", tmp_path / "1317354879.250000000.npy", *options, "-o", out)
    mesh = Mesh(out)
    origin = np.array(list(map(float, mesh.comment("origin_w").split())))
    assert (origin == np.round(origin)).all()
    assert np.linalg.norm(mesh.p, axis=1).max() < 100
    p = image.reshape(-1, 3).astype("f8")
    expected = np.stack([-p[:, 1], p[:, 0], p[:, 2]], axis=1) + big + [1, 0, 0]  # a quarter turn
    assert len(mesh.faces) == 2 * (rows - 1) * (columns - 1)
    assert farthest_from(expected - origin, mesh.p) < 1e-6


def range_grid(path: Path, heights: np.ndarray) -> np.ndarray:
    """Writes a Stanford range scan whose cells are 1 apart; returns its points."""
    rows, columns = heights.shape
    y, x = np.mgrid[:rows, :columns]
    is_there = np.isfinite(heights)
    p = np.stack([x, y, heights], axis=-1)[is_there]
    lists = ["0"] * (rows * columns)
    for i, cell in enumerate(np.flatnonzero(is_there)):
        lists[cell] = f"1 {i}"
    text = "\n".join(
        ["ply", "format ascii 1.0", f"obj_info num_cols {columns}", f"obj_info num_rows {rows}",
         f"element vertex {len(p)}", "property float x", "property float y", "property float z",
         f"element range_grid {rows * columns}", "property list uchar int vertex_indices",
         "end_header", *(" ".join(map(str, q)) for q in p), *lists, ""]
    )  # fmt: skip
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())
    return p


def test_stanford_conf_file_places_its_range_scans(tmp_path):
    """p = R(q)^T p + t, as its SOURCE says; one of the files is packed."""
    flat, holed = np.zeros((12, 15)), np.zeros((12, 15))
    holed[2, 3] = np.nan
    first = range_grid(tmp_path / "a.ply", flat)
    second = range_grid(tmp_path / "b.ply.gz", holed)
    q = np.array([0.1, -0.2, 0.3, 0.9])
    q /= np.linalg.norm(q)
    t = np.array([40.0, 3.0, -5.0])
    (tmp_path / "ab.conf").write_text(
        "camera 0 0 0  0 0 0 1\nbmesh a.ply 0 0 0 0 0 0 1\n"
        f"bmesh b.ply {' '.join(map(str, t))} {' '.join(map(str, q))}\n"
    )
    out, report = tmp_path / "mesh.ply", tmp_path / "report.json"
    reconstruct("mesh", tmp_path / "ab.conf", "-o", out, "--report", report)
    mesh = Mesh(out)
    inverse = q * [-1, -1, -1, 1]
    expected = np.concatenate([first, rotated(inverse, second) + t])
    assert len(mesh.p) == len(expected)
    assert farthest_from(expected, mesh.p) < 1e-5  # the file's decimals, as floats
    # Two triangles a cell; round the missing vertex four cells lose one each.
    figures = json.loads(report.read_text())
    assert [scan["accepted_faces"] for scan in figures["scans"]] == [308, 304]


def test_unorganised_points_are_meshed(tmp_path):
    """A sheet of jittered points: one surface of its area that faces the viewpoint."""
    random = np.random.default_rng(3)
    x, y = np.mgrid[:15, :15].reshape(2, -1) + random.uniform(-0.2, 0.2, (2, 225))
    np.save(tmp_path / "points.npy", np.stack([x + 1, y - 7, np.full(225, -5.0)], axis=1))
    out = tmp_path / "mesh.ply"
    reconstruct("mesh", tmp_path / "points.npy", "--unorganised", "--perimeter-m", "6", "-o", out)
    mesh = Mesh(out)
    a, b, c = (mesh.p[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    assert (normals[:, 2] > 0).all()
    assert mesh.area() == pytest.approx(14 * 14, rel=0.03)


def test_vertical_bound_holds_by_rays_from_every_vertex(terrain, tmp_path):
    out, report = tmp_path / "simple.ply", tmp_path / "report.json"
    bound = 0.5
    reconstruct("simplify", terrain, "-o", out, "--max-vertical-error-m", bound, "--report", report)
    before, after = Mesh(terrain), Mesh(out)
    assert after.comment("origin_w") == before.comment("origin_w")
    assert len(after.faces) < len(before.faces) / 2
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(after.p.astype(np.float32), after.faces.astype(np.uint32))
    up = before.p[:, 2].max() + 10
    rays = np.zeros((len(before.p), 6), np.float32)
    rays[:, :2], rays[:, 2], rays[:, 5] = before.p[:, :2], up, -1
    found = up - scene.cast_rays(rays)["t_hit"].numpy()
    inside = np.isfinite(found)
    assert inside.mean() > 0.98  # all but the border, which may move by as much
    float_m = 1e-3  # coordinates of some 500 m
    assert np.abs(found - before.p[:, 2])[inside].max() < bound + float_m
    figures = json.loads(report.read_text())["simplified"]
    assert figures["from_triangles"] == len(before.faces)
    assert figures["to_triangles"] == len(after.faces)
    assert figures["halted_by"] == "bound"
    assert figures["to_simplified"]["rms"]["value_m"] < bound


def test_triangle_budget_is_met(terrain, tmp_path):
    out = tmp_path / "simple.obj"
    reconstruct("simplify", terrain, "-o", out, "--triangles", "1000")
    faces = sum(line.startswith("f ") for line in out.read_text().splitlines())
    assert 999 <= faces <= 1000


def test_noise_bound_stops_simplification(tmp_path):
    """A plane with noise of 1 cm is a few triangles at 4 sd and nearly all of it at 0.01."""
    random = np.random.default_rng(5)
    y, x = np.mgrid[:40, :40]
    p = np.stack([x, y, 0.01 * random.standard_normal(x.shape)], axis=-1).reshape(-1, 3)
    first = (40 * np.arange(39)[:, None] + np.arange(39)).ravel()
    faces = np.concatenate(
        [np.stack([first, first + 1, first + 41], 1), np.stack([first, first + 41, first + 40], 1)]
    )
    mesh = write_mesh(tmp_path / "noise.ply", p, faces)
    out = tmp_path / "simple.ply"
    reconstruct("simplify", mesh, "-o", out, "--noise-halt", "4", "--sd-m", "0.01")
    assert len(Mesh(out).faces) < len(faces) / 10
    reconstruct("simplify", mesh, "-o", out, "--noise-halt", "0.01", "--sd-m", "0.01")
    assert len(Mesh(out).faces) > len(faces) / 2
    assert refused(
        "simplify", mesh, "-o", tmp_path / "no.ply", "--noise-halt", "2", words=["deviation"]
    )


def test_hole_in_a_plane_is_filled_flat(tmp_path):
    y, x = np.mgrid[:12, :12]
    p = np.stack([x, y, np.full(x.shape, 3.0)], axis=-1).reshape(-1, 3)
    first = (12 * np.arange(11)[:, None] + np.arange(11)).ravel()
    kept = first[~np.isin(first, [5 * 12 + 5, 5 * 12 + 6])]
    faces = np.concatenate(
        [np.stack([kept, kept + 1, kept + 13], 1), np.stack([kept, kept + 13, kept + 12], 1)]
    )
    mesh = write_mesh(tmp_path / "plane.ply", p, faces)
    out, report = tmp_path / "filled.ply", tmp_path / "report.json"
    reconstruct("fill", mesh, "-o", out, "--fill-m", "7", "--report", report)
    filled = Mesh(out)
    assert filled.area() == pytest.approx(121, abs=1e-9)
    assert np.abs(filled.p[:, 2] - 3).max() < 1e-9
    holes = json.loads(report.read_text())["holes"]
    assert holes["filled"] == 1
    assert [hole["why"] for hole in holes["left"]] == ["outline"]
    assert holes["left"][0]["rim_m"] == pytest.approx(44)
    reconstruct("fill", mesh, "-o", out, "--fill-m", "5", "--report", report)
    assert Mesh(out).area() == pytest.approx(119, abs=1e-9)


@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "glb"])
def test_every_format_is_written(dataset, tmp_path, ending):
    out = tmp_path / f"mesh.{ending}"
    reconstruct("mesh", dataset, "--sensor", "top", "--frames", "0", "-o", out)
    mesh = o3d.io.read_triangle_mesh(str(out))
    assert len(mesh.triangles) > 5000


def test_noise_is_taken_from_the_scan_by_default(tmp_path):
    scene = SCENE[: SCENE.index("  - name: rear")].replace(
        "pitch_deg: 3}", "pitch_deg: 3}, range_noise_sigma_m: 0.02"
    )
    (tmp_path / "scene.yaml").write_text(scene)
    assert groundray("generate", tmp_path / "scene.yaml", "-o", tmp_path / "data").returncode == 0
    command = ["mesh", tmp_path / "data", "--frames", "0", "-o", tmp_path / "mesh.ply"]
    reconstruct(*command)
    assert Mesh(tmp_path / "mesh.ply").vertex["sd_m"] == pytest.approx(0.02, rel=1e-6)
    reconstruct(*command, "--range-sd-m", "0.05", "--no-labels")
    mesh = Mesh(tmp_path / "mesh.ply")
    assert mesh.vertex["sd_m"] == pytest.approx(0.05, rel=1e-6)
    assert "label" not in mesh.vertex.dtype.names


def test_bytes_do_not_depend_on_threads(dataset, tmp_path):
    options = ["--fill-m", "2", "--max-error-m", "0.2", "--frames", "0:2"]
    one, all_ = tmp_path / "one.ply", tmp_path / "all.ply"
    first = min(os.sched_getaffinity(0))
    reconstruct(
        "mesh", dataset, *options, "-o", one, preexec_fn=lambda: os.sched_setaffinity(0, {first})
    )
    reconstruct("mesh", dataset, *options, "-o", all_)
    assert one.read_bytes() == all_.read_bytes()


def test_mesh_errors_are_reported_and_nothing_is_written(dataset, tmp_path):
    out = tmp_path / "out/mesh.ply"
    out.parent.mkdir()
    scan = dataset / "lidar/top/000000.ply"
    to = ["-o", out]
    (tmp_path / "one.tum").write_text("0 0 0 0 0 0 0 1\n")
    (tmp_path / "bad.conf").write_text("bmesh a.ply 1 2 3\n")
    (tmp_path / "none.conf").write_text("camera 0 0 0 0 0 0 1\n")
    np.save(tmp_path / "zero.npy", np.zeros((10, 3)))
    np.save(tmp_path / "apart.npy", [[[9, 0, 0], [0, 9, 0]], [[-9, 0, 0], [0, -9.0, 1]]])
    np.save(tmp_path / "nan.npy", np.full((10, 3), np.nan))
    np.save(tmp_path / "cloud.npy", np.random.default_rng(1).uniform(-9, 9, (999, 3)))
    range_grid(tmp_path / "grid.ply.gz", np.zeros((4, 4)))
    packed = (tmp_path / "grid.ply.gz").read_bytes()
    (tmp_path / "short.ply.gz").write_bytes(packed[:-30])
    (tmp_path / "plain.ply.gz").write_bytes(b"ply")
    negative = np.rec.fromarrays([np.ones(9), np.arange(9.0), np.zeros(9), np.full(9, -1.0)],
                                 names="x,y,z,range_sd")  # fmt: skip
    np.save(tmp_path / "negative.npy", negative)
    (tmp_path / "path.tum").write_text("5 0 0 0 0 0 0 1\n5.05 0 0 0 0 0 0 1\n")
    np.savez(tmp_path / "5.01.npz", xyz=np.ones((4, 3)), time=np.array([0, 0.01, 0.02, 0.09]))
    by_name = ["--poses", tmp_path / "path.tum", "--pose-by", "name"]
    cases = [
        ([tmp_path / "missing.ply", *to], ["missing.ply", "no such file"]),
        ([tmp_path, *to], ["dataset.yaml", "groundray generate"]),
        ([dataset, "--sensor", "tap", *to], ["'tap'", "top, rear", "did you mean 'top'"]),
        ([dataset, "--frames", "7:", *to], ["no scan"]),
        ([dataset, "--frames", "2:1", *to], ["--frames", "2:1"]),
        ([dataset, scan, *to], ["only input"]),
        ([dataset, "-o", tmp_path / "out/mesh.xyz"], [".ply, .obj, .stl or .glb"]),
        ([dataset, "-o", tmp_path / "nowhere/mesh.ply"], ["no folder"]),
        ([dataset, *to, "--report", out], ["the same name"]),
        ([dataset, *to, "--poses", tmp_path / "one.tum"], ["--sensor"]),
        ([scan, scan, *to], ["--poses"]),
        ([scan, scan, "--poses", tmp_path / "one.tum", *to], ["1 poses for 2 scans"]),
        ([scan, "--sensor", "top", *to], ["--sensor"]),
        ([scan, "--points", "as_fired", *to], ["--pose-by name"]),
        ([scan, "--grid", "file", *to], ["--grid file", "HEIGHT"]),
        ([tmp_path / "bad.conf", *to], ["bad.conf:1", "tx ty tz"]),
        ([tmp_path / "none.conf", *to], ["no scan"]),
        ([tmp_path / "zero.npy", *to], ["no scan has a return"]),
        ([tmp_path / "apart.npy", "--grid", "file", *to], ["no two returns", "--preset"]),
        ([dataset, "--memory-mb", "1", *to], ["--memory-mb"]),
        ([tmp_path / "short.ply.gz", *to], ["short.ply.gz", "truncated"]),
        ([tmp_path / "plain.ply.gz", *to], ["plain.ply.gz", "gzip"]),
        ([tmp_path / "negative.npy", *to], ["standard deviation", "row 0", "--range-sd-m"]),
        ([tmp_path / "zero.npy", *by_name, *to], ["must be its stamp"]),
        (
            [tmp_path / "5.01.npz", *by_name, "--points", "as_fired", *to],
            ["not covered by the poses"],
        ),
        ([tmp_path / "nan.npy", "--unorganised", *to], ["no three", "--perimeter-m"]),
        ([tmp_path / "cloud.npy", *to], ["--unorganised"]),
        ([dataset, "--noise-halt", "2", *to], ["--noise-halt", "--range-sd-m"]),
        ([dataset, "--border-m", "2", *to], ["--border-m", "--max-error-m"]),
        ([dataset, "--crease-deg", "20", *to], ["--crease-deg"]),
        ([dataset, *to, "--report", tmp_path / "out/../out/mesh.ply"], ["the same name"]),
        ([dataset, *to, "--report", out.parent], ["folder"]),
        (
            [
                tmp_path / "grid.ply.gz",
                "-o",
                tmp_path / "grid.ply",
                "--report",
                tmp_path / "grid.ply.gz",
            ],
            ["it is an input"],
        ),
    ]
    for arguments, words in cases:
        assert refused("mesh", *arguments, words=words), arguments
    mesh = write_mesh(tmp_path / "empty.ply", np.zeros((3, 3)), np.empty((0, 3), int))
    assert refused("simplify", mesh, *to, "--triangles", "5", words=["triangle"])
    wall = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]])
    mesh = write_mesh(tmp_path / "wall.ply", wall, np.array([[0, 1, 2], [0, 2, 3]]))
    assert refused(
        "simplify", mesh, *to, "--max-vertical-error-m", "1", words=["overhangs", "any direction"]
    )


@pytest.mark.parametrize(
    "arguments",
    [
        ["mesh"],
        ["mesh", "a.ply", "-o", "b.ply", "--triangles", "5", "--knee"],
        ["mesh", "a.ply", "-o", "b.ply", "--perimeter-m", "2"],
        ["mesh", "a.ply", "-o", "b.ply", "--preset", "grund"],
        ["simplify", "a.ply", "-o", "b.ply"],
        ["simplify", "a.ply", "-o", "b.ply", "--max-error-m", "-1"],
        ["simplify", "a.ply", "-o", "b.ply", "--max-error-m", "inf"],
        ["simplify", "a.ply", "-o", "b.ply", "--triangles", "0"],
        ["mesh", "a.ply", "-o", "b.ply", "--unorganised", "--occlusion", "c.ply"],
        ["mesh", "a.ply", "-o", "b.ply", "--turned-deg", "120"],
        ["fill", "a.ply", "-o", "b.ply"],
        ["mend"],
    ],
)
def test_wrong_usage_exits_with_code_two(arguments):
    assert groundray("reconstruct", *arguments).returncode == 2


def test_a_failed_write_keeps_the_existing_file(terrain, tmp_path):
    """A limit on file size simulates a full disk: the report fits, the mesh does not."""
    mesh, report = tmp_path / "mesh.ply", tmp_path / "report.json"
    report.write_text("before")
    most_bytes = 20_000
    result = groundray(
        *("reconstruct", "simplify", terrain, "-o", mesh, "--report", report),
        *("--max-vertical-error-m", "0.001"),
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes)),
    )
    assert result.returncode == 1
    assert "cannot be written" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]
    assert report.read_text() == "before"


def test_a_mesh_does_not_overwrite_its_input(terrain, tmp_path):
    mesh = tmp_path / "mesh.ply"
    mesh.write_bytes(terrain.read_bytes())
    (tmp_path / "folder").mkdir()
    same = tmp_path / "folder/../mesh.ply"
    assert refused("simplify", mesh, "-o", same, "--triangles", "9", words=["it is an input"])
    assert mesh.read_bytes() == terrain.read_bytes()


def test_skipped_parts_of_a_mesh_file_are_reported(tmp_path):
    (tmp_path / "mesh.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nl 1 2\n"
    )
    said = reconstruct("fill", tmp_path / "mesh.obj", "-o", tmp_path / "out.ply", "--fill-m", "1")
    assert "ignored in the file" in said


def test_scans_without_noise_are_merged_by_their_spacing(tmp_path):
    """Range scans half a spacing apart are one surface; farther than the spacing, two."""
    range_grid(tmp_path / "a.ply", np.zeros((12, 15)))
    for apart, times in ((0.5, 1), (1.5, 2)):
        (tmp_path / "ab.conf").write_text(
            f"bmesh a.ply 0 0 0 0 0 0 1\nbmesh a.ply 0 0 {apart} 0 0 0 1\n"
        )
        out = tmp_path / "mesh.ply"
        assert "median edge" in reconstruct("mesh", tmp_path / "ab.conf", "-o", out)
        assert Mesh(out).area() == pytest.approx(times * 11 * 14, rel=0.05)  # all but rims


@pytest.mark.parametrize("ending", ["stl", "glb"])
def test_single_precision_formats_get_an_origin_near_the_mesh(tmp_path, ending):
    """UTM coordinates as floats would be wrong by up to a quarter of a metre; read by trimesh."""
    import trimesh

    p = np.array([[500000.25, 5e6, 300], [500001.25, 5e6, 300], [500000.25, 5e6 + 1, 300.125]])
    mesh = write_mesh(tmp_path / "utm.ply", p, np.array([[0, 1, 2]]))
    out = tmp_path / f"near.{ending}"
    reconstruct("fill", mesh, "-o", out, "--fill-m", "1")
    found = trimesh.load_mesh(out) if ending == "stl" else trimesh.load_scene(out).to_mesh()
    assert np.abs(found.vertices).max() < 1000
    assert found.area == pytest.approx(np.sqrt(1 + 0.125**2) / 2, rel=1e-9)
    back = tmp_path / "back.ply"
    reconstruct("fill", out, "-o", back, "--fill-m", "1")
    origin = np.array(list(map(float, Mesh(back).comment("origin_w").split())))
    assert np.sort(Mesh(back).p + origin, axis=0) == pytest.approx(np.sort(p, axis=0), abs=1e-9)


def test_an_interrupted_mesh_run_leaves_no_files(dataset, tmp_path):
    command = ["reconstruct", "mesh", dataset, "-o", tmp_path / "mesh.ply", "--max-error-m", "0.05"]
    run = subprocess.Popen(
        [PROGRAM, *map(str, command)], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert "scans" in run.stderr.readline()  # they are linked: merging them comes next
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=60)
    assert run.returncode == 130, said
    assert list(tmp_path.iterdir()) == []


def test_truth_scores_one_and_a_shifted_truth_zero(tmp_path):
    """Tests the evaluation of the closed loop: the truth itself, lifted by 5 cm, and by 2 m."""
    from reconstruction_peers import closed_loop

    closed_loop("rebuild", tmp_path, 1, 1, 8, 90)
    truth = Mesh(tmp_path / "truth.ply")
    for lift, least, most in ((0, 1, 1), (0.05, 1, 1), (2, 0, 0.1)):
        mesh = write_mesh(tmp_path / "lifted.ply", truth.p + np.array([0, 0, lift]), truth.faces)
        found = closed_loop("evaluate", tmp_path, mesh)
        for score in ("precision", "completeness", "f1"):
            assert least <= found[score] <= most, (lift, found)


def with_least_times(runs):
    """Returns the first run with each method's shortest time, since other load only adds time."""
    return {
        method: figures | {"cpu_s": min(run[method]["cpu_s"] for run in runs)}
        for method, figures in runs[0].items()
    }


@pytest.mark.parametrize("scans", [1, 3])
def test_known_scene_is_reconstructed_better_than_by_others(scans):
    """One seed at half the resolution; `./dev prove` takes the mean of ten at full resolution."""
    import reconstruction_peers

    is_full = os.environ.get("GROUNDRAY_PROOF") == "full"
    size = (64, 1800) if is_full else (32, 900)
    # At half the resolution ball pivoting takes little: its time grows faster with the points.
    timed = ("advancing_front", "ball_pivoting") if is_full else ("advancing_front",)
    seeds = range(1, 11 if is_full else 2)
    runs = [reconstruction_peers.compare(seed, scans, *size) for seed in seeds]

    def total(method: str, key: str) -> float:
        return sum(run[method][key] for run in runs)

    for peer in ("advancing_front", "ball_pivoting"):
        assert total("groundray", "f1") >= total(peer, "f1"), runs

    # Machines measured 0.10 and 0.13 in the mean of ten scenes. One small scene has an eighth at
    # worst, and processors that do other work give up to half as much again.
    most = 0.15 if is_full else 0.2

    def is_fast() -> bool:
        return all(total("groundray", "cpu_s") <= most * total(peer, "cpu_s") for peer in timed)

    tries = [runs[0]]
    while not is_full and not is_fast() and len(tries) < 3:  # ten seeds need no more
        tries.append(reconstruction_peers.compare(seeds[0], scans, *size))
        runs[0] = with_least_times(tries)
    assert is_fast(), runs
