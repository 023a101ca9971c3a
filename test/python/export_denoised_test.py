"""Denoised pictures: nearer to the true radiance than the noisy ones, and never taken for truth."""

import hashlib
import importlib.util
import os
import resource
import shutil
import subprocess
import sys

import cv2
import numpy as np
import OpenEXR
import pytest
from export_runs import PACKAGE, PROGRAM, ROOT, command, names_in

pyoidn = pytest.importorskip("pyoidn", reason="pip install -r test/requirements.txt")
from groundray import Error  # noqa: E402
from groundray.export.denoised import denoise  # noqa: E402

FEW, MANY = 1, 256
CAMERA = """\
groundray_camera: 1
model: A small camera
size_px: [128, 96]
lens: {{pinhole: {{focal_px: [100, 100], centre_px: [63.5, 47.5]}}}}
shutter: {{exposure_ms: 1}}
sampling: {{samples: {samples}, most_samples: {samples}, depth: 3}}
products: {products}
"""
SCENE = f"""\
groundray: 1
seed: 5
duration_s: 0.1
terrain: {{dem: {ROOT / "data/terrain/prairie_1m.tif"}, material: dry_soil, label: 40}}
sky:
  analytic: {{}}
  sun: {{utc: 2026-06-21T17:30:00Z, latitude_deg: 46.506, longitude_deg: -93.92}}
platform:
  drive: {{waypoints_m: [[429436, 5150654], [429441, 5150659]], speed_m_s: 1, height_m: 0.5}}
objects:
  - {{name: rock, label: 70, asset: rock, size_m: 2, at_m: [429442, 5150661], stance: on_slope}}
scatter:
  - name: grass
    label: 72
    density_per_m2: 0.5
    models: [{{asset: grass_tuft, variant: 1}}]
cameras:
  - {{name: few, file: few.yaml, mount: {{translation_m: [1, 0, 1.2], pitch_deg: 8}}}}
  - {{name: bare, file: bare.yaml, mount: {{translation_m: [1, 0, 1.2], pitch_deg: 8}}}}
  - {{name: many, file: many.yaml, mount: {{translation_m: [1, 0, 1.2], pitch_deg: 8}}}}
  - {{name: blind, file: blind.yaml, mount: {{translation_m: [1, 0, 1.2], pitch_deg: 8}}}}
"""


