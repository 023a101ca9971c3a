"""Runs with cameras: stereo pairs, reproducible bytes, and invalid input."""

import os
import resource
import signal
import subprocess
import time
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))

CAMERA = """\
groundray_camera: 1
model: A small camera
size_px: [64, 48]
lens:
  brown_conrady:
    focal_px: [52, 51]
    centre_px: [31.2, 23.9]
    coefficients: [-0.2, 0.04, 0.001, -0.002]
shutter: {exposure_ms: 1}
products: [truth]
"""
LIGHT = """\
sky:
  analytic: {}
  sun: {utc: 2026-06-21T16:30:00Z, latitude_deg: 46.506, longitude_deg: -93.92}
"""
SCENE = f"""\
groundray: 1
seed: 7
duration_s: 0.2
terrain: {{dem: {ROOT / "data/terrain/prairie_1m.tif"}, material: dry_soil}}
{LIGHT}platform:
  drive: {{waypoints_m: [[429440, 5150660], [429448, 5150668]], speed_m_s: 8, height_m: 0.5}}
objects:
  - {{name: rock, label: 4, asset: rock, size_m: 2, at_m: [429446, 5150670], stance: on_slope}}
"""
LIDAR = """\
lidars:
  - {name: top, preset: velodyne_vlp16, mount: {translation_m: [0, 0, 1.5]}}
"""
# Of the second one the lens is half as strong, and it looks elsewhere.
PAIR = """\
cameras:
  - {name: left, file: camera.yaml, mount: {translation_m: [1, 0.15, 1.2], pitch_deg: 5}}
  - name: right
    file: right.yaml
    mount: {translation_m: [1.02, -0.15, 1.22], pitch_deg: 6, yaw_deg: 3}
stereo:
  - {name: pair, left: left, right: right, images: rectified}
"""
LIT = """\
cameras:
  - name: front
    file: camera.yaml
    mount: {translation_m: [1, 0, 1.2], pitch_deg: 5}
    trigger: {lidar: top, delay_ms: 20}
    project: [top]
    aperture: {f_number: 4}
    imager: {pixel_pitch_um: 5, filter: rggb, quantum_efficiency: 0.5, full_well_e: 10000,
             gain_dn_e: 0.4, bits: 12, read_noise_e: 3, prnu_percent: 1, dsnu_e: 2}
    sampling: {samples: 4, most_samples: 16, relative_error: 0.1}
    products: [radiance, truth, flow, flow_flo, coverage, raw, picture]
"""
ALL = SCENE + LIDAR + LIT


def generate(folder, scene, camera=CAMERA, out="out", more=(), **options):
    (folder / "scene.yaml").write_text(scene)
    (folder / "camera.yaml").write_text(camera)
    (folder / "right.yaml").write_text(camera.replace("-0.2, 0.04", "-0.1, 0.02"))
    command = [PROGRAM, "generate", "scene.yaml", "-o", folder / out, *more]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=300, check=False, cwd=folder, **options
    )


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def channels(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: c.pixels.copy() for name, c in file.channels().items()}


def rotation_of(x, y, z, w):
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * K + 2 * K @ K


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lit")
    result = generate(folder, ALL)
    assert result.returncode == 0, result.stderr
    assert "2 images" in result.stdout
    return folder / "out"


@pytest.fixture(scope="module", params=["rectified", "as_mounted"])
def pair(request, tmp_path_factory):
    """Without a lidar or a sky: truth needs neither."""
    folder = tmp_path_factory.mktemp(request.param)
    scene = (SCENE + PAIR).replace(LIGHT, "").replace("rectified", request.param)
    result = generate(folder, scene)
    assert result.returncode == 0, result.stderr
    return request.param, folder / "out"


