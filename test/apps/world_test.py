"""Scenes with objects and textures, shipped and small ones, read by NumPy and plyfile."""

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
import yaml
from plyfile import PlyData

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))
SHIPPED = ROOT / "data/scenes/offroad_trail.yaml"
SCENE = SHIPPED.read_text().partition("\ncameras:\n")[0] + "\n"  # what lidars see of it


def run(command, scene, folder, *options):
    text = scene.replace(": ../", f": {ROOT / 'data'}/")
    text = text.replace("file: rosette", f"file: {ROOT / 'data/scenes/rosette'}")
    text = re.sub(r"^duration_s: .*", "duration_s: 0.1", text, flags=re.M)
    (folder / "scene.yaml").write_text(text)
    arguments = [PROGRAM, command, folder / "scene.yaml"]
    if command == "generate":
        arguments += ["-o", folder / "out"]
    arguments = [str(each) for each in (*arguments, *options)]
    return subprocess.run(arguments, capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="module")
def trail(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trail")
    result = run("generate", SCENE, folder)
    assert result.returncode == 0, result.stderr
    return folder / "out"


def test_instances_match_those_that_the_dataset_lists(trail):
    record = yaml.safe_load((trail / "dataset.yaml").read_text())
    firsts = [group["first_instance"] for group in record["objects"]]
    counts = [group["count"] for group in record["objects"]]
    assert sorted(firsts) == list(np.cumsum([1, *counts[:-1]]))
    for sensor in ("top", "front"):
        scan = PlyData.read(trail / f"lidar/{sensor}/000000.ply")["vertex"].data
        seen = set()
        for group in record["objects"]:
            first, count = group["first_instance"], group["count"]
            mine = (first <= scan["instance"]) & (scan["instance"] < first + count)
            assert (scan["label"][mine] == group["label"]).all()
            if mine.any():
                seen.add(group["name"])
        assert (scan["label"][scan["instance"] == 0] == 1).all()
        assert {"grass", "shrubs", "trees"} <= seen


def test_only_the_leader_moves(trail):
    scan = PlyData.read(trail / "lidar/top/000000.ply")["vertex"].data
    speed = np.linalg.norm([scan[c].astype(float) for c in ("vx", "vy", "vz")], axis=0)
    leader = scan["label"] == 10
    assert leader.sum() > 20
    assert (speed[~leader] == 0).all()
    in_plan = np.hypot(scan["vx"][leader], scan["vy"][leader])
    assert abs(np.median(in_plan) - 8) < 1  # m/s, as it drives; points turn with the body


def test_info_counts_the_objects(trail, tmp_path):
    record = yaml.safe_load((trail / "dataset.yaml").read_text())
    result = run("info", SCENE, tmp_path)
    assert result.returncode == 0, result.stderr
    for group in record["objects"]:
        assert f"{group['name']}: {group['count']} of label {group['label']}" in result.stdout


def test_shipped_scene_has_a_stereo_pair_and_a_fisheye():
    result = subprocess.run([PROGRAM, "info", SHIPPED], capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    for camera in ("left: Colour camera", "right: Colour camera", "fisheye: TUM VI"):
        assert f"camera    {camera}" in result.stdout


def test_a_laser_requires_materials(tmp_path):
    light = """    laser: {wavelength_nm: 905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}
    receiver: {aperture_mm: 20, threshold_w: 1.0e-8, timing: peak, returns: dual}
"""
    scene = SCENE.replace("    preset: velodyne_vlp16\n", "    preset: velodyne_vlp16\n" + light)
    result = run("generate", scene, tmp_path)
    assert result.returncode == 0, result.stderr
    scan = PlyData.read(tmp_path / "out/lidar/top/000000.ply")["vertex"].data
    assert {1, 2, 3, 5, 10} <= set(np.unique(scan["label"]))
    board = "    asset: calibration_board\n    square_m: 0.1\n"
    scene = re.sub(r"    asset: person_cylinder\n    material: dry_grass\n", board, scene)
    result = run("info", scene, tmp_path)
    assert result.returncode == 1
    assert "object 'person': its surface 'white_paint' has no material" in result.stderr


LIGHT = """
    beam: {profile: gaussian, divergence_mrad: [1, 1], aperture_mm: [10, 10], sub_rays: 16}
    laser: {wavelength_nm: 905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}
    receiver: {aperture_mm: 20, threshold_w: 1.0e-9, timing: peak,
               returns: strongest, intensity: reflectance}
"""

GROUND = f"""
groundray: 1
seed: 1
duration_s: 0.1
terrain:
  dem: ../terrain/prairie_1m.tif
  material: dry_soil
  label: 1
PLACE
platform:
  drive:
    waypoints_m: [[429450, 5150684], [429452, 5150684]]
    speed_m_s: 0.1
    height_m: 1
lidars:
  - name: top
    preset: velodyne_vlp16
    mount: {{translation_m: [0, 0, 1]}}
    range_noise_sigma_m: 0
{LIGHT}"""

# The DEM's square in UTM 15 N, west and east of x = 429452.3125 m.
CORNERS = ["429252.3125", "5150885.4252", "429652.3125", "5150485.4252"]


def geotiff(path, pixels, *options):
    """Writes pixels (H x W x bands, bytes) over all of the DEM, through GDAL."""
    rows, columns, bands = pixels.shape
    kind = {1: b"P5", 3: b"P6"}[bands]
    raw = path.with_suffix(".pnm")
    raw.write_bytes(b"%s\n%d %d\n255\n" % (kind, columns, rows) + pixels.tobytes())
    place = ["-a_srs", "EPSG:26915", "-a_ullr", *CORNERS]
    subprocess.run(["gdal_translate", "-q", *place, *options, raw, path], check=True)
    return path


def reflectances(folder):
    """Reflectance of the ground west and east of the middle by the lidar; labels; eastings."""
    scan = PlyData.read(folder / "out/lidar/top/000000.ply")["vertex"].data
    record = yaml.safe_load((folder / "out/dataset.yaml").read_text())
    east = scan["world_x"] + record["origin_w_m"][0] - 429452.3125
    matt = scan["intensity"] / np.cos(scan["incidence"])
    clear = (scan["share"] > 0.99) & (np.abs(east) > 1) & (np.cos(scan["incidence"]) > 0.2)
    return matt[clear & (east < 0)], matt[clear & (east > 0)], scan["label"], east


def test_an_orthophoto_in_another_crs_brightens_and_darkens_the_ground(tmp_path):
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:, :32], pixels[:, 32:] = 188, 137  # linear 0.502886 and 0.250158: IEC 61966-2-1
    photo = geotiff(tmp_path / "utm.tif", pixels)
    turned = tmp_path / "photo.tif"
    subprocess.run(["gdalwarp", "-q", "-t_srs", "EPSG:4326", photo, turned], check=True)
    scene = GROUND.replace("PLACE", f"  orthophoto: {turned}")
    result = run("generate", scene, tmp_path)
    assert result.returncode == 0, result.stderr
    west, east, _, _ = reflectances(tmp_path)
    assert len(west) > 100
    assert len(east) > 100
    ratio = np.median(west) / np.median(east)
    assert abs(ratio - 0.502886 / 0.250158) < 0.01  # pulses on slopes have longer, lower echoes


def test_a_mask_lays_gravel_over_soil(tmp_path):
    pixels = np.zeros((64, 64, 1), np.uint8)
    pixels[:, 32:] = 255
    mask = geotiff(tmp_path / "mask.tif", pixels)
    layer = f"  cover:\n    - {{material: gravel, label: 9, mask: {mask}, mask_full: 255}}"
    result = run("generate", GROUND.replace("PLACE", layer), tmp_path)
    assert result.returncode == 0, result.stderr
    west, east, label, side = reflectances(tmp_path)
    # Pixels of the mask are 6.25 m wide and linear between their centres.
    assert (label[side < -0.1] == 1).all()
    assert (label[side > 0.1] == 9).all()
    assert set(np.unique(label)) == {1, 9}
    assert abs(np.median(west) / np.median(east) - 1) > 0.05
    result = run("generate", GROUND.replace("PLACE", layer.replace("255", "1")), tmp_path)
    assert result.returncode == 1
    assert "cover, layer 1" in result.stderr
    assert "mask_full: 255" in result.stderr


def test_missing_images_of_the_ground_are_reported(tmp_path):
    for place in ("  orthophoto: none.tif", "  texture: {albedo: none.png, size_m: 1}"):
        result = run("generate", GROUND.replace("PLACE", place), tmp_path)
        assert result.returncode == 1
        assert "none." in result.stderr
        assert "no such file" in result.stderr.lower()
        assert not (tmp_path / "out").exists()


BARE = GROUND.replace("PLACE\n", "")


def refused(scene, folder, *words):
    """Checks that nothing is written and that one message contains all words."""
    for command in ("info", "generate"):
        result = run(command, scene, folder)
        assert result.returncode == 1, result.stdout
        for word in words:
            assert word in result.stderr
    assert not (folder / "out").exists()
    return True


def object_of(name, keys, label=5):
    return f"  - {{name: {name}, label: {label}, {keys}}}\n"


def test_the_forest_track_has_all_its_layers(tmp_path):
    """Also: the same bytes for any number of threads."""
    scene = (ROOT / "data/scenes/forest_track.yaml").read_text().partition("\ncameras:\n")[0]
    scans = []
    for threads in (1, 2):
        folder = tmp_path / str(threads)
        folder.mkdir()
        made = run("generate", scene + "\n", folder, "--threads", threads)
        assert made.returncode == 0, made.stderr
        scans.append((folder / "out/lidar/top/000000.ply").read_bytes())
    assert scans[0] == scans[1]
    scan = PlyData.read(folder / "out/lidar/top/000000.ply")["vertex"].data
    labels, counts = np.unique(scan["label"], return_counts=True)
    assert labels.tolist() == [1, 2, 3, 4, 5, 6]  # the ground, and each layer
    assert counts.min() > 10


def test_the_quarry_has_its_relief(tmp_path):
    scene = (ROOT / "data/scenes/quarry.yaml").read_text()
    for long, short in {"tolerance_mrad: 0.5": "tolerance_mrad: 2", "rays: 64": "rays: 16"}.items():
        assert long in scene
        scene = scene.replace(long, short)
    result = run("generate", scene, tmp_path)
    assert result.returncode == 0, result.stderr
    scan = PlyData.read(tmp_path / "out/lidar/mast/000000.ply")["vertex"].data
    assert (scan["label"] == 1).all()
    position = np.array([scan[c] for c in ("world_x", "world_y", "world_z")]).T
    # The DEM's facets are 75 m wide: what a plane leaves of the ground nearby is relief, of 8 cm
    # (rms) but for the waves that are longer than what is seen of it.
    near = (scan["range_true"] < 12) & (scan["second_share"] == 0)
    assert near.sum() > 300
    plane = np.column_stack([position[near, :2] - position[near, :2].mean(0), np.ones(near.sum())])
    height = position[near, 2]
    rest = height - plane @ np.linalg.lstsq(plane, height, rcond=None)[0]
    assert 0.04 < np.sqrt((rest**2).mean()) < 0.12


def test_info_describes_the_objects_of_a_scene(tmp_path):
    place = """  texture: {albedo: soil.png, size_m: 2}
  cover:
    - {material: gravel, label: 9, slope_deg: [10, 90]}"""
    pixels = np.full((8, 8, 3), 128, np.uint8)
    raw = tmp_path / "soil.pnm"
    raw.write_bytes(b"P6\n8 8\n255\n" + pixels.tobytes())
    subprocess.run(["gdal_translate", "-q", "-of", "PNG", raw, tmp_path / "soil.png"], check=True)
    scene = GROUND.replace("PLACE", place) + "objects:\n"
    scene += object_of("car", "asset: vehicle, at_m: [429460, 5150684]")
    scene += """sky:
  analytic: {}
  turbidity: 4
  sun: {azimuth_deg: 250, elevation_deg: 30}
"""
    result = run("info", scene, tmp_path)
    assert result.returncode == 0, result.stderr
    for line in (
        "cover     dry_soil of label 1, with images of 2 m",
        "cover     gravel of label 9",
        "objects   car: 1 of label 5, instances from 1",
        "models    1 of 1260 triangles for 1 objects",
        "materials dry_soil, gravel, metal, asphalt, retro_reflector",
        "sky       clear, turbidity 4",
        "sun       elevation 30.00, azimuth 250.00 degrees in W",
    ):
        assert line in result.stdout.splitlines(), result.stdout
    sunlight = re.search(r"sunlight (\S+) W/\(m2 nm\) at 905 nm, across its rays", result.stdout)
    assert 0.1 < float(sunlight[1]) < 0.9  # ASTM G173 has 0.64 at 42 degrees, in clearer air


def memory_mib(text):
    return float(re.search(r"memory +(\S+) MiB of objects", text)[1])


def test_equal_models_are_loaded_once(tmp_path):
    """Fifty trees take the memory of one, and each entry keeps its own label and material."""
    tree = "asset: conifer, detail: 16, at_m: [%d, 5150690]"
    one = BARE + "objects:\n" + object_of("tree", tree % 429440)
    first = run("info", one, tmp_path)
    assert first.returncode == 0, first.stderr
    more = [object_of(f"tree{k}", tree % (429440 + k)) for k in range(49)]
    layer = """scatter:
  - name: grove
    label: 8
    density_per_m2: 0.001
    models: [{asset: conifer, detail: 16}]
"""
    all_ = run("info", one + "".join(more) + layer, tmp_path)
    assert all_.returncode == 0, all_.stderr
    assert re.search(r"models    1 of \d+ triangles for \d+ objects", all_.stdout)
    # A placed object takes some 100 bytes, and as many in Embree.
    assert memory_mib(first.stdout) > 5
    assert memory_mib(all_.stdout) < memory_mib(first.stdout) + 0.2


def reflectance_at_905(name):
    spectrum = yaml.safe_load((ROOT / f"data/materials/{name}.yaml").read_text())["spectrum"]
    return np.interp(905, spectrum["wavelengths_nm"], spectrum["reflectances"])


def test_equal_models_have_the_materials_of_their_entries(tmp_path):
    board = "asset: calibration_board, size_m: 3, width_m: 3, yaw_deg: 180, at_m: [429458, %d]"
    scene = BARE + "objects:\n"
    scene += object_of("west", board % 5150687 + ", material: sand", 4)
    scene += object_of("east", board % 5150681 + ", material: gravel", 5)
    result = run("generate", scene, tmp_path)
    assert result.returncode == 0, result.stderr
    scan = PlyData.read(tmp_path / "out/lidar/top/000000.ply")["vertex"].data
    matt = scan["intensity"] / np.cos(scan["incidence"])
    seen = {}
    for label in (4, 5):
        whole = (scan["label"] == label) & (scan["share"] > 0.99)
        assert whole.sum() > 50
        seen[label] = np.median(matt[whole])
    # Pulses on slanted surfaces have lower echoes; the two are slanted alike.
    expected = reflectance_at_905("sand") / reflectance_at_905("gravel")
    assert seen[4] / seen[5] == pytest.approx(expected, rel=0.01)


def test_a_driven_object_moves_until_the_last_pulse(tmp_path):
    """Scanned from inside a moving ball; the last sweep ends 9.7 us after the run."""
    ball = """asset: sphere_target, size_m: 60, drive: {waypoints_m: [[429450, 5150684],
    [429460, 5150684]], speed_m_s: 5, height_m: 0}"""
    result = run("generate", BARE + "objects:\n" + object_of("ball", ball), tmp_path)
    assert result.returncode == 0, result.stderr
    scan = PlyData.read(tmp_path / "out/lidar/top/000000.ply")["vertex"].data
    mine = scan["instance"] == 1
    assert scan["time"][mine].max() > 0.1
    speed = np.linalg.norm([scan[c][mine].astype(float) for c in ("vx", "vy", "vz")], axis=0)
    assert speed.min() > 1


WALK = """drive: {waypoints_m: [[429454, %d], [429474, %d]], speed_m_s: %s, height_m: 0}"""


def test_walkers_are_one_instance_whose_limbs_move(tmp_path):
    """Parts share label and instance; the body moves while a foot stands."""
    scene = BARE + "objects:\n"
    scene += object_of("rock", "asset: rock, at_m: [429449, 5150686]", 4)
    for name, label, place in (("person", 5, 5150686), ("deer", 6, 5150681)):
        scene += object_of(name, f"asset: {name}, " + WALK % (place, place, 1.1), label)
    result = run("generate", scene, tmp_path)
    assert result.returncode == 0, result.stderr
    record = yaml.safe_load((tmp_path / "out/dataset.yaml").read_text())
    listed = {g["name"]: (g["first_instance"], g["count"]) for g in record["objects"]}
    assert listed == {"rock": (1, 1), "person": (2, 1), "deer": (3, 1)}
    scan = PlyData.read(tmp_path / "out/lidar/top/000000.ply")["vertex"].data
    assert set(np.unique(scan["instance"])) <= {0, 1, 2, 3}
    for instance, label in ((2, 5), (3, 6)):
        mine = scan["instance"] == instance
        assert mine.sum() > 100
        assert (scan["label"][mine] == label).all()
        speed = np.linalg.norm([scan[c][mine].astype(float) for c in ("vx", "vy", "vz")], axis=0)
        assert 0.9 < np.median(speed) < 1.3
        assert speed.min() < 0.6


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("asset: person, scale: 2, " + WALK % (5150686, 5150686, 1), "scale = 2 does not apply"),
        ("asset: deer, " + WALK % (5150686, 5150686, 1.9), "a deer of this size walks at up to"),
        ("asset: deer, size_m: 0, " + WALK % (5150686, 5150686, 1), "size_m"),
        ("asset: person, " + WALK % (5150686, 5150686, -1), "must be > 0"),
        ("asset: person, detail: 2, " + WALK % (5150686, 5150686, 1), "always has the same"),
        ("asset: person, material: fur, " + WALK % (5150686, 5150686, 1), "'fur'"),
        ("asset: deer, materials: {hair: bark}, " + WALK % (5150686, 5150686, 1), "fur, hoof"),
        (
            "asset: person, drive: {waypoints_m: [[429451, 5150686], [429451.05, 5150686]],"
            " speed_m_s: 1, height_m: 0}",
            "reduce the duration or the speed",
        ),
    ],
)
def test_walkers_that_cannot_walk_are_refused(tmp_path, keys, words):
    assert refused(BARE + "objects:\n" + object_of("walker", keys), tmp_path, words)