def sums_of(folder):
    return {
        str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in folder.rglob("*")
        if file.is_file()
    }


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """One view by a single path per pixel, with truth and without, and by many; and truth alone."""
    folder = tmp_path_factory.mktemp("denoised")
    cameras = {
        "few": (FEW, "[radiance, truth]"),
        "bare": (FEW, "[radiance]"),
        "many": (MANY, "[radiance]"),
        "blind": (FEW, "[truth]"),
    }
    for name, (samples, products) in cameras.items():
        text = CAMERA.format(samples=samples, products=products)
        (folder / f"{name}.yaml").write_text(text)
    (folder / "scene.yaml").write_text(SCENE)
    done = subprocess.run(
        [PROGRAM, "generate", "scene.yaml", "-o", "run"],
        capture_output=True,
        text=True,
        timeout=500,
        check=False,
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    return folder / "run"


@pytest.fixture(scope="module")
def out(run):
    before = sums_of(run)
    folder = run.parent / "out"
    assert command.main([str(run), "--to", "denoised", "-o", str(folder)]) == 0
    assert sums_of(run) == before  # the dataset stays as it was
    return folder


def picture(file):
    with OpenEXR.File(str(file), separate_channels=True) as exr:
        channels = exr.channels()
        return np.stack([channels[c].pixels for c in "RGB"], axis=-1).astype(float)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("camera", ["few", "bare"])
def test_denoised_pictures_are_nearer_to_the_mean_of_many_paths(run, out, camera):
    """The noise of one path is 14 % of the mean; that of 256 is 1/16 of it, which the ratio bears.

    Version 2.5.1 of the library leaves 0.39 of the RMS error, with truth and without, and changes
    the mean by less than 0.1 %. The bounds leave room for other versions, and for the mean of the
    noisy picture itself, whose standard error is 0.14 / sqrt(128 x 96) = 0.13 %.
    """
    reference = picture(run / "camera/many/000000.exr")
    noisy = picture(run / f"camera/{camera}/000000.exr")
    denoised = picture(out / f"camera/{camera}/000000_denoised_not_truth.exr")
    before, after = rms(noisy - reference), rms(denoised - reference)
    assert before > 0.1 * reference.mean()  # there is noise to remove
    assert after < 0.5 * before
    assert denoised.mean() == pytest.approx(reference.mean(), rel=0.02)


def test_a_uniform_picture_with_known_noise_returns_to_its_radiance():
    """Noise of a gamma distribution, as the mean of four exponential samples: 50 % of the mean.

    128 x 128 pixels leave 0.4 % of that in the mean of the picture; 3 % leaves room for the bias
    of the filter. A fifth of the noise is far from what any average of few pixels would leave.
    """
    radiance = np.array([0.2, 0.5, 3.0])
    shape = (128, 128, 3)
    noisy = np.random.default_rng(7).gamma(4, radiance / 4, size=shape).astype(np.float32)
    assert rms(noisy / radiance - 1) == pytest.approx(0.5, abs=0.01)
    truth = np.full(shape, 0.5), np.broadcast_to([0, 0, 1], shape)
    for smooth in (denoise(noisy), denoise(noisy, *truth)):
        np.testing.assert_allclose(smooth.mean(axis=(0, 1)), radiance, rtol=0.03)
        assert rms(smooth / radiance - 1) < 0.1


def test_names_and_attributes_state_that_it_is_no_truth(run, out, capsys):
    assert names_in(out) == ["camera"]
    assert names_in(out / "camera") == ["bare", "few", "many"]
    stem = out / "camera/few/000000_denoised_not_truth"
    assert names_in(stem.parent)[:2] == [f"{stem.name}.exr", f"{stem.name}.png"]
    with OpenEXR.File(f"{stem}.exr", header_only=True) as exr:
        header = dict(exr.header())
    source = run / "camera/few/000000.exr"
    assert header["denoised"] == "yes: biased, not ground truth; for viewing only"
    version = pyoidn.version.oidn_version
    assert header["denoiser"].startswith(f"Open Image Denoise {version}, pyoidn {version}.")
    assert header["denoiser"].endswith("filter RT, HDR; radiance, Albedo, Ns")
    assert header["denoisedFrom"] == "camera/few/000000.exr"
    assert header["denoisedFromSha256"] == hashlib.sha256(source.read_bytes()).hexdigest()
    with OpenEXR.File(
        str(out / "camera/bare/000000_denoised_not_truth.exr"), header_only=True
    ) as exr:
        assert exr.header()["denoiser"].endswith("filter RT, HDR; radiance")


def test_the_png_has_the_brightness_of_the_preview_of_the_dataset(run, out):
    """The encoding is written down here from its definition: sRGB, with 1 % of values white."""
    noisy = picture(run / "camera/bare/000000.exr")
    denoised = picture(out / "camera/bare/000000_denoised_not_truth.exr")
    positive = np.sort(noisy[np.isfinite(noisy) & (noisy > 0)])
    white = positive[int(0.99 * (positive.size - 1))]

    def encoded(radiance):
        x = np.clip(radiance / white, 0, 1)
        return 255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)

    preview = cv2.imread(str(run / "camera/bare/000000_preview.png"))[..., ::-1]
    written = cv2.imread(str(out / "camera/bare/000000_denoised_not_truth.png"))[..., ::-1]
    np.testing.assert_allclose(preview, encoded(noisy), atol=1)  # rounding down or to nearest
    np.testing.assert_allclose(written, encoded(denoised), atol=1)


