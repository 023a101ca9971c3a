"""The golden suite for users: it passes, detects faults and locates them."""

import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))
GOLDEN = PROGRAM.parent / "groundray-golden"
CASES = ROOT / "test/golden"
PYTHON = sys.executable


def golden(*arguments, **options):
    return subprocess.run(
        [GOLDEN, *arguments], capture_output=True, text=True, timeout=300, check=False, **options
    )


def copy_of_cases(folder):
    """Cases name the DEMs of data/ by relative paths."""
    shutil.copytree(CASES, folder / "test/golden", ignore=shutil.ignore_patterns("*.cpp"))
    (folder / "data").symlink_to(ROOT / "data")
    return folder / "test/golden"


def replace(file, old, new):
    text = file.read_text()
    assert text.count(old) == 1, f"{file} has '{old}' {text.count(old)} times"
    file.write_text(text.replace(old, new))


def test_planted_faults_fit_the_sources():
    """`./dev prove` plants them, which takes an hour; that their texts occur is known at once."""
    spec = importlib.util.spec_from_file_location("find_faults", CASES / "find_faults.py")
    found = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = found  # for its dataclass
    spec.loader.exec_module(found)
    assert len(found.read_faults([])) > 50


def failures(junit):
    return {
        suite.get("name")
        for suite in ET.parse(junit).getroot().iter("testsuite")
        if int(suite.get("failures")) > 0
    }


class Outline(HTMLParser):
    """Contents of a page: words, pictures and links to other files."""

    def __init__(self):
        super().__init__()
        self.words, self.pictures, self.links = [], 0, []

    def handle_data(self, data):
        self.words.append(data)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.pictures += tag == "img"
        self.links += [
            value
            for name, value in attrs.items()
            if name in ("src", "href") and not value.startswith(("#", "data:"))
        ]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    out = tmp_path_factory.mktemp("golden")
    return golden("run", "-o", out), out


def test_all_cases_pass(whole):
    result, out = whole
    assert result.returncode == 0, result.stdout
    assert "FAILED" not in result.stdout
    names = {case.parent.name for case in CASES.glob("*/case.yaml")}
    suites = ET.parse(out / "junit.xml").getroot().findall("testsuite")
    assert {suite.get("name") for suite in suites} == names
    assert all(int(suite.get("tests")) > 0 for suite in suites)


def test_the_report_is_self_contained(whole):
    _, out = whole
    page = Outline()
    page.feed((out / "report.html").read_text())
    text = " ".join(page.words)
    assert page.links == []
    assert page.pictures > 10
    assert "camera_lenses" in text
    assert "spinning_over_plane" in text


def test_stored_files_stay_small():
    stored = [file for file in CASES.glob("*/expected/**/*") if file.is_file()]
    assert len(stored) > 5
    assert sum(file.stat().st_size for file in stored) < 15e6


