"""What a first run tells: notes on settings, automatic exposure, expected time and bytes."""

import os
import pty
import re
import subprocess
import time
from contextlib import suppress

import cv2
import numpy as np
import pytest
import yaml

from test.support.dataset_runs import (
    CAMERA,
    PROGRAM,
    SCENE,
    command,
    files,
    generate,
    groundray,
)

IMAGER = """\
aperture: {f_number: 2, focal_length_mm: 0.12}
imager:
  {pixel_pitch_um: 3, filter: mono, quantum_efficiency: 0.6, full_well_e: 10000, gain_dn_e: 0.4,
   read_noise_e: 3, bits: 12}
products: [picture, raw]
"""


def written(folder, scene=SCENE, camera=CAMERA):
    command(folder, scene=scene)
    (folder / "camera.yaml").write_text(camera)
    return folder / "scene.yaml"


def run(folder, scene, *more, out="out"):
    return groundray("generate", scene, "-o", folder / out, *more)


def with_imager(shutter):
    return CAMERA.split("shutter:")[0] + f"shutter: {shutter}\n" + IMAGER


MOUNTED = "preset: velodyne_vlp16, mount: {translation_m: [0, 0, 1.5]}"
LIGHT = (
    "laser: {wavelength_nm: 905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}, "
    "receiver: {aperture_mm: 20, threshold_w: 1.0e-8, timing: peak, returns: last}"
)
NOTES = [
    ("drive: {waypoints", "drive: {waypoints", "", None),
    (
        "platform:",
        "weather: {fog_range_m: 300}\nplatform:",
        "weather: has no effect on lidar 'top', which has no link budget",
        "weather: hides surfaces beyond 300 m, but the sky above them remains clear",
    ),
    (
        f"lidars:\n  - {{name: top, {MOUNTED}}}",
        f"weather: {{group_index: 1.0003}}\nlidars:\n  - {{name: top, {MOUNTED}, {LIGHT}}}",
        "weather: with group_index = 1.0003, lidar 'top' measures ranges 30 mm per 100 m too long",
        None,
    ),
    (
        "mount: {translation_m: [0, 0, 1.5]}}",
        "mount: {translation_m: [0, 0, 1.5]}, range_noise_sigma_m: 2}",
        "lidar 'top': range_noise_sigma_m = 2 is more than data sheets state",
        None,
    ),
    (
        "mount: {translation_m: [0, 0, 1.5]}}",
        "mount: {translation_m: [0, 0, 1.5]}, angular_jitter_mrad: 30}",
        "lidar 'top': angular_jitter_mrad = 30 is more than half a degree",
        None,
    ),
    (
        "sampling: {samples: 2, most_samples: 2}",
        "sampling: {samples: 2, most_samples: 8}",
        "camera 'eye': without a relative_error every pixel takes the 8 paths",
        None,
    ),
    (
        "material: dry_soil}",
        "material: dry_soil, tolerance_m: 3}",
        "tolerance_m = 3 is not less than the height of lidar 'top'",
        None,
    ),
]


@pytest.mark.parametrize(("before", "after", "note", "other"), NOTES)
def test_settings_without_effect_are_noted(tmp_path, before, after, note, other):
    assert before in SCENE
    scene = written(tmp_path, SCENE.replace(before, after, 1))
    info = groundray("info", scene)
    assert info.returncode == 0, info.stderr
    made = run(tmp_path, scene)
    assert made.returncode == 0, made.stderr
    listed = yaml.safe_load((tmp_path / "out/dataset.yaml").read_text()).get("notes", [])
    if not note:
        assert "\nnote " not in info.stdout
        assert "note:" not in made.stderr
        assert listed == []
        return
    for each in filter(None, (note, other)):
        assert f"note      {each}" in info.stdout
        assert f"note: {each}" in made.stderr
        assert any(text.startswith(each) for text in listed)


