"""`groundray-golden compare` on files that other people's software writes, and on bad ones."""

import json
import os
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import open3d as o3d
import OpenEXR
import pytest
import trimesh
from plyfile import PlyData, PlyElement

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))
GOLDEN = PROGRAM.parent / "groundray-golden"
DEM = ROOT / "data/terrain/prairie_1m.tif"


def compare(reference, other, *options, out):
    command = [GOLDEN, "compare", reference, other, "-o", out, *map(str, options)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def figures(reference, other, *options, out):
    """Returns the figures by name, and the complete report."""
    result = compare(reference, other, *options, out=out)
    assert result.returncode in (0, 1), result.stderr
    report = json.loads((out / "report.json").read_text())
    (section,) = report["sections"]
    page = HTMLParser()
    page.feed((out / "report.html").read_text())
    return {m["name"]: m["value"] for m in section["measures"]}, section, result


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """A dome of directions at 5 to 20 m: 16 rings of 200."""
    rng = np.random.default_rng(5)
    azimuth, elevation = np.meshgrid(
        np.linspace(0, 2 * np.pi, 200, endpoint=False), np.radians(np.arange(-30, 2, 2))
    )
    direction = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ],
        -1,
    ).reshape(-1, 3)
    range_m = rng.uniform(5, 20, len(direction))
    ring = np.repeat(np.arange(16), 200).astype(np.uint16)
    return direction, range_m, ring


def write_ply(path, points, **columns):
    names = ["x", "y", "z", *columns]
    arrays = [*points.T.astype(np.float32), *columns.values()]
    rows = np.rec.fromarrays(arrays, names=",".join(names))
    PlyData([PlyElement.describe(np.asarray(rows), "vertex")]).write(path)
    return path


def write_pcd(path, points):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    o3d.io.write_point_cloud(str(path), cloud, compressed="compressed" in path.stem)
    return path


WRITERS = {
    "theirs.ply": write_ply,
    "theirs.pcd": write_pcd,
    "compressed.pcd": write_pcd,
    "theirs.npy": lambda path, points: np.save(path, points),
    "theirs.npz": lambda path, points: np.savez_compressed(path, points=points),
    "theirs.bin": lambda path, points: (
        np.c_[points, np.ones(len(points))].astype("<f4").tofile(path)
    ),
}


@pytest.mark.parametrize("name", WRITERS)
def test_scans_in_any_format_show_the_injected_errors(name, scan, tmp_path):
    """5 cm too far, a tenth missing, in random order; floats of 20 m are 2e-6 m apart."""
    direction, range_m, ring = scan
    reference = write_ply(tmp_path / "reference.ply", direction * range_m[:, None], ring=ring)
    kept = np.arange(len(range_m)) % 10 != 0
    points = (direction * (range_m[:, None] + 0.05))[kept]
    points = points[np.random.default_rng(1).permutation(len(points))]
    WRITERS[name](tmp_path / name, points)
    figure, _, _ = figures(reference, tmp_path / name, out=tmp_path / "out")
    assert figure["pairs of returns"] == kept.sum()
    assert figure["missing returns"] == (~kept).sum()
    assert figure["extra returns"] == 0
    assert figure["range error, mean"] == pytest.approx(0.05, abs=1e-6)
    assert figure["range error, largest magnitude"] == pytest.approx(0.05, abs=5e-6)
    assert figure["range error, standard deviation"] < 2e-6


def test_limits_decide_the_exit_code(scan, tmp_path):
    direction, range_m, ring = scan
    reference = write_ply(tmp_path / "reference.ply", direction * range_m[:, None], ring=ring)
    other = write_ply(tmp_path / "other.ply", direction * (range_m[:, None] + 0.05), ring=ring)
    good = compare(reference, other, "--most-range-rms-m", 0.051, out=tmp_path / "out")
    bad = compare(reference, other, "--most-range-rms-m", 0.049, out=tmp_path / "out")
    assert (good.returncode, bad.returncode) == (0, 1)
    assert "FAILED range error, RMS" in bad.stdout


def test_the_unit_is_stated_and_not_guessed(scan, tmp_path):
    direction, range_m, ring = scan
    reference = write_ply(tmp_path / "reference.ply", direction * range_m[:, None], ring=ring)
    other = write_ply(tmp_path / "other.ply", 1000 * direction * range_m[:, None], ring=ring)
    wrong, section, _ = figures(reference, other, out=tmp_path / "out")
    assert wrong["range error, median"] > 4000
    assert "in millimetres? Then give its unit (--unit-m 0.001)." in section["text"]
    right, _, _ = figures(reference, other, "--unit-m", 0.001, out=tmp_path / "out")
    assert abs(right["range error, largest magnitude"]) < 1e-5