def test_the_times_of_a_recorded_object_must_overlap_the_run(tmp_path):
    scene = BARE + "objects:\n" + object_of("car", "asset: vehicle, trajectory: car.tum")

    def path(begin, end):
        rows = [f"{t} {429440 + t} 5150690 400 0 0 0 1\n" for t in (begin, end)]
        (tmp_path / "car.tum").write_text("".join(rows))

    path(7, 9)
    words = ["object 'car'", "car.tum", "covers 7.000 s to 9.000 s", "the run, 0.000 s to 0.100 s"]
    assert refused(scene, tmp_path, *words)
    path(-3, -0.5)
    assert refused(scene, tmp_path, "covers -3.000 s to -0.500 s")
    path(0.05, 9)
    assert run("info", scene, tmp_path).returncode == 0


def test_an_object_on_a_slope_needs_ground(tmp_path):
    place = "asset: rock, at_m: [429000, 5150690], height_m: 400"
    scene = BARE + "objects:\n" + object_of("far", place + ", stance: on_slope")
    assert refused(scene, tmp_path, "object 'far'", "no ground at (429000, 5150690) m", "on_slope")
    scene = BARE + "objects:\n" + object_of("far", place)
    assert run("info", scene, tmp_path).returncode == 0


def test_a_missing_image_of_the_sky_is_reported(tmp_path):
    scene = BARE + "sky: {environment: {image: none.hdr}}\n"
    assert refused(scene, tmp_path, "scene.yaml:", "key 'image'", "none.hdr")