def test_a_lens_that_folds_inside_its_image_is_noted(tmp_path):
    lens = "lens: {pinhole: {focal_px: [40, 40], centre_px: [23.5, 17.5]}}"
    folded = (
        "lens: {brown_conrady: {focal_px: [26, 26], centre_px: [23.5, 17.5], "
        "coefficients: [-0.6, 0, 0, 0]}}"
    )
    assert lens in CAMERA
    info = groundray("info", written(tmp_path, camera=CAMERA.replace(lens, folded)))
    assert "note      camera 'eye': its distortion folds inside the image" in info.stdout


def test_heights_that_mark_missing_samples_are_noted(tmp_path):
    heights = np.full((8, 8), 300.0)
    heights[2, 3] = -32767
    rows = "\n".join(" ".join(map(str, row)) for row in heights)
    head = "ncols 8\nnrows 8\nxllcorner 429430\nyllcorner 5150650\ncellsize 4\n"
    (tmp_path / "dem.asc").write_text(f"{head}{rows}\n")
    dem = re.search(r"dem: ([^,]+),", SCENE)[1]
    scene = SCENE.replace(dem, "dem.asc").split("objects:")[0]
    scene += "lidars: [{name: top, preset: velodyne_vlp16, mount: {translation_m: [0, 0, 1.5]}}]\n"
    info = groundray("info", written(tmp_path, scene))
    assert info.returncode == 0, info.stderr
    note = "note      terrain: it has heights of -32767 m: if these mark missing samples, set"
    assert note in info.stdout
    known = scene.replace("dem: dem.asc,", "dem: dem.asc, nodata: -32767,")
    assert "terrain: it has heights" not in groundray("info", written(tmp_path, known)).stdout


def test_a_sky_that_nothing_sees_is_noted(tmp_path):
    scene = SCENE.split("cameras:")[0]
    info = groundray("info", written(tmp_path, scene))
    assert "note      sky: has no effect, because there are no cameras" in info.stdout


def test_saturated_images_are_noted(tmp_path):
    made = run(tmp_path, written(tmp_path, camera=with_imager("{exposure_ms: 0.5}")))
    assert made.returncode == 0, made.stderr
    note = re.search(
        r"note: camera 'eye': 3 images with more than 1 % .* saturated, ([\d.]+) %", made.stderr
    )
    assert note, made.stderr
    raw = cv2.imread(str(tmp_path / "out/camera/eye/000000_raw.png"), cv2.IMREAD_UNCHANGED)
    share = np.mean(raw >= 4000)  # full wells are at 4000, less or more their read noise of 1.2
    exposure = yaml.safe_load((tmp_path / "out/camera/eye/000000_exposure.yaml").read_text())
    assert (exposure["exposure_s"], exposure["gain"]) == (0.0005, 1)
    assert share / 2 < exposure["saturated"] < 1
    entries = yaml.safe_load((tmp_path / "out/dataset.yaml").read_text())["frames"]
    assert next(each["exposure"] for each in entries if "exposure" in each) == exposure


@pytest.mark.parametrize(
    ("automatic", "level", "expected"),
    [
        ("{percentile: 95, target: 0.8}", lambda y: np.percentile(y, 95), 0.8),
        ("{metering: mean}", np.mean, 0.18),
        ("{metering: mean, target: 0.4}", np.mean, 0.4),
    ],
)
def test_automatic_exposure_reaches_its_target(tmp_path, automatic, level, expected):
    camera = (
        with_imager(f"{{exposure_ms: 5, automatic: {automatic}}}")
        + "picture: {encoding: linear, bits: 16}\n"
    )
    made = run(tmp_path, written(tmp_path, camera=camera.replace("samples: 2", "samples: 16")))
    assert made.returncode == 0, made.stderr
    assert "saturated" not in made.stderr
    for number in range(3):
        picture = cv2.imread(
            str(tmp_path / f"out/camera/eye/{number:06}.png"), cv2.IMREAD_UNCHANGED
        )
        # Noise of paths and photons is wider than that of the metered pixels, with 16 paths each.
        assert level(picture / 65535) == pytest.approx(expected, rel=0.1)