def write_exr(path, **channels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    arrays = {name: np.asarray(value, np.float32) for name, value in channels.items()}
    OpenEXR.File(header, arrays).write(str(path))
    return path


def test_images_show_the_injected_errors(tmp_path):
    rng = np.random.default_rng(3)
    depth = rng.uniform(2, 30, (40, 60))
    reference = write_exr(tmp_path / "reference.exr", Z=depth)
    other = write_exr(tmp_path / "other.exr", Z=depth + 0.125)
    figure, _, _ = figures(reference, other, out=tmp_path / "out")
    (mean,) = (v for n, v in figure.items() if n.startswith("Z") and "mean error" in n)
    assert mean == pytest.approx(0.125, abs=1e-6)


def test_kitti_depths_are_read_on_request(tmp_path):
    depth = np.random.default_rng(3).uniform(2, 30, (40, 60))
    reference = write_exr(tmp_path / "reference.exr", Z=depth)
    cv2.imwrite(str(tmp_path / "other.png"), np.round(256 * depth).astype(np.uint16))
    figure, _, _ = figures(
        reference, tmp_path / "other.png", "--png", "kitti_depth", out=tmp_path / "out"
    )
    (largest,) = (v for n, v in figure.items() if n.startswith("Z") and "largest error" in n)
    assert largest <= 0.5 / 256 + 1e-6


def test_dems_show_the_injected_errors(tmp_path):
    lifted = tmp_path / "other.tif"
    translate = ["gdal_translate", "-q", "-of", "GTiff", "-ot", "Float64"]
    subprocess.run([*translate, "-a_offset", "0.25", DEM, lifted], check=True)
    figure, _, _ = figures(DEM, lifted, out=tmp_path / "out")
    assert figure["height: mean error"] == pytest.approx(0.25, abs=1e-6)
    assert figure["height: largest error"] == pytest.approx(0.25, abs=1e-4)
    assert figure["slope of triangles: largest error"] < 1e-3


def test_meshes_show_the_injected_distance(tmp_path):
    """Two spheres of 1 and 1.05 m about one centre: 5 cm apart, except for the facets' sagitta."""
    small, large = (trimesh.creation.icosphere(4, radius) for radius in (1, 1.05))
    small.export(tmp_path / "small.ply")
    large.export(tmp_path / "large.obj")
    figure, _, _ = figures(tmp_path / "small.ply", tmp_path / "large.obj", out=tmp_path / "out")
    low, high = (figure[f"Hausdorff distance, at {end}"] for end in ("least", "most"))
    assert low <= high
    assert low == pytest.approx(0.05, rel=0.05)
    assert high - low < 1e-5


@pytest.mark.parametrize("form", ["ply", "obj", "stl", "glb"])
def test_meshes_in_every_format_agree_where_they_overlap(tmp_path, form):
    """Strips of 10 m and 8 m with 6 m in common: distances beyond equal the overhang."""
    for name, begin, end in (("truth", 0, 10), ("mesh", 4, 12)):
        corners = [(begin, 0, 0), (end, 0, 0), (end, 0, 1), (begin, 0, 1)]  # glTF's y is up
        if form != "glb":
            corners = [(x, z, y) for x, y, z in corners]
        faces = [(0, 1, 2), (0, 2, 3)]
        strip = trimesh.Trimesh(corners, faces, process=False)
        strip.export(tmp_path / f"{name}.{form}")
    figure, _, _ = figures(
        *(tmp_path / f"{name}.{form}" for name in ("truth", "mesh")),
        *("--within-m", "0.5", "--within-m", "1"),
        out=tmp_path / "out",
    )
    for within in (0.5, 1):
        shares = [(6 + within) / 8, (6 + within) / 10]
        shares.append(2 * shares[0] * shares[1] / sum(shares))
        for name, share in zip(("precision", "completeness", "F1"), shares, strict=True):
            said = [
                figure[f"{name} within {within} m{end}"] for end in ("", ", at least", ", at most")
            ]
            assert said[0] == pytest.approx(100 * share, abs=0.1)
            assert said[1] <= 100 * share <= said[2]
    assert figure["other to reference: angle between normals, 99 % of the area up to"] == 0


def test_other_software_agrees(tmp_path):
    """The example of docs/reference/golden.md: Open3D traces the same surface in floats."""
    pytest.importorskip("open3d")
    command = [sys.executable, ROOT / "docs/guide/compare_peers.py", tmp_path, PROGRAM.parent]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    report = json.loads((tmp_path / "scan_report/report.json").read_text())
    figure = {m["name"]: m["value"] for m in report["sections"][0]["measures"]}
    assert figure["pairs of returns"] > 40_000
    assert figure["missing returns"] == figure["extra returns"] == 0
    # A float of 400 m is 3e-5 m apart, and grazing rays stretch that.
    assert figure["range error, RMS"] < 1e-5
    assert figure["range error, largest magnitude"] < 1e-3


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("empty.ply", b"", "empty.ply:0: the first line must be 'ply'"),
        (
            "other.ply",
            b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float a\nend_header\n1\n",
            "other.ply: it has no column for x;",
        ),
        (
            "cut.pcd",
            b"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
            b"WIDTH 9\nHEIGHT 1\nPOINTS 9\nDATA binary\nabc",
            "cut.pcd: 9 points of 12 bytes need 108 bytes, but the file has 3",
        ),
        ("odd.bin", b"123", "3 bytes are not a multiple of 16"),
        ("bad.npy", b"\x93NUMPY\x09", "bad.npy: it does not begin with the NumPy signature"),
        ("bad.npz", b"PK\x03\x04", "bad.npz: it has no ZIP end record"),
        ("what.xyz", b"1 2 3", "the name does not show the kind of file; give it with --as"),
    ],
)
def test_garbage_causes_one_clear_error(name, content, expected, scan, tmp_path):
    direction, range_m, ring = scan
    reference = write_ply(tmp_path / "reference.ply", direction * range_m[:, None], ring=ring)
    (tmp_path / name).write_bytes(content)
    options = [] if name == "what.xyz" else ["--as", "scan"]
    first = tmp_path / name if name == "what.xyz" else reference
    result = compare(first, tmp_path / name, *options, out=tmp_path / "out")
    assert result.returncode == 1
    assert expected in result.stderr
    assert result.stderr.startswith("groundray-golden: ")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("prefix", ["", "reference-"])