def test_stereo_pairs_have_equal_rows_and_the_disparity_of_their_baseline(pair):
    """Points of the left image are projected by the right camera's R and P of ROS."""
    images, out = pair
    read = {
        name: yaml.safe_load((out / f"calibration/{name}.ros.yaml").read_text())
        for name in ("left", "right")
    }
    K, R, P = (
        {name: np.reshape(info[key]["data"], (3, -1)) for name, info in read.items()}
        for key in ("camera_matrix", "rectification_matrix", "projection_matrix")
    )
    baseline_m = -P["right"][0, 3] / P["right"][0, 0]
    assert baseline_m == pytest.approx(np.linalg.norm([0.02, 0.3, 0.02]), rel=1e-12)
    assert P["left"][0, 3] == 0
    assert (P["left"][:, :3] == P["right"][:, :3]).all()
    if images == "rectified":
        for name in read:
            assert (P[name][:, :3] == K[name]).all()
            assert (R[name] == np.eye(3)).all()
            assert not np.any(read[name]["distortion_coefficients"]["data"])
    exr = channels(out / "camera/left/000000.exr")
    hit = np.isfinite(exr["Z"])
    points = np.stack([exr[f"P.{axis}"] for axis in "XYZ"], axis=-1).astype(float)[hit]
    rectified = {}
    for name in read:
        with OpenEXR.File(str(out / f"camera/{name}/000000.exr")) as file:
            X_CD = np.reshape(file.header()["worldToCamera"], (4, 4)).T.astype(float)
        rectified[name] = (points @ X_CD[:3, :3].T + X_CD[:3, 3]) @ R[name].T

    def project(points_C, matrix):
        image = points_C @ matrix[:, :3].T + matrix[:, 3]
        return image[:, :2] / image[:, 2:]

    left = project(rectified["left"], P["left"])
    right = project(rectified["left"], P["right"])  # whose last column moves them to the right one
    same = project(rectified["right"], np.column_stack([P["right"][:, :3], np.zeros(3)]))
    # worldToCamera is of floats, 6e-8 of 400 m and of its axes; once for each camera.
    near_m = rectified["left"][:, 2]
    allowed_px = 2 * P["left"][0, 0] * (5e-5 / near_m + 1e-6) + 1e-6
    assert (np.abs(right - same).max(axis=1) < allowed_px).all()
    assert (np.abs(left[:, 1] - same[:, 1]) < allowed_px).all()
    disparity = left[:, 0] - same[:, 0]
    assert (np.abs(disparity - P["left"][0, 0] * baseline_m / near_m) < allowed_px).all()
    assert disparity.max() > 3
    for name in read:
        reported = yaml.safe_load((out / f"calibration/{name}.yaml").read_text())["rectification"]
        assert reported["state"] == ("done" if images == "rectified" else "to_do")
        turn = rotation_of(*reported["rotation_xyzw"])
        assert np.abs(turn - R[name]).max() < 1e-14
        assert reported["right_of_left_m"] == pytest.approx(0 if name == "left" else baseline_m)
    if images == "rectified":  # then the left pixels are the image's own
        v, u = np.nonzero(hit)
        away_px = np.abs(left - np.stack([u, v], axis=1)).max(axis=1)
        assert (away_px < allowed_px).all()


@pytest.mark.parametrize("pair", ["rectified"], indirect=True)
def test_rectified_images_match_after_a_shift_by_the_disparity(pair):
    _, out = pair
    record = yaml.safe_load((out / "calibration/right.yaml").read_text())["rectification"]
    assert record["state"] == "done"
    left, right = (channels(out / f"camera/{n}/000001.exr") for n in ("left", "right"))
    v, u = np.nonzero(np.isfinite(left["Z"]))
    over = u - record["focal_px"][0] * record["right_of_left_m"] / left["Z"][v, u]
    inside = over >= 0.5
    v, over = v[inside], np.rint(over[inside]).astype(int)
    ratio = right["Z"][v, over] / left["Z"][v, u[inside]]
    # A half pixel aside the ground is as far but at crests; the rock's edge hides some.
    assert (np.abs(ratio - 1) < 0.05).mean() > 0.97