WALL = """objects:
  - name: wall
    label: 30
    model: wall.obj
    material: rock
    at_m: [429460, 5150684]
"""


def test_a_displaced_model_is_moved_by_its_image(tmp_path):
    corners = ["0 -4 -2", "0 4 -2", "0 4 4", "0 -4 4"]  # seen from the west
    (tmp_path / "wall.obj").write_text(
        "".join(f"v {corner}\n" for corner in corners)
        + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 4/4 3/3 2/2\n"
    )
    geotiff(tmp_path / "grey.tif", np.full((4, 4, 1), 204, np.uint8))
    subprocess.run(
        ["gdal_translate", "-q", "-of", "PNG", tmp_path / "grey.tif", tmp_path / "grey.png"],
        check=True,
    )
    scene = GROUND.replace("PLACE\n", "") + WALL
    displacement = (
        "    displacement: {image: grey.png, amplitude_m: 0.5, middle: 0.2, cell_m: 0.5}\n"
    )
    wests = []
    for text in (scene, scene + displacement):
        folder = tmp_path / str(len(wests))
        folder.mkdir()
        for file in ("wall.obj", "grey.png"):
            (folder / file).write_bytes((tmp_path / file).read_bytes())
        result = run("generate", text, folder)
        assert result.returncode == 0, result.stderr
        scan = PlyData.read(folder / "out/lidar/top/000000.ply")["vertex"].data
        wests.append(scan["world_x"][scan["label"] == 30])
        assert len(wests[-1]) > 500
    # 204 of 255 is 0.8: 0.3 m towards the sensor. Beams of finite width: a few micrometres.
    assert np.ptp(wests[0]) < 1e-5
    assert np.abs(wests[1] - (wests[0].mean() - 0.3)).max() < 1e-5
    fine = (scene + displacement).replace("cell_m: 0.5", "cell_m: 0.0005")
    result = run("generate", fine, tmp_path)
    assert result.returncode == 1
    assert "object 'wall'" in result.stderr
    assert "triangles, more than 16777216; increase cell_m" in result.stderr
