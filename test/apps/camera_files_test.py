"""Images and their other files, read by OpenEXR, OpenCV, NumPy and PyYAML.

One run of a lidar and two cameras that move past a vehicle, a rock and grass: `left` has a
distorting lens, all products and the lidar's trigger, `eye` is a fisheye that sees beyond 90
degrees with a rolling shutter.
"""

import math
import os
import subprocess
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest
import yaml
from plyfile import PlyData

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))

LEFT = """\
groundray_camera: 1
model: A small camera
size_px: [64, 48]
lens:
  brown_conrady:
    focal_px: [52, 51]
    centre_px: [31.2, 23.9]
    coefficients: [-0.2, 0.04, 0.001, -0.002, 0.003]
shutter: {exposure_ms: 1}
aperture: {f_number: 4}
imager:
  pixel_pitch_um: 5
  filter: rggb
  quantum_efficiency: [0.45, 0.6, 0.5]
  full_well_e: 10000
  read_noise_e: 5
  gain_dn_e: 0.4
  black_dn: 64
  bits: 12
products: [radiance, truth, bound, flow, flow_flo, flow_kitti, coverage, irradiance, photons,
           electrons, raw, picture]
"""
EYE = """\
groundray_camera: 1
model: A small fisheye
size_px: [60, 60]
lens:
  kannala_brandt:
    focal_px: [20, 20]
    centre_px: [29.5, 29.5]
    coefficients: [-0.012, 0.0008, -0.0001, 0]
rate_hz: 10
first_ms: 10
shutter: {exposure_ms: 2, row_us: 300}
products: [truth, flow]
"""
SCENE = f"""\
groundray: 1
seed: 7
duration_s: 0.3
terrain: {{dem: {ROOT / "data/terrain/prairie_1m.tif"}, material: dry_soil}}
sky:
  analytic: {{}}
  sun: {{utc: 2026-06-21T16:30:00Z, latitude_deg: 46.506, longitude_deg: -93.92}}
platform:
  drive:
    waypoints_m: [[429440, 5150660], [429448, 5150668], [429456, 5150671], [429470, 5150676]]
    speed_m_s: 10
    height_m: 0.5
objects:
  - {{name: rock, label: 4, asset: rock, size_m: 2, at_m: [429446, 5150670], stance: on_slope}}
  - name: car
    label: 10
    asset: vehicle
    drive: {{waypoints_m: [[429450, 5150665], [429470, 5150674]], speed_m_s: 9, height_m: 0}}
scatter:
  - {{name: grass, label: 2, density_per_m2: 0.1, models: [{{asset: grass_tuft}}]}}
lidars:
  - {{name: top, preset: velodyne_vlp16, mount: {{translation_m: [0, 0, 1.5], pitch_deg: 3}}}}
cameras:
  - name: left
    file: left.yaml
    mount: {{translation_m: [1, 0.1, 1.2], pitch_deg: 8}}
    trigger: {{lidar: top, delay_ms: 20}}
    project: [top]
  - name: eye
    file: eye.yaml
    mount: {{translation_m: [0, 0, 1.6], pitch_deg: 20}}
    project: [top]
"""

