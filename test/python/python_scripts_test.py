"""The scripts and examples of docs/guide/python.md run and print the expected results."""

import re
import subprocess
import sys

import groundray
import pytest
import small_scene
from groundray._scene import to_yaml
from markdown_page import Page


def run(name, *arguments):
    done = subprocess.run(
        [sys.executable, small_scene.ROOT / "docs/guide" / name, *map(str, arguments)],
        capture_output=True,
        text=True,
        env={"PYTHONPATH": str(small_scene.PACKAGE)},
        timeout=600,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def number(pattern, text):
    return float(re.search(pattern, text).group(1))


def test_first_scan_script_recovers_noise_and_truth():
    reported = run("python_first_scan.py")
    assert number(r"off by ([0-9.]+) mm RMS", reported) == pytest.approx(20, abs=0.5)
    assert number(r"(\d+) on the rock", reported) > 10
    assert number(r"rays agree to ([0-9.e-]+) m", reported) < 5e-6  # a float of 30 m


def test_reconstruction_script_recovers_the_ground(tmp_path):
    reported = run("python_reconstruct.py", tmp_path)
    assert number(r"it lies (\d+) mm RMS", reported) < 30
    assert number(r"(\d+) % within two standard deviations", reported) > 90
    assert len(groundray.load_mesh(tmp_path / "ground.ply").triangles) > 100
    assert groundray.load_terrain(tmp_path / "ground.tif").heights_m.size > 1000


def test_the_examples_of_the_page_run(tmp_path):
    groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M).save(tmp_path / "ground.tif")
    spec = small_scene.spec(tmp_path)
    spec["terrain"]["dem"] = "ground.tif"
    (tmp_path / "trail.yaml").write_text(to_yaml(spec))
    blocks = Page(small_scene.ROOT / "docs/guide/python.md").blocks
    printed = []
    for block in (block for block in blocks if block.language == "python"):
        (tmp_path / "example.py").write_text(block.text)
        done = subprocess.run(
            [sys.executable, "example.py", "trail.yaml"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            env={"PYTHONPATH": str(small_scene.PACKAGE)},
            timeout=300,
            check=False,
        )
        assert (done.returncode, done.stderr) == (0, ""), block.text
        printed.append(done.stdout)
    assert len(printed) == 4
    assert re.fullmatch(r"\d+ 1\n\d+ 1\n", printed[1])
    on_crates = re.fullmatch(r"\{1: \d+, 70: (\d+), 71: (\d+)\}\n", printed[2])
    assert min(map(int, on_crates.groups())) > 10
    assert [line.split()[0] for line in printed[3].splitlines()] == ["0.0", "0.100030464"]
