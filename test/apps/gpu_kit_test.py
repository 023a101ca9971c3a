"""The worked example of docs/guide/gpu.md passes, and fails with a fault."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

cl = pytest.importorskip("pyopencl")

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))
GOLDEN = PROGRAM.parent / "groundray-golden"
TRACER = ROOT / "docs/guide/gpu_rays.py"


def run(*command):
    return subprocess.run(
        [*map(str, command)], capture_output=True, text=True, timeout=300, check=False
    )


@pytest.fixture(scope="module")
def passes(tmp_path_factory):
    try:
        cl.get_platforms()
    except cl.Error:
        pytest.skip("there is no OpenCL driver")
    folder = tmp_path_factory.mktemp("kit") / "passes"
    dem = ROOT / "data/terrain/prairie_1m.tif"
    options = ["--tolerance-m", "0.5", "--rays", "5000"]
    done = run(GOLDEN, "passes", dem, "-o", folder, *options)
    assert done.returncode == 0, done.stderr
    return folder


def judged(passes, theirs):
    done = run(GOLDEN, "conform", passes, theirs, "-o", theirs / "report")
    assert done.stderr == ""
    report = json.loads((theirs / "report/report.json").read_text())
    section = report["sections"][0]
    return done.returncode, {each["name"]: each["value"] for each in section["measures"]}


def test_the_example_conforms(passes, tmp_path):
    theirs = tmp_path / "theirs"
    done = run(sys.executable, TRACER, passes, theirs)
    assert done.returncode == 0, done.stderr
    code, measures = judged(passes, theirs)
    assert code == 0, measures
    assert measures["hits"] > 3000
    assert 0 < measures["largest error as a fraction of its budget"] < 0.2


def test_the_other_winding_fails(passes, tmp_path):
    theirs, faulty = tmp_path / "theirs", tmp_path / "faulty.py"
    text = TRACER.read_text()
    assert "cross(ab, ac)" in text
    faulty.write_text(text.replace("cross(ab, ac)", "cross(ac, ab)"))
    assert run(sys.executable, faulty, passes, theirs).returncode == 0
    code, measures = judged(passes, theirs)
    assert code == 1
    hits = np.count_nonzero(np.load(passes / "rays/triangle.npy") >= 0)
    assert measures["other triangles away from edges and silhouettes"] > 0.9 * hits
