"""Automatic white balance and tone curves of pictures, computed anew from the raw images."""

import cv2
import numpy as np
import pytest
import yaml
from dataset_runs import CAMERA, SCENE, command, groundray

IMAGER = """\
aperture: {f_number: 2, focal_length_mm: 0.12}
imager:
  {pixel_pitch_um: 3, filter: rggb, quantum_efficiency: [0.4, 0.6, 0.5], full_well_e: 10000,
   gain_dn_e: 0.4, read_noise_e: 3, black_dn: 32, bits: 12}
products: [picture, raw]
"""
COLOUR = CAMERA.split("shutter:")[0] + "shutter: {exposure_ms: 5, automatic: {}}\n" + IMAGER
PICTURE = (
    "picture: {encoding: linear, bits: 16, white_balance: automatic, tone_curve: {key: 0.3}}\n"
)


def generate(folder, camera, *, changes="", check=True):
    scene = SCENE.replace("    sampling:", f"{changes}    sampling:")
    command(folder, scene=scene)
    (folder / "camera.yaml").write_text(camera)
    done = groundray("generate", folder / "scene.yaml", "-o", folder / "out", "--sensor", "eye")
    assert not check or done.returncode == 0, done.stderr
    return done


def first_image(folder):
    images = folder / "out/camera/eye"
    raw, picture = (
        cv2.imread(str(images / f"000000{name}.png"), cv2.IMREAD_UNCHANGED) for name in ("_raw", "")
    )
    return raw, picture[..., ::-1], yaml.safe_load((images / "000000_exposure.yaml").read_text())


def linear(raw):
    """Returns what each pixel collects in units of white: red, green and blue."""
    colours = cv2.cvtColor(raw * 16, cv2.COLOR_BayerRGGB2RGB)  # of 16 bits
    return (colours / 16 - 32) / 4000


def test_pictures_follow_from_raw_images(tmp_path):
    generate(tmp_path, COLOUR + PICTURE)
    raw, picture, exposure = first_image(tmp_path)
    x = linear(raw)
    usable = np.maximum(x[x.max(axis=-1) < 0.99], 0)
    light = (usable**6).sum(axis=0) ** (1 / 6)
    fixed = np.array([0.6 / 0.4, 1, 0.6 / 0.5])
    gains = np.clip(light[1] / light, fixed / 2, fixed * 2)
    gains[1] = 1
    gains /= gains.min()
    assert exposure["white_balance"] == pytest.approx(gains, rel=1e-5)
    x = np.clip(x * gains, 0, 1)
    luminance = x @ [0.2126, 0.7152, 0.0722]
    lift = max(0.3 / np.exp(np.log(np.maximum(luminance, 1e-3)).mean()), 1)
    assert exposure["tone_lift"] == pytest.approx(lift, rel=1e-4)
    assert lift > 1
    expected = 65535 * x * (lift + x) / (1 + lift * x)
    assert np.abs(picture - expected).max() < 1
    assert groundray("verify", tmp_path / "out").returncode == 0


@pytest.mark.parametrize(
    ("of_file", "of_scene", "gains"),
    [
        ("white_balance: automatic, tone_curve: {}", "white_balance: fixed", [1.5, 1, 1.2]),
        ("gains: [2, 1, 1.5], tone_curve: {}", "white_balance: fixed", [2, 1, 1.5]),
        ("white_balance: automatic, tone_curve: {}", "gains: [2, 1, 1.5]", [2, 1, 1.5]),
    ],
)
def test_a_scene_can_switch_both_off(tmp_path, of_file, of_scene, gains):
    of_file = f"picture: {{encoding: linear, bits: 16, {of_file}}}\n"
    of_scene = f"    picture: {{{of_scene}, tone_curve: off}}\n"
    generate(tmp_path, COLOUR + of_file, changes=of_scene)
    raw, picture, exposure = first_image(tmp_path)
    assert not {"white_balance", "tone_lift"} & set(exposure)
    expected = 65535 * np.clip(linear(raw) * gains, 0, 1)
    assert np.abs(picture - expected).max() < 1


@pytest.mark.parametrize(
    ("filter_name", "picture", "message"),
    [
        ("mono", "{white_balance: automatic}", "white_balance, but a mono imager has no colours"),
        ("rggb", "{white_balance: automatic, gains: [1, 1, 2]}", "but 'gains' are set too"),
        ("rggb", "{tone_curve: {key: 1}}", "must be between 0 and 1"),
        ("rggb", "{tone_curve: {kye: 0.2}}", "did you mean 'key'?"),
    ],
)
def test_mistakes_are_found_while_reading(tmp_path, filter_name, picture, message):
    camera = COLOUR.replace("filter: rggb", f"filter: {filter_name}") + f"picture: {picture}\n"
    done = generate(tmp_path, camera, check=False)
    assert done.returncode == 1
    assert message in done.stderr
    assert ".yaml:" in done.stderr  # the line
    assert not (tmp_path / "out").exists()
