"""groundray-view without a window: pictures, and what it says of inputs that it cannot show."""

import os
import re
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
PROGRAM = ROOT / "build/release/bin/groundray-view"
DEM = ROOT / "data/terrain/jacksboro.tif"


def view(*arguments: object, timeout_s: float = 120) -> subprocess.CompletedProcess[str]:
    """Runs the viewer without a display."""
    environment = {
        name: value
        for name, value in os.environ.items()
        if name not in ("DISPLAY", "WAYLAND_DISPLAY")
    }
    return subprocess.run(
        [PROGRAM, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=timeout_s,
        env=environment,
        check=False,
    )


def test_pictures_need_no_display(tmp_path: Path) -> None:
    result = view(DEM, "--screenshot", tmp_path / "dem.png", "--size", "320x200")
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    picture = cv2.imread(str(tmp_path / "dem.png"))
    assert picture.shape == (200, 320, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 1000


def test_equal_commands_yield_equal_pictures(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        assert view(DEM, "--screenshot", tmp_path / name, "--colour-by", "slope").returncode == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_turntable_is_a_sequence(tmp_path: Path) -> None:
    result = view(DEM, "--screenshot", tmp_path / "turn", "--turntable", 3, "--size", "64x48")
    assert result.returncode == 0, result.stderr
    assert sorted(p.name for p in (tmp_path / "turn").iterdir()) == [
        "0000.png",
        "0001.png",
        "0002.png",
    ]


# Written by others: NumPy and OpenCV.
def write_inputs(folder: Path) -> list[Path]:
    points = np.random.default_rng(3).uniform(-5, 5, (500, 4)).astype(np.float32)
    np.save(folder / "cloud.npy", points)
    np.savez(folder / "cloud.npz", xyz=points[:, :3], intensity=points[:, 3])
    # As groundray-export writes them.
    named = {f"{axis}_m": points[:, i] for i, axis in enumerate("xyz")}
    np.savez(folder / "own.npz", **named, range_m=points[:, 3], X_DS=np.eye(4), stamp_ns=5)
    points.tofile(folder / "cloud.bin")
    colours = np.random.default_rng(4).uniform(0, 255, (9, 16, 3))
    colours = cv2.resize(colours, (160, 90))
    for name in ("picture.png", "picture.jpg"):
        assert cv2.imwrite(str(folder / name), colours.astype(np.uint8))
    assert cv2.imwrite(str(folder / "light.hdr"), (colours / 50).astype(np.float32))
    return sorted(folder.iterdir())


def test_clouds_and_pictures_of_other_software_are_shown(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    for path in write_inputs(tmp_path / "in"):
        result = view(path, "--screenshot", tmp_path / "out.png", "--size", "320x180")
        assert result.returncode == 0, result.stderr
        picture = cv2.imread(str(tmp_path / "out.png"))
        # More than the background, whose colour changes from row to row alone.
        assert np.any(np.ptp(picture.astype(int), axis=1) > 20), path.name


def test_pictures_keep_their_colours(tmp_path: Path) -> None:
    """The centres of both halves have the picture's colours."""
    bands = np.zeros((40, 60, 3), np.uint8)
    bands[:, :30] = (200, 60, 20)
    bands[:, 30:] = (10, 90, 220)
    cv2.imwrite(str(tmp_path / "bands.jpg"), bands)
    result = view(tmp_path / "bands.jpg", "--screenshot", tmp_path / "out.png", "--size", "300x200")
    assert result.returncode == 0, result.stderr
    picture = cv2.imread(str(tmp_path / "out.png")).astype(int)
    assert np.abs(picture[100, 110] - bands[20, 10]).max() <= 6  # JPEG's and drawing's rounding
    assert np.abs(picture[100, 190] - bands[20, 50]).max() <= 6


def srgb_of_linear(light: float) -> float:
    """Returns the byte of IEC 61966-2-1."""
    light = min(max(light, 0), 1)
    return 255 * (12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055)


def linear_of_srgb(byte: float) -> float:
    share = byte / 255
    return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize("exposure_ev", [-2, 0, 1, 1.5])
def test_exposure_brightens_pictures_in_linear_light(tmp_path: Path, exposure_ev: float) -> None:
    """A picture of 8 bits, and light of which 1 is the 99 % quantile, in the centre of the view."""
    cv2.imwrite(str(tmp_path / "grey.png"), np.full((40, 60, 3), 90, np.uint8))
    light = np.ones((40, 60, 3), np.float32)
    light[18:22, 28:32] = 0.25
    cv2.imwrite(str(tmp_path / "light.hdr"), light)
    for name, linear in (("grey.png", linear_of_srgb(90)), ("light.hdr", 0.25)):
        picture = ["--screenshot", tmp_path / "out.png", "--size", "300x200"]
        result = view(tmp_path / name, *picture, f"--exposure-ev={exposure_ev}")
        assert result.returncode == 0, result.stderr
        shown = cv2.imread(str(tmp_path / "out.png"))[100, 150].astype(float)
        expected = srgb_of_linear(linear * 2**exposure_ev)
        assert np.abs(shown - expected).max() <= 1.5, name  # RGBE's, the picture's and drawing's


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("mesh.ply", b"ply\nformat ascii 1.0\nelement face 3\nend_header\n", "mesh.ply"),
        ("scan.pcd", b"VERSION .7\n", "scan.pcd"),
        ("dem.tif", b"II*\0", "dem.tif"),
        ("picture.png", b"\x89PNG\r\n\x1a\n", "picture.png"),
        ("picture.jpg", b"\xff\xd8\xff\xe0", "picture.jpg"),
        ("light.exr", b"\x76\x2f\x31\x01\x02", "light.exr"),
        ("light.hdr", b"#?RADIANCE\n\n-Y 60000 +X 60000\n", "light.hdr"),
        ("mesh.stl", b"\0" * 80 + b"\xff" * 4, "mesh.stl"),
        ("mesh.obj", b"v 1 2\nf 1 2 3\n", "mesh.obj"),
        ("mesh.glb", b"glTF\x02\0\0\0\xff\xff\xff\xff", "mesh.glb"),
        ("scan.npy", b"\x93NUMPY\x01\0", "scan.npy"),
        ("scan.npz", b"PK\x03\x04", "scan.npz"),
        ("scan.bin", b"12345", "scan.bin"),
        ("dataset.yaml", b"groundray_dataset: 99\n", "dataset.yaml"),
        ("scene.yaml", b"groundray: [", "scene.yaml"),
        ("notes.txt", b"hello", "it cannot be shown"),
    ],
)
def test_broken_inputs_are_reported(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    (tmp_path / name).write_bytes(content)
    result = view(tmp_path / name, "--screenshot", tmp_path / "out.png")
    assert result.returncode == 1
    assert result.stderr.startswith("groundray-view: ")
    assert said in result.stderr
    assert not (tmp_path / "out.png").exists()


def write_plate(path: Path, height_m: float) -> None:
    corners = [(0, 0), (4, 0), (4, 4), (0, 4)]
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
        "property double z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
        + "".join(f"{x} {y} {height_m}\n" for x, y in corners)
        + "3 0 1 2\n3 0 2 3\n"
    )


def test_a_dataset_cannot_name_files_outside_it(tmp_path: Path) -> None:
    """Names of sensors are parts of file names."""
    folder = tmp_path / "data"
    scene = ROOT / "data/scenes/first_light.yaml"
    generate = [PROGRAM.with_name("groundray"), "generate", scene, "-o", folder]
    subprocess.run(generate, check=True, capture_output=True)
    dataset = folder / "dataset.yaml"
    text = dataset.read_text()
    name = re.search(r'^  - \{name: "(\w+)", kind: lidar', text, flags=re.MULTILINE)[1]
    dataset.write_text(text.replace(f'name: "{name}", kind', f'name: "../data/lidar/{name}", kind'))
    result = view(folder, "--screenshot", tmp_path / "out.png")
    assert result.returncode == 1
    assert f"is '../data/lidar/{name}', but is part of file names" in result.stderr
    assert not (tmp_path / "out.png").exists()


def test_distances_from_the_truth_are_printed_and_shown(tmp_path: Path) -> None:
    write_plate(tmp_path / "truth.ply", 1)
    write_plate(tmp_path / "raised.ply", 1.05)
    truth = ["--compare-with", tmp_path / "truth.ply", "--tolerance-m", 0.1]
    for span, is_red in (("-0.05,0.05", True), ("0.05,0.1", False)):
        picture = ["--screenshot", tmp_path / "out.png", "--size", "200x120", "--no-legend"]
        result = view(tmp_path / "raised.ply", *truth, *picture, f"--range={span}")
        assert result.returncode == 0, result.stderr
        assert "raised.ply from truth.ply:" in result.stdout
        assert "mean 0.05 m" in result.stdout
        blue, _, red = cv2.imread(str(tmp_path / "out.png"))[60, 100].astype(int)
        assert abs(red - blue) > 60
        assert (red > blue) == is_red


def test_options_are_checked(tmp_path: Path) -> None:
    assert view("--help").returncode == 0
    assert view("--version").stdout.startswith("groundray-view ")
    assert view("--no-such-option").returncode == 2
    assert view(DEM, "--exposure-ev", 11).returncode == 2
    for lonely in (
        ("--turntable", 4),
        ("--range", "0,1"),
        ("--compare-with", DEM),
    ):
        result = view(DEM, *lonely)
        assert result.returncode == 2
        assert f"{lonely[0]} needs --screenshot" in result.stderr
    for wrong in (
        ("--size", "12"),
        ("--look-at", "1,2"),
        ("--colour-by", "nothing"),
        ("--range", "2,1"),
        ("--range", "1,2"),
    ):
        result = view(DEM, "--screenshot", tmp_path / "out.png", *wrong)
        assert result.returncode == 1
        assert wrong[0] in result.stderr


def test_a_window_without_a_display_is_rejected() -> None:
    result = view(DEM)
    assert result.returncode == 1
    assert "display" in result.stderr.lower()