def test_the_quaternion_of_a_pose_must_have_length_one(prefix, scan, tmp_path):
    """Three decimals are accurate enough; other lengths are rejected."""
    direction, range_m, ring = scan
    reference = write_ply(tmp_path / "reference.ply", direction * range_m[:, None], ring=ring)
    out = tmp_path / "out"
    option = f"--{prefix}sensor-pose"
    for wrong in ("0,0,0,0,0,0,0.9", "0,0,0,0,0,0,0", "0,0,0,0.707,0,0,0.71", "0,0,0,nan,0,0,1"):
        result = compare(reference, reference, option, wrong, out=out)
        assert result.returncode == 1, wrong
        assert f"{option}: the length of its quaternion" in result.stderr
        assert "qx,qy,qz,qw" in result.stderr
    half_turn = "0,0,0,0,0,1.0005,0"
    good = compare(reference, reference, option, half_turn, "--pair-mrad", 40, out=out)
    assert good.returncode == 0, good.stderr


def test_inputs_of_different_kinds_are_rejected_unless_as_is_given(scan, tmp_path):
    direction, range_m, ring = scan
    points = direction * range_m[:, None]
    reference = write_ply(tmp_path / "reference.ply", points, ring=ring)
    trimesh.creation.icosphere(2).export(tmp_path / "sphere.ply")
    write_exr(tmp_path / "image.exr", Z=np.ones((4, 5)))
    for name, kind in [("sphere.ply", "a mesh"), ("image.exr", "an image")]:
        result = compare(reference, tmp_path / name, out=tmp_path / "out")
        assert result.returncode == 1
        assert f"{name} {kind}: both must be of the same kind" in result.stderr
        assert "--as" in result.stderr
    asked = compare(reference, tmp_path / "sphere.ply", "--as", "mesh", out=tmp_path / "out")
    assert "reference.ply: there is no triangle" in asked.stderr
    # What a name does not tell is what the reference is.
    write_ply(tmp_path / "theirs.points", points)
    untold = compare(reference, tmp_path / "theirs.points", out=tmp_path / "out")
    assert "is not one of the supported point files" in untold.stderr
    (tmp_path / "model.dae").write_text("<COLLADA/>")
    unread = compare(tmp_path / "model.dae", tmp_path / "model.dae", out=tmp_path / "out")
    assert "the name does not show the kind of file" in unread.stderr


def test_images_without_a_pixel_in_common_fail(tmp_path):
    near, far = np.full((2, 20, 30), np.inf)
    near[:, :15], far[:, 15:] = 5, 5
    reference = write_exr(tmp_path / "a.exr", Z=near)
    figure, section, result = figures(
        reference, write_exr(tmp_path / "b.exr", Z=far), out=tmp_path / "out"
    )
    assert result.returncode == 1
    assert "FAILED Z: in both: 0" in result.stdout
    assert "no pixel in common" in section["text"]
    assert not any("error" in name for name in figure)


