"""Tests of .ci/include_rules.py on small trees."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / ".ci/include_rules.py"


def check(folder: Path) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, SCRIPT], cwd=folder, capture_output=True, text=True)


def test_the_tree_follows_the_rules():
    outcome = check(ROOT)
    assert (outcome.returncode, outcome.stdout) == (0, "")


@pytest.mark.parametrize(
    ("source", "include", "rule"),
    [
        ("core/geometry/pose.h", '"core/io/ply_io.h"', "core/geometry may not include core/io"),
        ("core/io/ply_io.cpp", '"terrain/ground.h"', "core/io may not include terrain"),
        (
            "sensors/lidar/lidar.cpp",
            '"reconstruction/run_control.h"',
            "sensors/lidar may not include reconstruction",
        ),
        (
            "sensors/camera/lens/lens.cpp",
            '"apps/scene/yaml_reader.h"',
            "sensors/camera/lens may not include apps/scene",
        ),
        ("sensors/lidar/lidar.cpp", "<yaml-cpp/yaml.h>", "only apps/scene/yaml_(reader|writer)"),
        ("core/tracing/scene.cpp", "<embree4/rtcore.h>", "only core/tracing/embree_adapter"),
        ("terrain/lod/quadtree.cpp", "<gdal_priv.h>", "only terrain/dem/"),
        ("apps/scene/simulation.cpp", "<QWidget>", "only apps/view/window"),
        ("terrain/ground.h", "<tbb/parallel_for.h>", "a header of a library includes std"),
    ],
)
def test_an_include_against_a_rule_is_reported(tmp_path, source, include, rule):
    file = tmp_path / source
    file.parent.mkdir(parents=True)
    file.write_text(f"// A source.\n#include {include}\n")
    outcome = check(tmp_path)
    assert outcome.returncode == 1
    assert f"{source}:2: #include {include}: {rule}" in outcome.stdout


OPENED = "open files by core/io/open_file.h"
INEXACT = "use core/math.h"


@pytest.mark.parametrize(
    ("call", "advice"),
    [
        ('std::FILE* file = std::fopen("a", "wb");', OPENED),
        ('std::ifstream file("a");', OPENED),
        ("file.open(path, std::ios::binary);", OPENED),
        ("open(path, O_CREAT | O_TRUNC);", OPENED),
        ("const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);", OPENED),
        ("std::filebuf buffer;", OPENED),
        ("y = std::sin(a);", INEXACT),
        ("y = std::erfcf(x);", INEXACT),
        ("using std::atan2;", INEXACT),
        ("std::transform(a, b, c, std::log);", INEXACT),
        ("y = std::arg(z);", INEXACT),
        ("q = glm::slerp(a, b, 0.5);", INEXACT),
        ("y = ::exp(x);", INEXACT),
        ("return pow(a, b);", INEXACT),
    ],
)
def test_a_call_that_belongs_elsewhere_is_reported(tmp_path, call, advice):
    file = tmp_path / "core/io/ply_io.cpp"
    file.parent.mkdir(parents=True)
    file.write_text(f"// std::sinks, math::sin(a) and math::pow(a, b) are allowed.\n{call}\n")
    outcome = check(tmp_path)
    assert outcome.returncode == 1
    assert "core/io/ply_io.cpp:2: " in outcome.stdout
    assert advice in outcome.stdout
    assert "ply_io.cpp:1" not in outcome.stdout


def test_a_rule_that_nothing_uses_is_reported(tmp_path):
    outcome = check(tmp_path)
    assert outcome.returncode == 1
    assert "FOLDERS: core/io no longer includes core/geometry: delete it there" in outcome.stdout