def test_pixels_beyond_the_fold_of_a_lens_are_invalid(tmp_path):
    """A lens r + k1 r^3 + k2 r^5 + k3 r^7 images points up to its maximum."""
    k1, k2, k3 = -0.36, 0.14, -0.024
    camera = CAMERA.replace("[-0.2, 0.04, 0.001, -0.002]", f"[{k1}, {k2}, 0, 0, {k3}]")
    camera = camera.replace("[52, 51]", "[36, 36]").replace(
        "[truth]", "[radiance, truth, coverage]"
    )
    scene = SCENE + LIDAR + LIT.split("    trigger")[0]
    assert generate(tmp_path, scene, camera).returncode == 0
    exr = channels(tmp_path / "out/camera/front/000000.exr")
    squares = np.roots([7 * k3, 5 * k2, 3 * k1, 1])
    r = np.sqrt(min(x.real for x in squares if abs(x.imag) < 1e-12 and x.real > 0))
    rim_px = 36 * (r + k1 * r**3 + k2 * r**5 + k3 * r**7)
    v, u = np.indices((48, 64))
    from_rim_px = np.hypot(u - 31.2, v - 23.9) - rim_px
    assert (from_rim_px > 0).mean() > 0.02
    assert (exr["Valid"] == (from_rim_px < 0)).all()
    nowhere = exr["Valid"] == 0
    for name in ("R", "G", "B", "Label", "Instance", "Material", "Coverage.0", "Coverage.1"):
        assert (exr[name][nowhere] == 0).all(), name
    assert np.isinf(exr["Z"][nowhere]).all()
    assert np.isnan(exr["P.X"][nowhere]).all()
    # A pixel has all of its 16 paths unless the rim cuts it.
    assert (exr["Samples"][from_rim_px < -0.71] == 16).all()
    assert (exr["Samples"][nowhere] == 0).all()


def test_images_have_the_same_bytes_on_one_thread(dataset, tmp_path):
    """TBB starts one thread per processor that the process may use."""
    one = sorted(os.sched_getaffinity(0))[:1]
    result = generate(tmp_path, ALL, preexec_fn=lambda: os.sched_setaffinity(0, one))
    assert result.returncode == 0, result.stderr
    assert files(tmp_path / "out") == files(dataset)


def test_a_killed_run_with_cameras_resumes_to_the_same_bytes(dataset, tmp_path):
    for name, text in (("scene", ALL), ("camera", CAMERA)):
        (tmp_path / f"{name}.yaml").write_text(text)
    out = tmp_path / "out"
    command = [PROGRAM, "generate", "scene.yaml", "-o", out]
    run = subprocess.Popen(command, stderr=subprocess.DEVNULL, cwd=tmp_path)
    deadline = time.monotonic() + 60
    while not (out / "camera/front/000000.exr").exists() and time.monotonic() < deadline:
        time.sleep(0.002)
    run.send_signal(signal.SIGKILL)
    run.wait()
    (out / "camera/front/000000_top.npy").unlink()  # an image is done when all of it is there
    result = generate(tmp_path, ALL, more=["--resume"])
    assert result.returncode == 0, result.stderr
    assert "1 scans already existed" in result.stdout  # the first frame of each sensor comes first
    assert files(out) == files(dataset)
    again = generate(tmp_path, ALL, more=["--resume"])
    assert "2 images already existed" in again.stdout
    assert files(out) == files(dataset)


def test_an_interrupt_stops_a_long_image_between_its_rows(tmp_path):
    """The image would take 25 million paths: half a minute."""
    long = ALL.replace("{samples: 4, most_samples: 16, relative_error: 0.1}", "{samples: 8192}")
    for name, text in (("scene", long), ("camera", CAMERA)):
        (tmp_path / f"{name}.yaml").write_text(text)
    out = tmp_path / "out"
    command = [PROGRAM, "generate", "scene.yaml", "-o", out]
    run = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    deadline = time.monotonic() + 60
    last = out / "lidar/top/000000.ply"  # the last file before the image's light
    while not last.exists() and time.monotonic() < deadline:
        time.sleep(0.005)
    time.sleep(0.5)
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=60)
    assert run.returncode == 130, said
    assert not [p for p in out.glob("camera/*/*") if p.is_file()]
    states = [f["state"] for f in yaml.safe_load((out / "dataset.yaml").read_text())["frames"]]
    assert "done" in states
    assert "pending" in states


def test_a_folder_of_another_lens_is_kept(dataset, tmp_path):
    assert generate(tmp_path, ALL).returncode == 0
    before = files(tmp_path / "out")
    result = generate(tmp_path, ALL, CAMERA.replace("[52, 51]", "[52, 52]"))
    assert result.returncode == 1
    assert "another scene" in result.stderr
    assert files(tmp_path / "out") == before