XYZ, RGB = ("X", "Y", "Z"), ("R", "G", "B")
VECTORS = [f"{name}.{axis}" for name in ("P", "N", "Ns", "Velocity") for axis in XYZ]
TRUTH = {"Z", "Distance", "Incidence", *VECTORS, *(f"Albedo.{c}" for c in RGB)}
IDS = {"Valid", "Label", "Instance", "Material"}
LIGHT = {*RGB, *(f"StdError.{c}" for c in RGB), "Samples"}
COVERAGE = {f"Coverage.{label}" for label in (0, 1, 2, 4, 10)}
EXPOSURE_S, ROW_S = {"left": 0.001, "eye": 0.002}, {"left": 0, "eye": 0.0003}


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cameras")
    for name, text in (("left", LEFT), ("eye", EYE), ("scene", SCENE)):
        (folder / f"{name}.yaml").write_text(text)
    command = [PROGRAM, "generate", folder / "scene.yaml", "-o", folder / "out"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stderr
    return folder / "out"


class Exr:
    def __init__(self, path):
        with OpenEXR.File(str(path), separate_channels=True) as file:
            self.header = dict(file.header())
            self.channels = {name: c.pixels.copy() for name, c in file.channels().items()}

    def __getitem__(self, name):
        return self.channels[name]

    def stack(self, name, parts=XYZ):
        return np.stack([self[f"{name}.{part}"].astype(float) for part in parts], axis=-1)


def image(out, camera, number):
    return Exr(out / f"camera/{camera}/{number:06}.exr")


def picture(out, suffix, number=1, camera="left"):
    """Returns channels in the file's order; OpenCV reverses them."""
    pixels = cv2.imread(str(out / f"camera/{camera}/{number:06}{suffix}"), cv2.IMREAD_UNCHANGED)
    return pixels if pixels.ndim == 2 else pixels[:, :, ::-1]


def record(out):
    return yaml.safe_load((out / "dataset.yaml").read_text())


def begin_s(out, sensor, number):
    frames = record(out)["frames"]
    return next(f["stamp_s"] for f in frames if (f["sensor"], f["frame"]) == (sensor, number))


def matrix(rotation, translation):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = rotation, translation
    return X


def rotation_of(q):
    x, y, z, w = q
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * K + 2 * K @ K


def quaternion_of(turn):
    angle = np.linalg.norm(turn)
    return [*(np.sinc(angle / 2 / math.pi) / 2 * turn), math.cos(angle / 2)]


def turn_of(R):
    """Axis times angle of a turn below 90 degrees; OpenCV's drops those below 1e-5."""
    twice = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = np.linalg.norm(twice) / 2
    return twice / 2 * (math.asin(sine) / sine if sine > 0 else 1)


class PosePath:
    """A pose file, interpolated by constant twists between its rows: X_DC at any time."""

    def __init__(self, file):
        rows = np.loadtxt(file)
        self.times = rows[:, 0]
        self.poses = [matrix(rotation_of(row[4:8]), row[1:4]) for row in rows]

    def at(self, time_s):
        i = np.clip(np.searchsorted(self.times, time_s, side="right") - 1, 0, len(self.times) - 2)
        share = (time_s - self.times[i]) / (self.times[i + 1] - self.times[i])
        step = np.linalg.inv(self.poses[i]) @ self.poses[i + 1]
        turn = turn_of(step[:3, :3])
        way = np.linalg.solve(self.spread(turn), step[:3, 3])
        part = matrix(
            rotation_of(quaternion_of(share * turn)), self.spread(share * turn) @ (share * way)
        )
        return self.poses[i] @ part

    @staticmethod
    def spread(turn):
        """Returns the integral of a constant twist's rotation, which acts on its velocity."""
        angle = np.linalg.norm(turn)
        if angle < 1e-9:
            return np.eye(3)
        x, y, z = turn
        K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return (
            np.eye(3)
            + (1 - math.cos(angle)) / angle**2 * K
            + (angle - math.sin(angle)) / angle**3 * K @ K
        )


class Camera:
    """A camera as other software sees it: its ROS calibration and its pose file."""

    def __init__(self, out, name):
        info = yaml.safe_load((out / f"calibration/{name}.ros.yaml").read_text())
        self.K = np.reshape(info["camera_matrix"]["data"], (3, 3))
        self.D = np.array(info["distortion_coefficients"]["data"])
        self.model = info["distortion_model"]
        self.size = info["image_width"], info["image_height"]
        self.path = PosePath(out / f"poses/{name}.tum")
        self.out, self.name = out, name

    def time_of(self, number, row):
        """The middle of a row's exposure; rows beyond the image are its first and last."""
        row = np.clip(row, 0, self.size[1] - 1)
        return (
            begin_s(self.out, self.name, number)
            + ROW_S[self.name] * row
            + (EXPOSURE_S[self.name] / 2)
        )

    def in_camera(self, points, times):
        """Points of D (n x 3) in C, each at its own time."""
        poses = {t: np.linalg.inv(self.path.at(t)) for t in np.unique(times)}
        X_CD = np.array([poses[t] for t in times]).reshape(-1, 4, 4)
        return np.einsum("nij,nj->ni", X_CD[:, :3, :3], points) + X_CD[:, :3, 3]

    def project(self, points_C):
        if self.model == "plumb_bob":
            zero = np.zeros(3)
            return cv2.projectPoints(points_C, zero, zero, self.K, self.D)[0].reshape(-1, 2)
        assert self.model == "equidistant"
        beside = np.linalg.norm(points_C[:, :2], axis=1)
        theta = np.arctan2(beside, points_C[:, 2])  # also beyond 90 degrees
        powers = theta[:, None] ** (2 * np.arange(1, 5))
        reach = theta * (1 + powers @ self.D)
        flat = points_C[:, :2] * (reach / beside)[:, None]
        return flat * self.K[[0, 1], [0, 1]] + self.K[:2, 2]

    def pixels(self):
        """(u, v) of all pixels, row by row."""
        u, v = np.meshgrid(np.arange(self.size[0]), np.arange(self.size[1]))
        return np.stack([u.ravel(), v.ravel()], axis=1).astype(float)


CAMERAS = ("left", "eye")


def rounding_px(camera, exr, hit):
    """P is of floats: below 512 m each coordinate is known to 1.6e-5 m. Twice f is more than any
    pixel's change by an angle here; poses and lenses are known to 1e-6 px."""
    assert np.abs(exr.stack("P")[hit]).max() < 512
    return 2 * camera.K[0, 0] * math.sqrt(3) * 1.6e-5 / exr["Distance"][hit].astype(float) + 1e-6


def around(values, uv):
    """Returns the minimum and maximum of the 3 x 3 pixels around each position."""
    u, v = np.rint(uv).astype(int).T
    padded = np.pad(values, 1, mode="edge")
    each = np.stack([padded[v + i, u + j] for i in range(3) for j in range(3)])
    return each.min(axis=0), each.max(axis=0)


def test_exactly_the_documented_files_are_written(out):
    of_images = {
        "left": (".exr .flo .png _electrons.exr _exposure.yaml _flow.png _irradiance.exr"
                 " _photons.exr _preview.png _raw.png _top.npy"),
        "eye": ".exr _preview.png _top.npy",
    }  # fmt: skip
    expected = {"dataset.yaml", "calibration/left.ros.yaml", "calibration/eye.ros.yaml"}
    expected |= {"calibration/eye.kalibr.yaml"}  # Kalibr's radtan has no fifth coefficient
    for name in ("top", *CAMERAS):
        expected |= {f"poses/{name}.tum", f"calibration/{name}.yaml"}
    for k in range(3):
        expected |= {f"lidar/top/{k:06}.ply", f"lidar/top/{k:06}_preview.png"}
        for name, suffixes in of_images.items():
            expected |= {f"camera/{name}/{k:06}{suffix}" for suffix in suffixes.split()}
    assert {str(p.relative_to(out)) for p in out.rglob("*") if p.is_file()} == expected


def test_channels_have_the_documented_names_and_types(out):
    forward = {"FlowForward.u", "FlowForward.v", "FlowForward.seen"}
    backward = {name.replace("Forward", "Backward") for name in forward}
    flows = (forward, forward | backward, backward)
    for k in range(3):
        left, eye = image(out, "left", k), image(out, "eye", k)
        assert set(left.channels) == TRUTH | IDS | LIGHT | COVERAGE | {"Bound"} | flows[k]
        assert set(eye.channels) == TRUTH | IDS | flows[k]
        for exr, shape in ((left, (48, 64)), (eye, (60, 60))):
            for name, pixels in exr.channels.items():
                whole = name in IDS or name.endswith(".seen")
                assert pixels.dtype == (np.uint32 if whole else np.float32), name
                assert pixels.shape == shape


def test_attributes_describe_light_and_pose(out):
    for name in CAMERAS:
        camera, header = Camera(out, name), image(out, name, 1).header
        assert header["compression"] == OpenEXR.ZIP_COMPRESSION
        assert header["expTime"] == pytest.approx(EXPOSURE_S[name])
        assert header["whiteLuminance"] == 683
        assert header["pixelCentres"] == "whole"
        assert header["radianceUnit"].startswith("W/(m^2 sr)")
        assert header["cameraModel"].startswith("A small")
        assert ("aperture" in header) == (name == "left")
        # Floats, the largest of them 400 m.
        X_CD = np.linalg.inv(camera.path.at(camera.time_of(1, (camera.size[1] - 1) / 2)))
        reported = np.reshape(header["worldToCamera"], (4, 4)).T
        assert reported == pytest.approx(X_CD, abs=4e-5)


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("number", [0, 1, 2])
def test_points_project_to_the_centres_of_their_pixels(out, name, number):
    camera, exr = Camera(out, name), image(out, name, number)
    hit = np.isfinite(exr["Z"])
    assert 0.3 < hit.mean() < 0.95
    pixels = camera.pixels()[hit.ravel()]
    points_C = camera.in_camera(exr.stack("P")[hit], camera.time_of(number, pixels[:, 1]))
    away_px = np.linalg.norm(camera.project(points_C) - pixels, axis=1)
    assert (away_px < rounding_px(camera, exr, hit)).all()
    # 2.8e-5 m of the point; Z and Distance are floats too.
    assert np.abs(points_C[:, 2] - exr["Z"][hit]).max() < 6e-5
    assert np.abs(np.linalg.norm(points_C, axis=1) - exr["Distance"][hit]).max() < 6e-5
    if name == "eye":
        assert exr["Z"][hit].min() < 0  # it sees beyond 90 degrees


def test_depth_is_distance_times_the_cosine_to_the_axis(out):
    camera, exr = Camera(out, "left"), image(out, "left", 1)
    exactly = (cv2.TERM_CRITERIA_MAX_ITER, 100, 0)
    flat = cv2.undistortPoints(camera.pixels(), camera.K, camera.D, criteria=exactly)
    share = 1 / np.sqrt(1 + (flat.reshape(48, 64, 2) ** 2).sum(axis=2))
    hit = np.isfinite(exr["Z"])
    # Two floats, of half an ulp each.
    assert exr["Z"][hit] == pytest.approx((exr["Distance"] * share)[hit], rel=2e-7)


@pytest.mark.parametrize("name", CAMERAS)
def test_normals_face_the_camera_at_the_recorded_incidence(out, name):
    camera, exr = Camera(out, name), image(out, name, 0)
    hit = np.isfinite(exr["Z"])
    times = camera.time_of(0, camera.pixels()[hit.ravel()][:, 1])
    eyes = {t: camera.path.at(t)[:3, 3] for t in np.unique(times)}
    back = np.array([eyes[t] for t in times]) - exr.stack("P")[hit]
    normal = exr.stack("N")[hit]
    across = np.linalg.norm(np.cross(back, normal), axis=1)
    angle = np.arctan2(across, (back * normal).sum(axis=1))
    assert np.abs(angle - exr["Incidence"][hit]).max() < 4e-5  # P again: 2.8e-5 m, 1 m away
    assert np.abs(np.linalg.norm(normal, axis=1) - 1).max() < 2e-7
    assert np.abs(np.linalg.norm(exr.stack("Ns")[hit], axis=1) - 1).max() < 2e-7


def test_sky_pixels_have_the_documented_values(out):
    for name in CAMERAS:
        exr = image(out, name, 1)
        sky = np.isinf(exr["Z"])
        assert (exr["Valid"] == 1).all()
        assert np.isinf(exr["Distance"][sky]).all()
        for channel in [*VECTORS, *(f"Albedo.{c}" for c in RGB), "Incidence"]:
            known = channel.startswith("Velocity")
            assert (exr[channel][sky] == 0).all() if known else np.isnan(exr[channel][sky]).all()
            assert np.isfinite(exr[channel][~sky]).all(), channel
        for channel in ("Label", "Instance", "Material"):
            assert (exr[channel][sky] == 0).all()
        assert (exr["Material"][~sky] > 0).all()
    # At full resolution the traced surface is the reference: ranges have their accuracy.
    exr = image(out, "left", 1)
    accuracy_m = np.where(np.isinf(exr["Distance"]), 0, 1e-9 * exr["Distance"] + 1e-9)
    np.testing.assert_allclose(exr["Bound"], accuracy_m, rtol=2.4e-7)  # of two floats


@pytest.mark.parametrize("name", CAMERAS)
def test_ids_match_the_dataset_record(out, name):
    reported, exr = record(out), image(out, name, 1)
    hit = np.isfinite(exr["Z"])
    label = np.where(hit, 1, 0)
    for thing in reported["objects"]:
        first, count = thing["first_instance"], thing["count"]
        label[(exr["Instance"] >= first) & (exr["Instance"] < first + count)] = thing["label"]
    assert (exr["Label"] == label).all()
    assert set(np.unique(label)) >= {0, 1, 10}
    materials = np.array(["", *reported["materials"]])[exr["Material"]]
    assert (materials[label == 1] == "dry_soil").all()
    assert set(materials[label == 2]) <= {"dry_grass"}
    assert set(materials[label == 10]) <= {"metal", "asphalt", "retro_reflector"}
    speed_m_s = np.linalg.norm(exr.stack("Velocity"), axis=2)
    assert (speed_m_s[label != 10] == 0).all()
    # At 9 m/s the car pitches and rolls on rough ground: parts of it are slower or faster.
    assert (np.abs(speed_m_s[label == 10] - 9) < 2).all()


def test_coverage_sums_to_one_and_agrees_with_labels(out):
    exr = image(out, "left", 1)
    cover = {label: exr[f"Coverage.{label}"] for label in (0, 1, 2, 4, 10)}
    assert (sum(cover.values()) == 1).all()  # sixteenths are exact
    for label, share in cover.items():
        alone = share == 1
        assert set(exr["Label"][alone]) <= {label, 2}  # a blade may pass all paths by
        if label != 2:
            assert (share[exr["Label"] == label] > 0).mean() > 0.98


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize(("way", "other"), [("Forward", 2), ("Backward", 0)])
def test_flow_leads_to_the_same_point_in_other_images(out, name, way, other):
    camera, exr, beside = Camera(out, name), image(out, name, 1), image(out, name, other)
    stands = np.isfinite(exr["Z"]) & (exr["Label"] != 10) & np.isfinite(exr[f"Flow{way}.u"])
    flow = exr.stack(f"Flow{way}", ("u", "v"))[stands]
    there = camera.pixels()[stands.ravel()] + flow
    points_C = camera.in_camera(exr.stack("P")[stands], camera.time_of(other, there[:, 1]))
    near_m = np.linalg.norm(points_C, axis=1)
    allowed_px = rounding_px(camera, exr, stands) * np.maximum(exr["Distance"][stands] / near_m, 1)
    allowed_px += 6e-8 * np.abs(flow).max()
    assert (np.linalg.norm(camera.project(points_C) - there, axis=1) < allowed_px).all()
    seen = exr[f"Flow{way}.seen"][stands] == 1
    inside = ((there >= -0.5) & (there < np.array(camera.size) - 0.5)).all(axis=1)
    assert not (seen & ~inside).any()
    # What is seen is as near as the other image's depths round there, but for thin grass.
    low, high = around(beside["Distance"], there[inside])
    fits = (near_m[inside] > 0.99 * low) & (near_m[inside] < 1.01 * high)
    assert fits[seen[inside]].mean() > 0.99
    hidden = ~seen[inside]
    assert (near_m[inside][hidden] > 0.95 * low[hidden]).all()


def test_flow_files_contain_the_flow(out):
    for number in range(3):
        flo = cv2.readOpticalFlow(str(out / f"camera/left/{number:06}.flo"))
        kitti = picture(out, "_flow.png", number)
        if number == 2:  # nothing comes after it
            assert (flo == np.float32(1e10)).all()
            assert (kitti == 0).all()
            continue
        exr = image(out, "left", number)
        flow = np.stack([exr["FlowForward.u"], exr["FlowForward.v"]], axis=-1)
        known = np.isfinite(flow).all(axis=2)
        assert known.mean() > 0.5
        assert (flo[known] == flow[known]).all()
        assert (flo[~known] == np.float32(1e10)).all()
        assert kitti.dtype == np.uint16
        assert (kitti[:, :, 2] == known).all()
        assert (kitti[:, :, :2][known] == np.rint(64 * flow[known].astype(float)) + 2**15).all()
        assert (kitti[~known] == 0).all()


def test_light_is_converted_to_photons_electrons_numbers_and_a_picture(out):
    stem = out / "camera/left/000001"
    radiance = image(out, "left", 1)
    irradiance, photons, electrons = (
        Exr(f"{stem}_{name}.exr") for name in ("irradiance", "photons", "electrons")
    )
    assert set(irradiance.channels) == set(RGB)
    assert set(photons.channels) == set(electrons.channels) == {"Y"}
    ratio = irradiance["G"] / radiance["G"]
    for channel in "RB":
        assert irradiance[channel] == pytest.approx(ratio * radiance[channel], rel=3e-7)
    # pi / (4 N^2) on the axis, which is within 0.3 px of this pixel of f = 52 px.
    assert ratio[24, 31] == pytest.approx(math.pi / 64, rel=1e-4)
    v, u = np.indices((48, 64))
    filters = (v % 2 + u % 2)[None] == np.arange(3)[:, None, None]  # rggb
    E = sum(irradiance[c] * mask for c, mask in zip(RGB, filters, strict=True))
    per_photon_j = 6.62607015e-34 * 299_792_458 / 555e-9
    assert photons["Y"] == pytest.approx(E * (5e-6) ** 2 * 0.001 / per_photon_j, rel=3e-7)
    N = electrons["Y"].astype(float)
    assert (np.rint(N) == N).all()
    assert 0 < N.min() < N.max() == 10000
    mean = sum(eta * mask for eta, mask in zip((0.45, 0.6, 0.5), filters, strict=True))
    mean = mean * photons["Y"]
    free = mean < 9000  # ten deviations below the full well
    assert free.mean() > 0.2
    # Poisson: sum and chi-square, each within 3.3 deviations (0.1 %, and the seed is fixed).
    z = (N - mean)[free] / np.sqrt(mean[free])
    assert abs(z.sum()) < 3.3 * math.sqrt(z.size)
    assert abs((z**2).sum() - z.size) < 3.3 * math.sqrt(2 * z.size)
    raw = picture(out, "_raw.png")
    assert (raw.dtype, raw.shape) == (np.uint16, (48, 64))
    # 5 e- of reading are 2 DN; of 3072 normal numbers none is beyond 5.5 deviations.
    assert np.abs(raw - (0.4 * N + 64)).max() < 5.5 * 2 + 0.5
    shown = picture(out, ".png")
    assert (shown.dtype, shown.shape) == (np.uint8, (48, 64, 3))
    linear = cv2.cvtColor(raw << 4, cv2.COLOR_BayerBG2RGB) / 16.0  # OpenCV's name of rggb
    linear = np.clip((linear - 64) / 4000 * 0.6 / np.array([0.45, 0.6, 0.5]), 0, 1)
    code = 255 * np.where(linear > 0.0031308, 1.055 * linear ** (1 / 2.4) - 0.055, 12.92 * linear)
    assert np.abs(shown - code)[1:-1, 1:-1].max() < 0.51


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("number", [0, 2])
def test_echoes_are_listed_at_the_pixels_that_the_lens_projects_to(out, name, number):
    camera, exr = Camera(out, name), image(out, name, number)
    scan = PlyData.read(out / f"lidar/top/{number:06}.ply")["vertex"].data
    found = np.load(out / f"camera/{name}/{number:06}_top.npy")
    assert (np.diff(found["echo"].astype(int)) > 0).all()
    uv = np.stack([found["u_px"], found["v_px"]], axis=1)
    inside = ((uv >= -0.5) & (uv < np.array(camera.size) - 0.5)).all(axis=1)
    assert (found["is_inside"] == inside).all()
    assert inside.sum() > 800
    # The car's points go on until their row sees them; a few hundred others will do.
    some = np.flatnonzero(inside & (scan["label"][found["echo"]] != 10))[::7]
    points = np.stack([scan[f"world_{a}"][found["echo"][some]] for a in "xyz"], axis=1)
    points_C = camera.in_camera(points, camera.time_of(number, uv[some, 1]))
    assert np.abs(camera.project(points_C) - uv[some]).max() < 1e-6
    assert np.abs(points_C[:, 2] - found["depth_m"][some]).max() < 1e-7
    visible = found["is_visible"][inside] == 1
    assert (found["is_visible"] <= found["is_inside"]).all()
    # The image's own truth, away from silhouettes: all nine pixels round there show one thing.
    low, high = around(exr["Z"], uv[inside])
    one = np.equal(*around(exr["Instance"], uv[inside]))
    depth_m, slack_m = found["depth_m"][inside], 0.03 * around(exr["Distance"], uv[inside])[0]
    near = (depth_m > low - slack_m) & (depth_m < high + slack_m)
    assert one.mean() > 0.5
    assert near[one & visible].mean() > 0.99
    # Ground behind a crest that is lower than a pixel, or behind a blade, is hidden.
    assert visible[one & near].mean() > 0.95
    behind = one & (depth_m > high + 0.3 * abs(high))
    assert (visible & behind).sum() <= 0.02 * behind.sum()


def test_images_triggered_by_a_lidar_are_synchronised_with_it(out):
    for number in range(3):
        stamp_s = begin_s(out, "top", number)
        assert begin_s(out, "left", number) == pytest.approx(stamp_s + 0.02, abs=1e-9)
        assert begin_s(out, "eye", number) == pytest.approx(0.01 + 0.1 * number, abs=1e-9)


def test_cameras_are_mounted_where_the_scene_says(out):
    mounts = {}
    for name, key in (("top", "X_BS"), ("left", "X_BC"), ("eye", "X_BC")):
        mount = yaml.safe_load((out / f"calibration/{name}.yaml").read_text())[key]
        mounts[name] = matrix(rotation_of(mount["rotation_xyzw"]), mount["translation_m"])
    # Pitched 8 degrees down: x goes right, z ahead and down.
    s, c = math.sin(math.radians(8)), math.cos(math.radians(8))
    axes = np.array([[0, -s, c], [-1, 0, 0], [0, -c, -s]])
    assert mounts["left"] == pytest.approx(matrix(axes, [1, 0.1, 1.2]), abs=1e-15)
    top = PosePath(out / "poses/top.tum")
    for name in CAMERAS:
        X_SC = np.linalg.inv(mounts["top"]) @ mounts[name]
        path = PosePath(out / f"poses/{name}.tum")
        assert (path.times == top.times).all()
        for X_DS, X_DC in zip(top.poses, path.poses, strict=True):
            assert np.abs(X_DS @ X_SC - X_DC).max() < 1e-12


def test_calibrations_are_readable_by_other_software(out):
    file = cv2.FileStorage(str(out / "calibration/left.ros.yaml"), cv2.FILE_STORAGE_READ)
    assert [file.getNode(f"image_{side}").real() for side in ("width", "height")] == [64, 48]
    kalibr = yaml.safe_load((out / "calibration/eye.kalibr.yaml").read_text())["cam0"]
    assert (kalibr["camera_model"], kalibr["distortion_model"]) == ("pinhole", "equidistant")
    assert kalibr["intrinsics"] == [20, 20, 29.5, 29.5]
    assert kalibr["distortion_coeffs"] == [-0.012, 0.0008, -0.0001, 0]
    assert kalibr["resolution"] == [60, 60]
    assert yaml.safe_load((out / "calibration/eye.yaml").read_text())["camera_file"] == EYE
