"""groundray-view without a window: pictures, and what it says of inputs that it cannot show."""

import os
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
PROGRAM = ROOT / "build/release/bin/groundray-view"
DEM = ROOT / "data/terrain/jacksboro.tif"


def view(*arguments: object, timeout_s: float = 120) -> subprocess.CompletedProcess[str]:
    """Runs it without any display."""
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


def test_equal_commands_give_equal_pictures(tmp_path: Path) -> None:
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


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("mesh.ply", b"ply\nformat ascii 1.0\nelement face 3\nend_header\n", "mesh.ply"),
        ("scan.pcd", b"VERSION .7\n", "scan.pcd"),
        ("dem.tif", b"II*\0", "dem.tif"),
        ("picture.png", b"\x89PNG\r\n\x1a\n", "picture.png"),
        ("scene.yaml", b"groundray: [", "scene.yaml"),
        ("notes.txt", b"hello", "nothing that can be shown"),
    ],
)
def test_broken_inputs_are_named(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    (tmp_path / name).write_bytes(content)
    result = view(tmp_path / name, "--screenshot", tmp_path / "out.png")
    assert result.returncode == 1
    assert result.stderr.startswith("groundray-view: ")
    assert said in result.stderr
    assert not (tmp_path / "out.png").exists()


def test_usage(tmp_path: Path) -> None:
    assert view("--help").returncode == 0
    assert view("--version").stdout.startswith("groundray-view ")
    assert view("--no-such-option").returncode == 2
    assert view("--turntable", 4).returncode == 2
    for wrong in (("--size", "12"), ("--look-at", "1,2"), ("--colour-by", "nothing")):
        result = view(DEM, "--screenshot", tmp_path / "out.png", *wrong)
        assert result.returncode == 1
        assert wrong[0] in result.stderr


def test_a_window_without_a_display_is_refused() -> None:
    result = view(DEM)
    assert result.returncode == 1
    assert "display" in result.stderr.lower()