# What is wrong, in which input, and which case must find it.
FAULTS = {
    "p1 and p2 swapped": (
        "camera_lenses/brown4.yaml",
        "0.004, -0.006",
        "-0.006, 0.004",
        "camera_lenses",
    ),
    "a radial coefficient off by 1 %": (
        "camera_lenses/fisheye.yaml",
        "[0.02,",
        "[0.0202,",
        "camera_lenses",
    ),
    "centre off by half a pixel": (
        "camera_flow/down.yaml",
        "centre_px: [15.5, 11.5]",
        "centre_px: [15.5, 12]",
        "camera_flow",
    ),
    "a rolling shutter that does not roll": (
        "camera_flow/rolling.yaml",
        "row_us: 1000",
        "row_us: 0",
        "camera_flow",
    ),
    "an aperture off by 0.5 %": (
        "camera_imager/up.yaml",
        "f_number: 4",
        "f_number: 3.98",
        "camera_imager",
    ),
    "more noise of reading": (
        "camera_imager/up.yaml",
        "read_noise_e: 12",
        "read_noise_e: 30",
        "camera_imager",
    ),
    "a lamp that is 1 % too large": (
        "camera_lamp/scene.yaml",
        "size_m: 0.6",
        "size_m: 0.606",
        "camera_lamp",
    ),
    "relief that is a millimetre too high": (
        "camera_truth/scene.yaml",
        "amplitude_m: 0.3",
        "amplitude_m: 0.301",
        "camera_truth",
    ),
    "bumps as relief": (
        "camera_truth/scene.yaml",
        "waves.png",
        "normals.png",
        "camera_truth",
    ),
    "bumps left out": (
        "camera_textures/scene.yaml",
        "normal: ../inputs/normals.png, ",
        "",
        "camera_textures",
    ),
    "a metal that is too rough": (
        "inputs/copper.yaml",
        "alpha: 0.15",
        "alpha: 0.2",
        "camera_materials",
    ),
    "motion off": (
        "inputs/passing.tum",
        "0.1 1004 999.4",
        "0.1 1004 998.8",
        "camera_blur",
    ),
    "the sun 2 degrees lower": (
        "camera_blur/scene.yaml",
        "elevation_deg: 50",
        "elevation_deg: 48",
        "camera_blur",
    ),
    "more haze": (
        "camera_clear_sky/scene.yaml",
        "visibility_m: 3000",
        "visibility_m: 2000",
        "camera_clear_sky",
    ),
    "sign of the elevation of a ring": (
        "inputs/eight_beams.yaml",
        "[3, -14,",
        "[3, 14,",
        "spinning_over_plane",
    ),
    "a head that turns the other way": (
        "inputs/eight_beams.yaml",
        "sense: clockwise",
        "sense: counter_clockwise",
        "camera_shows_echoes",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_fails_exactly_its_case(fault, tmp_path):
    file, old, new, found_by = FAULTS[fault]
    cases = copy_of_cases(tmp_path)
    replace(cases / file, old, new)
    control = "camera_constant_dome"
    result = golden("run", "--cases", cases, "--filter", found_by, control, "-o", tmp_path / "out")
    assert result.returncode == 1
    assert failures(tmp_path / "out/junit.xml") == {found_by}
    assert f"FAILED {found_by}" in result.stdout
    assert f"passed {control}" in result.stdout


def test_a_damaged_or_missing_reference_fails_its_case(tmp_path):
    cases = copy_of_cases(tmp_path)
    stored = cases / "camera_truth/expected/camera/ahead/000001.exr"
    stored.write_bytes(stored.read_bytes()[:-100])
    (cases / "camera_blur/expected/camera/ahead/000000.moments.exr").unlink()
    result = golden(
        "run", "--cases", cases, "--filter", "camera_truth", "camera_blur", "-o", tmp_path / "out"
    )
    assert result.returncode == 1
    assert failures(tmp_path / "out/junit.xml") == {"camera_truth", "camera_blur"}
    assert "000001.exr: " in result.stdout
    assert "000000.moments.exr: " in result.stdout


def test_a_failing_program_fails_its_case(tmp_path):
    cases = copy_of_cases(tmp_path)
    replace(cases / "camera_flow/scene.yaml", "duration_s: 0.3", "duration_s: -1")
    result = golden("run", "--cases", cases, "--filter", "camera_flow", "-o", tmp_path / "out")
    assert result.returncode == 1
    assert "ended with code 1" in result.stdout
    assert "duration_s" in result.stdout


def test_accepted_results_pass(tmp_path):
    cases = copy_of_cases(tmp_path)
    out = tmp_path / "out"
    replace(cases / "camera_truth/truth.yaml", "focal_px: [40, 40]", "focal_px: [41, 41]")
    run = ("run", "--cases", cases, "--filter", "camera_truth", "-o", out)
    assert golden(*run).returncode == 1
    accepted = golden("accept", "camera_truth", "--cases", cases, "-o", out)
    assert accepted.returncode == 0, accepted.stderr
    assert golden(*run).returncode == 0
    refused = golden("accept", "camera_lenses", "--cases", cases, "-o", out)
    assert refused.returncode == 1
    assert "nothing to store" in refused.stderr


def test_accepting_light_stores_moments_of_other_seeds(tmp_path):
    cases = copy_of_cases(tmp_path)
    out = tmp_path / "out"
    replace(cases / "camera_blur/ahead.yaml", "samples: 64", "samples: 1")
    assert golden("accept", "camera_blur/", "--cases", cases, "-o", out).returncode == 0
    run = golden("run", "--cases", cases, "--filter", "camera_blur", "-o", out)
    assert "standard deviations" not in run.stdout or run.returncode == 1
    stored = (cases / "camera_blur/expected/camera/ahead/000000.moments.exr").read_bytes()
    own = CASES / "camera_blur/expected/camera/ahead/000000.moments.exr"
    assert stored != own.read_bytes()


ROWS_LOST = """#!/usr/bin/env python3
import subprocess, sys
from pathlib import Path
from plyfile import PlyData, PlyElement
code = subprocess.run(["{program}", *sys.argv[1:]]).returncode
for scan in Path(sys.argv[4]).glob("lidar/*/*.ply"):
    ply = PlyData.read(scan)
    kept = ply["vertex"].data[:3]
    PlyData([PlyElement.describe(kept, "vertex")], comments=ply.comments).write(scan)
sys.exit(code)
"""


def test_missing_rows_are_detected(tmp_path):
    """All remaining rows are correct: only their number shows the fault."""
    program = tmp_path / "lossy"
    program.write_text(ROWS_LOST.format(program=PROGRAM).replace("/usr/bin/env python3", PYTHON))
    program.chmod(0o755)
    result = golden(
        "run", "--program", program, "--filter", "lidar", "over", "-o", tmp_path / "out"
    )
    assert result.returncode == 1
    names = {case.parent.name for case in CASES.glob("*/case.yaml")}
    asked = {name for name in names if "lidar" in name or "over" in name}
    assert failures(tmp_path / "out/junit.xml") == asked


def test_reports_are_readable_whatever_a_program_prints(tmp_path):
    program = tmp_path / "noisy"
    program.write_text("#!/bin/sh\nprintf '\\033[31m\\001\\377 <&> bad'\nexit 3\n")
    program.chmod(0o755)
    out = tmp_path / "out"
    result = golden("run", "--program", program, "--filter", "camera_flow", "-o", out)
    assert result.returncode == 1
    assert failures(out / "junit.xml") == {"camera_flow"}
    (failure,) = ET.parse(out / "junit.xml").getroot().iter("failure")
    assert "ended with code 3" in failure.get("message")
    json.loads((out / "report.json").read_text())


def test_one_run_at_a_time_writes_into_a_folder(tmp_path):
    run = ("run", "--filter", "camera_lamp", "-o", tmp_path / "out")
    with subprocess.Popen(
        [GOLDEN, *run], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as first:
        deadline = time.monotonic() + 60
        while not (tmp_path / "out/camera_lamp").exists() and time.monotonic() < deadline:
            time.sleep(0.005)
        second = golden(*run)
        assert first.wait(60) == 0
    assert second.returncode == 1
    assert "another run writes there" in second.stderr


def test_a_stopped_run_leaves_no_earlier_report(tmp_path):
    out = tmp_path / "out"
    assert golden("run", "--filter", "camera_flow", "-o", out).returncode == 0
    stopped = golden("run", "--filter", "camera_flow", "--program", "/nonexistent", "-o", out)
    assert stopped.returncode == 1
    assert "cannot be started" in stopped.stderr
    assert not list(out.glob("*.html")) + list(out.glob("*.json")) + list(out.glob("*.xml"))


def test_an_interrupt_stops_the_suite(tmp_path):
    command = [GOLDEN, "run", "-o", tmp_path / "out"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, **quiet, start_new_session=True) as run:
        deadline = time.monotonic() + 60
        while not list((tmp_path / "out").glob("*/log.txt")) and time.monotonic() < deadline:
            time.sleep(0.005)
        os.killpg(run.pid, signal.SIGINT)
        assert run.wait(30) == 130
    assert not (tmp_path / "out/report.json").exists()


def test_wrong_usage_and_missing_folders_are_reported(tmp_path):
    assert golden("run", "--jobs", "0").returncode == 2
    assert golden("judge").returncode == 2
    missing = golden("run", "--cases", tmp_path / "none")
    assert missing.returncode == 1
    assert "the folder of cases does not exist" in missing.stderr
    unknown = golden("run", "--filter", "no_such_case")
    assert unknown.returncode == 1
    assert "contains no case with 'no_such_case'" in unknown.stderr