def test_previews_show_all_panels(dataset):
    preview = cv2.imread(str(dataset / "camera/front/000000_preview.png"))
    assert preview.shape == (2 * 48 + 8, 2 * 64 + 8, 3)
    for rows in (slice(0, 48), slice(56, 104)):
        for columns in (slice(0, 64), slice(72, 136)):
            assert len(np.unique(preview[rows, columns].reshape(-1, 3), axis=0)) >= 3


def test_info_describes_cameras(tmp_path):
    (tmp_path / "camera.yaml").write_text(CAMERA)
    (tmp_path / "scene.yaml").write_text(ALL)
    command = [PROGRAM, "info", "scene.yaml"]
    said = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path).stdout
    for words in ("sun       elevation", "front: A small camera, 2 images of 64 x 48 px in 1 ms",
                  "4 to 16 paths a pixel", "0.0123 M paths"):  # fmt: skip
        assert words in said, said


TRIGGER = "{lidar: top, delay_ms: 20}"
FOCAL = "focal_px: [52, 51]"


@pytest.mark.parametrize(
    ("scene", "camera", "words"),
    [
        (ALL.replace(LIGHT, ""), CAMERA, "key 'sky': missing, but the camera 'front' measures"),
        (ALL.replace(", material: dry_soil", ""), CAMERA, "must have a material"),
        (ALL.replace("project: [top]", "project: [tip]"), CAMERA, "did you mean 'top'?"),
        (ALL.replace(TRIGGER, "{lidar: tip}"), CAMERA, "did you mean 'top'?"),
        (SCENE + LIT, CAMERA, "the scene has no lidar"),
        (ALL.replace("delay_ms: 20", "delay_ms: 500"), CAMERA, "begins and ends within the run"),
        (ALL, CAMERA.replace("exposure_ms: 1", "exposure_ms: 0"), "'exposure_ms': is 0, but must"),
        (ALL, CAMERA.replace("exposure_ms: 1", "exposure_ms: 101"), "triggered again after 100"),
        (ALL, CAMERA.replace("[64, 48]", "[40000, 25000]"), "alone would take 67.1 GiB"),
        (ALL, CAMERA.replace("[64, 48]", "[0, 48]"), "'size_px': is 0, but must be > 0"),
        (ALL, CAMERA.replace("[64, 48]", "[2, 48]"), "a mosaic needs at least 3 x 3 px"),
        (ALL, CAMERA.replace(FOCAL, "focal_px: [0, 51]"), "'focal_px': is 0, but must be > 0"),
        (ALL, CAMERA.replace("-0.002]", "-0.002, 0, 1]"), "has 6 numbers"),
        (ALL.replace("[1, 0, 1.2]", "[1, 0, -2]"), CAMERA, "below the ground"),
        (ALL.replace("f_number: 4", "f_number: 4, focal_length_mm: 5"), CAMERA, "does not fit"),
        (SCENE + PAIR.replace("yaw_deg: 3", "yaw_deg: 180"), CAMERA, "the cameras is 180.0 deg"),
        (SCENE + PAIR.replace("left: left, right: right", "left: right, right: left"), CAMERA,
         "are they swapped"),
        (SCENE + PAIR + "  - {name: again, left: left, right: right}\n", CAMERA,
         "camera 'left' is also in an earlier pair"),
    ],
)  # fmt: skip
def test_camera_errors_are_reported_before_anything_is_written(tmp_path, scene, camera, words):
    assert (scene, camera) != (ALL, CAMERA)
    result = generate(tmp_path, scene, camera)
    assert result.returncode == 1, result.stderr
    assert result.stderr.startswith("groundray: ")
    assert words in result.stderr
    assert len(result.stderr.splitlines()) <= 3
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    result = generate(tmp_path, ALL, out="file/out")
    assert result.returncode == 1
    assert "file/out: cannot create this folder" in result.stderr


def test_a_full_disk_leaves_no_partial_image(tmp_path):
    """A limit on file size makes the EXR file fail while it is written, as a full disk does."""
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))  # noqa: E731
    scene = (SCENE + PAIR).replace(LIGHT, "")
    result = generate(tmp_path, scene, CAMERA.replace("[64, 48]", "[320, 240]"), preexec_fn=limit)
    assert result.returncode == 1
    assert "000000.exr" in result.stderr
    assert not [p for p in (tmp_path / "out/camera/left").iterdir() if p.suffix != ".png"]