def test_a_scene_keeps_the_level_of_its_camera_file(tmp_path):
    """A scene that changes one key of automatic exposure leaves the others as they are."""
    levels = []
    for automatic, change in [
        ("{metering: mean, target: 0.4}", "{most_gain: 2}"),
        ("{metering: mean, target: 0.4}", "{metering: percentile}"),
        ("{}", "{most_gain: 2}"),
    ]:
        camera = with_imager(f"{{exposure_ms: 5, automatic: {automatic}}}")
        changed = SCENE.replace(
            "    sampling:", f"    shutter: {{automatic: {change}}}\n    sampling:"
        )
        made = run(tmp_path, written(tmp_path, changed, camera), out=str(len(levels)))
        assert made.returncode == 0, made.stderr
        exposure = tmp_path / f"{len(levels)}/camera/eye/000000_exposure.yaml"
        levels.append(yaml.safe_load(exposure.read_text())["exposure_s"])
    assert levels[0] == pytest.approx(levels[1] * 0.4 / 0.18, rel=0.8)  # a mean of 0.4
    assert levels[1] == levels[2]  # both have the default of percentiles


def test_automatic_exposures_do_not_depend_on_threads_or_shards(tmp_path):
    camera = with_imager("{exposure_ms: 5, automatic: {}}")
    scene = written(tmp_path, camera=camera)
    whole = run(tmp_path, scene)
    assert whole.returncode == 0, whole.stderr
    for threads in "12":
        alone = run(tmp_path, scene, "--threads", threads, out=f"threads{threads}")
        assert alone.returncode == 0, alone.stderr
        assert files(tmp_path / f"threads{threads}") == files(tmp_path / "out")
    for part in "12":
        assert run(tmp_path, scene, "--shard", f"{part}/2", out=part).returncode == 0
    merged = groundray("merge", tmp_path / "1", tmp_path / "2", "-o", tmp_path / "merged")
    assert merged.returncode == 0, merged.stderr
    assert files(tmp_path / "merged") == files(tmp_path / "out")


MISTAKES = [
    ("{exposure_ms: 5, automatic: {percentile: 0}}", "percentile", "must be > 0"),
    ("{exposure_ms: 5, automatic: {target: 2}}", "target", "at most 1"),
    ("{exposure_ms: 5, automatic: {shortest_us: 9000}}", "shutter", "exposes for at most 5 ms"),
    ("{exposure_ms: 5, automatic: {metering: spot}}", "metering", "percentile"),
    ("{exposure_ms: 5, automatic: {most_gain: 0.5}}", "most_gain", "1 or more"),
    ("{exposure_ms: 5, automatic: on}", "automatic", "map"),
]


@pytest.mark.parametrize(("shutter", "key", "rule"), MISTAKES)
def test_mistakes_of_automatic_exposure(tmp_path, shutter, key, rule):
    info = groundray("info", written(tmp_path, camera=with_imager(shutter)))
    assert info.returncode == 1
    assert key in info.stderr
    assert rule in info.stderr
    assert "camera.yaml:" in info.stderr or "scene.yaml:" in info.stderr


def test_automatic_exposure_needs_an_imager(tmp_path):
    camera = CAMERA.replace("{exposure_ms: 1}", "{exposure_ms: 1, automatic: {}}")
    info = groundray("info", written(tmp_path, camera=camera))
    assert info.returncode == 1
    assert "has 'automatic' exposure, which needs an 'imager'" in info.stderr


def test_an_exposure_time_by_itself_is_fixed(tmp_path):
    scene = SCENE.replace(
        "file: camera.yaml", "preset: realsense_d455_color\n    shutter: {exposure_ms: 2}"
    )
    info = groundray("info", written(tmp_path, scene))
    assert info.returncode == 0, info.stderr
    assert "automatic exposure" not in info.stdout
    scene = SCENE.replace("file: camera.yaml", "preset: realsense_d455_color")
    assert (
        "automatic exposure, 0.01 to 5 ms, gain up to 8"
        in groundray("info", written(tmp_path, scene)).stdout
    )