def test_light_that_is_not_a_number_fails(tmp_path):
    rng = np.random.default_rng(2)
    names = "RGB"
    sigma = {f"StdError.{k}": np.full((20, 30), 0.01) for k in names}

    def light():
        return {k: 1 + 0.01 * rng.standard_normal((20, 30)) for k in names}

    reference = write_exr(tmp_path / "a.exr", **light(), **sigma)
    broken = light()
    broken["G"][3, 4] = np.nan
    nothing = {k: np.full((20, 30), np.nan) for k in names}
    for name, channels in [("broken.exr", broken), ("nothing.exr", nothing)]:
        other = write_exr(tmp_path / name, **channels, **sigma)
        result = compare(reference, other, out=tmp_path / "out")
        assert result.returncode == 1, result.stdout
        assert "FAILED RGB: values or standard errors that are finite" in result.stdout
    assert "FAILED RGB: values that could be tested: 0 of 1800" in result.stdout


def sheet(path, x_m, y_m, z_m, shift_m=(0, 0, 0)):
    """A level rectangle from (0, 0) to (x, y), then shifted."""
    corners = np.array([(0, 0, z_m), (x_m, 0, z_m), (x_m, y_m, z_m), (0, y_m, z_m)]) + shift_m
    trimesh.Trimesh(corners, [(0, 1, 2), (0, 2, 3)], process=False).export(path)
    return path


def test_a_region_of_meshes_excludes_what_was_never_scanned(tmp_path):
    """Sheets 0.1 m apart, of which the other ends 4 m before the reference does."""
    reference, other = (sheet(tmp_path / f"{x}.ply", x, 10, z) for x, z in ((10, 0), (6, 0.1)))
    largest = "Hausdorff distance, at most"
    step = ["--step-m", 0.05]
    whole, section, result = figures(reference, other, *step, out=tmp_path / "out")
    assert whole[largest] == pytest.approx(np.hypot(4, 0.1), abs=1e-4)
    assert "(--area, --ignore-beyond-m)" in section["text"]
    assert result.stdout.startswith(section["headline"] + " No limit was given")
    part, section, _ = figures(
        reference, other, *step, "--area", 0, 0, 5, 10, "--heights-m", -1, 1, out=tmp_path / "out"
    )
    assert part[largest] == pytest.approx(0.1, abs=1e-4)
    assert "at most 0.1 m apart" in section["headline"]
    assert set(section["main"]) <= part.keys()
    assert len(section["main"]) == 5
    near, _, _ = figures(reference, other, *step, "--ignore-beyond-m", 0.5, out=tmp_path / "out")
    left_out = "reference: left out, farther than 0.5 m from the other surface, share"
    assert near[left_out] == pytest.approx(10 * (4 - np.sqrt(0.5**2 - 0.1**2)), abs=0.1)
    assert near[largest] < 0.6


def test_an_origin_makes_local_coordinates_comparable(tmp_path):
    """STL has floats, in which world coordinates would be off by up to 0.25 m."""
    origin = (435_000, 5_150_500, 200)
    reference = sheet(tmp_path / "world.obj", 10, 10, 0, origin)
    other = sheet(tmp_path / "local.stl", 10, 10, 0.125)
    given = ["--reference-origin", "0,0,0", "--origin", ",".join(map(str, origin))]
    place = ["--area", "435001,5150501,435009,5150509", "--step-m", 0.1]
    figure, _, _ = figures(reference, other, *given, *place, out=tmp_path / "out")
    assert figure["Hausdorff distance, at most"] == pytest.approx(0.125, abs=1e-4)
    assert figure["reference: area"] == pytest.approx(64, rel=1e-6)
    for wrong in ("nan,0,0", "1,2"):
        result = compare(reference, other, "--origin", wrong, out=tmp_path / "bad")
        assert result.returncode in (1, 2)
        assert "--origin" in result.stderr + result.stdout