def test_equal_datasets_yield_equal_bytes_for_any_number_of_threads(run, out):
    for threads in ("1", "3"):
        again = run.parent / f"again_{threads}"
        done = subprocess.run(
            [sys.executable, "-m", "groundray.export", run, "--to", "denoised", "-o", again],
            env={**os.environ, "PYTHONPATH": str(PACKAGE), "OIDN_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert sums_of(again) == sums_of(out)


def test_what_is_left_out_is_reported(run, tmp_path, capsys):
    chosen = ["--camera", "bare", "--camera", "blind"]
    assert command.main([str(run), "--to", "denoised", "-o", str(tmp_path / "out"), *chosen]) == 0
    reported = capsys.readouterr().out
    assert "note: camera blind has no radiance (product radiance): it is left out" in reported
    assert "note: camera bare has no normals and albedo (product truth): denoised" in reported
    assert "note: denoised pictures are biased: they are for viewing" in reported
    options = [str(run), "--to", "denoised", "-o", str(tmp_path / "none"), "--camera", "blind"]
    assert command.main(options) == 1
    assert "none of its cameras has images with radiance; add radiance" in capsys.readouterr().err
    assert names_in(tmp_path) == ["out"]


def test_a_missing_package_is_one_message_with_the_remedy(run, tmp_path, capsys, monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "pyoidn" else found(name)
    )
    assert command.main([str(run), "--to", "denoised", "-o", str(tmp_path / "out")]) == 1
    assert capsys.readouterr().err == (
        "groundray-export: denoised needs pyoidn, which is not installed: pip install pyoidn\n"
    )
    assert names_in(tmp_path) == []


def test_damaged_images_are_one_message_each(run, tmp_path, capsys):
    copy = shutil.copytree(run, tmp_path / "run")
    file = copy / "camera/bare/000000.exr"
    whole = file.read_bytes()
    options = [str(copy), "--to", "denoised", "-o", str(tmp_path / "out"), "--camera", "bare"]
    file.write_bytes(whole[: len(whole) // 2])
    assert command.main(options) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "bare/000000.exr: cannot read it: " in line
    with OpenEXR.File(str(run / "camera/bare/000000.exr"), separate_channels=True) as exr:
        channels = {name: each.pixels.copy() for name, each in exr.channels().items()}
    channels["G"][3, 4] = np.nan
    OpenEXR.File({}, dict(channels)).write(str(file))  # which replaces the values of the map
    assert command.main(options) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "its radiance is not finite: it is damaged; generate it again" in line
    small = {name: each[:50] for name, each in channels.items()}
    small["G"][3, 4] = 0
    OpenEXR.File({}, {n: np.ascontiguousarray(each) for n, each in small.items()}).write(str(file))
    assert command.main(options) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "must have 128 x 96 pixels, as its calibration states" in line
    assert names_in(tmp_path) == ["run"]


@pytest.mark.parametrize(
    ("arguments", "rule"),
    [
        ([np.ones((4, 4))], "radiance must be height x width x 3, but is (4, 4)"),
        ([np.full((4, 4, 3), np.inf)], "radiance must be finite"),
        ([np.ones((4, 4, 3)), None, np.ones((4, 4, 3))], "normals need the albedo"),
        ([np.ones((4, 4, 3)), np.ones((4, 5, 3))], "albedo must be (4, 4, 3) like radiance"),
    ],
)
def test_arrays_that_do_not_fit_are_rejected(arguments, rule):
    with pytest.raises(Error) as fault:
        denoise(*arguments)
    assert rule in str(fault.value)


def test_a_full_disk_is_reported_and_leaves_no_files(run, tmp_path):
    """Files are limited to 2 kB."""
    done = subprocess.run(
        [sys.executable, "-m", "groundray.export", run, "--to", "denoised", "-o", tmp_path / "out"],
        env={**os.environ, "PYTHONPATH": str(PACKAGE)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000)),
    )
    assert done.returncode == 1, done.stderr
    assert done.stderr.count("\n") == 1
    assert "_denoised_not_truth" in done.stderr
    assert names_in(tmp_path) == []