def test_info_states_the_bytes_of_a_run(tmp_path):
    scene = written(tmp_path, SCENE.replace("file: camera.yaml", "preset: euroc_mav_cam0"))
    info = groundray("info", scene)
    assert info.returncode == 0, info.stderr
    assert re.search(r"\ntime      about .* on this machine", info.stdout)
    expected = float(re.search(r"\noutput    about ([\d.e+]+) MiB", info.stdout)[1]) * 2**20
    assert run(tmp_path, scene).returncode == 0
    written_bytes = sum(map(len, files(tmp_path / "out").values()))
    assert written_bytes / 1.5 < expected < written_bytes * 1.5


def test_info_estimates_cameras_with_vignetting(tmp_path):
    """Four bands of rows stand for the image, with the light of its rows."""
    camera = with_imager("{exposure_ms: 5, automatic: {}}").replace(
        "size_px: [48, 36]", "size_px: [48, 360]"
    )
    camera = camera.replace("centre_px: [23.5, 17.5]", "centre_px: [23.5, 179.5]")
    camera = camera.replace("aperture: {", "aperture: {vignetting: [-0.9, 0, 0], ")
    scene = written(tmp_path, camera=camera)
    info = groundray("info", scene)
    assert info.returncode == 0, info.stderr
    expected = float(re.search(r" {10}eye: 3 images of .* and ([\d.e+]+) MiB", info.stdout)[1])
    assert run(tmp_path, scene).returncode == 0
    made = sum(map(len, files(tmp_path / "out/camera/eye").values())) / 3 / 2**20
    assert made / 1.5 < expected < made * 1.5


# Alone on a machine, or beside other tests. Both sides of a comparison share the machine's load.
FACTOR = 1.5 if os.environ.get("GROUNDRAY_PROOF") == "full" else 4
SLOW = SCENE.replace("sampling: {samples: 2, most_samples: 2}", "sampling: {samples: 4}").replace(
    "file: camera.yaml", "preset: euroc_mav_cam0"
)


def seconds_of(text):
    """Returns the seconds of a duration such as `2 min 5 s`."""
    minutes, seconds = re.fullmatch(r"(?:(\d+) min )?([\d.]+) s", text).groups()
    return 60 * float(minutes or 0) + float(seconds)


def test_info_states_the_time_of_a_run(tmp_path):
    scene = written(tmp_path, SLOW)
    info = groundray("info", scene)
    assert info.returncode == 0, info.stderr
    expected_s = seconds_of(re.search(r"time      about ([\d.ms in]+ s) on", info.stdout)[1])
    begin = time.monotonic()
    assert run(tmp_path, scene).returncode == 0
    took_s = time.monotonic() - begin
    assert took_s / FACTOR < expected_s < took_s * FACTOR


def lines_on_terminal(command, folder):
    """Yields the lines that a command draws on a terminal, with the times when it did."""
    ours, theirs = pty.openpty()
    with subprocess.Popen(command, cwd=folder, stderr=theirs, stdout=subprocess.DEVNULL) as process:
        os.close(theirs)
        begin, drawn = time.monotonic(), b""
        with suppress(OSError):  # no more output
            while part := os.read(ours, 4096):
                *lines, drawn = re.split(b"[\r\n]", drawn + part)
                for line in filter(None, lines):
                    yield time.monotonic() - begin, line.decode()
        os.close(ours)
        assert process.wait() == 0


def test_progress_states_the_time_left(tmp_path):
    """Scans and images take very different times, and the lines between differ in both counts."""
    command(tmp_path, scene=SLOW)
    lines = list(lines_on_terminal([PROGRAM, "generate", "scene.yaml", "-o", "out"], tmp_path))
    took_s = lines[-1][0]
    told = [
        (at_s, at_s + seconds_of(match[1]))
        for at_s, line in lines
        if (match := re.search(r", ([\dmin .]+ s) left *$", line))
    ]
    assert len(told) > 5
    later = [total_s for at_s, total_s in told if at_s > took_s / 4]
    assert took_s / FACTOR < np.median(later) < took_s * FACTOR
    assert any(re.search(r"images \d/3 \(\d+ % of the next\)", line) for _, line in lines)


def test_progress_counts_scans_and_images(tmp_path):
    made = generate(tmp_path)
    assert made.returncode == 0, made.stderr
    assert re.search(r"^scans 6/6, images 3/3 in ", made.stderr, re.MULTILINE)