def test_scans_in_world_coordinates_are_placed_by_origin_and_pose(scan, tmp_path):
    """The sensor stands at (435010, 5150520, 200); the other's file is relative to an origin."""
    direction, range_m, ring = scan
    points = direction * range_m[:, None]
    reference = write_ply(tmp_path / "sensor.ply", points, ring=ring)
    other = write_ply(tmp_path / "local.ply", points + np.array([10, 20, 0]), ring=ring)
    sensor = "435010,5150520,200"
    options = [
        *("--reference-origin", sensor, "--origin", "435000,5150500,200"),
        *("--sensor-pose", f"{sensor},0,0,0,1"),
    ]
    figure, _, _ = figures(reference, other, *options, out=tmp_path / "out")
    assert figure["pairs of returns"] == len(points)
    assert figure["range error, largest magnitude"] < 1e-5
    east = ["--area", 435010.01, 5150000, 436000, 5151000]  # no beam is that close to the border
    half, _, _ = figures(reference, other, *options, *east, out=tmp_path / "out")
    assert half["pairs of returns"] == np.count_nonzero(points[:, 0] > 0.01)


def test_a_region_of_dems_is_in_their_reference_system(tmp_path):
    """The north-west quarter of a DEM of which another is lifted by 0.25 m."""
    lifted = tmp_path / "other.tif"
    translate = ["gdal_translate", "-q", "-of", "GTiff", "-ot", "Float64"]
    subprocess.run([*translate, "-a_offset", "0.25", DEM, lifted], check=True)
    info = json.loads(subprocess.check_output(["gdalinfo", "-json", DEM]))
    west, step, _, north, _, _ = info["geoTransform"]
    columns, rows = info["size"]
    size_m = np.array([columns, rows]) // 2 * step
    area = [west, north - size_m[1], west + size_m[0], north]
    figure, _, _ = figures(DEM, lifted, "--area", *area, out=tmp_path / "out")
    assert figure["samples that both have"] == (columns // 2) * (rows // 2)
    assert figure["height: mean error"] == pytest.approx(0.25, abs=1e-6)


def test_a_rectangle_of_pixels_is_compared(tmp_path):
    depth = np.random.default_rng(3).uniform(2, 30, (40, 60))
    reference = write_exr(tmp_path / "reference.exr", Z=depth)
    depth[:, 30:] += 1
    other = write_exr(tmp_path / "other.exr", Z=depth)
    left, section, _ = figures(reference, other, "--pixels", 5, 5, 25, 30, out=tmp_path / "out")
    assert left["Z: in both"] == 25 * 30
    assert left["Z: largest error"] == 0
    assert section["headline"] == "All values that both images have are equal."
    result = compare(reference, other, "--pixels", 50, 0, 11, 40, out=tmp_path / "bad")
    assert result.returncode == 1
    assert "must be COLUMN ROW WIDTH HEIGHT within the image of 60 x 40 px" in result.stderr


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--pixels", 0, 0, 1, 1], "--pixels is for images: omit it"),
        (["--area", 5, 0, 1, 1], "must be W S E N, metres, with W < E and S < N"),
        (["--area", 0, 0, "nan", 1], "must be W S E N"),
        (["--heights-m", 2, 1], "must be LOW HIGH, metres, with LOW < HIGH"),
        (["--area", 500, 500, 501, 501], "are outside the area and heights"),
    ],
)
def test_invalid_regions_are_rejected(options, expected, scan, tmp_path):
    direction, range_m, ring = scan
    reference = write_ply(tmp_path / "reference.ply", direction * range_m[:, None], ring=ring)
    result = compare(reference, reference, *options, out=tmp_path / "out")
    assert result.returncode == 1
    assert expected in result.stderr
    assert not (tmp_path / "out").exists()


def test_reports_are_self_contained_and_show_where_errors_are(scan, tmp_path):
    direction, range_m, ring = scan
    reference = write_ply(tmp_path / "reference.ply", direction * range_m[:, None], ring=ring)
    range_m = np.where(ring == 3, range_m + 0.05, range_m)
    other = write_ply(tmp_path / "other.ply", direction * range_m[:, None], ring=ring)
    _, section, _ = figures(reference, other, "--most-range-rms-m", 0.1, out=tmp_path / "out")
    html = (tmp_path / "out/report.html").read_text()
    for part in (
        *("Passed: the limit is met.", section["headline"], "azimuth, deg", "ring", "y, m"),
        *("range error, m", "<details>"),
    ):
        assert part.replace("'", "&#39;") in html
    assert html.index('class="cards"') < html.index("<image ") < html.index("<details>")
    for absent in ("<script", "<link", 'src="http', 'href="http'):
        assert absent not in html


def test_images_of_different_sizes_are_rejected(tmp_path):
    a = write_exr(tmp_path / "a.exr", Z=np.ones((4, 5)))
    b = write_exr(tmp_path / "b.exr", Z=np.ones((5, 4)))
    result = compare(a, b, out=tmp_path / "out")
    assert result.returncode == 1
    assert "5 x 4" in result.stderr
    assert "4 x 5" in result.stderr
