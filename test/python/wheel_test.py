"""The package as installed by pip, and the metadata of the wheel.

A wheel is put together of two parts, by the tools that `pip install .` uses: its Python files,
licences and metadata by scikit-build-core, its module, stubs and data by CMake's component `python`
from the build tree that is there. Not held here: that scikit-build-core, in a build of its own,
compiles the libraries with the settings of pyproject.toml, and that pip gets what a build needs.
"""

import email
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile

import pytest
from small_scene import PACKAGE, ROOT

pytest.importorskip("scikit_build_core", reason="pip install scikit-build-core makes the wheel")
if not list((PACKAGE / "groundray").glob("_core.*.so")) or shutil.which("cmake") is None:
    pytest.skip(
        f"{PACKAGE} has no package groundray, or there is no cmake", allow_module_level=True
    )

SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())
# numpy and yaml are the package's own needs; nothing else of this test's environment is to be seen.
SCAN = """\
import sys
from pathlib import Path

import groundray

spec = {
    "groundray": 1,
    "seed": 3,
    "duration_s": 0.1,
    "terrain": {"dem": sys.argv[1]},
    "platform": {
        "drive": {
            "waypoints_m": [[429436, 5150654], [429441, 5150659]],
            "speed_m_s": 5,
            "height_m": 1,
        }
    },
    "lidars": [
        {"name": "roof", "preset": sys.argv[2], "mount": {"translation_m": [0, 0, 1]}},
    ],
}
scan = groundray.scene(spec).lidar("roof").scan(frame=0)
print(groundray.__version__, len(scan), Path(groundray.__file__).parent)
"""


def run(*command, **environment):
    done = subprocess.run(
        [str(word) for word in command],
        env={"PATH": os.environ["PATH"], "HOME": "/nonexistent", **environment},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The part of the wheel that needs no compiler."""
    folder = tmp_path_factory.mktemp("wheel")
    run(
        *(sys.executable, "-m", "pip", "wheel", ROOT, "--quiet", "--disable-pip-version-check"),
        *("--no-build-isolation", "--no-deps", "--no-index", "--wheel-dir", folder),
        *("--config-settings", "wheel.cmake=false"),
        # With their defaults pip would build in the sources.
        *("--config-settings", f"build-dir={folder / 'build'}"),
    )
    (file,) = folder.glob("*.whl")
    return file


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """A folder with only the complete package."""
    folder = tmp_path_factory.mktemp("installed")
    run(
        *(sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"),
        *("--no-deps", "--no-index", "--target", folder, wheel),
    )
    (component,) = SETTINGS["tool"]["scikit-build"]["install"]["components"]
    install = ["cmake", "--install", ROOT / "build/release", "--strip"]
    run(*install, "--component", component, "--prefix", folder)
    return folder


def metadata_of(wheel):
    with zipfile.ZipFile(wheel) as file:
        (name,) = [each for each in file.namelist() if each.endswith(".dist-info/METADATA")]
        return email.message_from_bytes(file.read(name))


def test_the_wheel_states_its_licences_and_contains_their_texts(wheel):
    metadata = metadata_of(wheel)
    assert metadata["Name"] == "groundray"
    assert (
        f"project(groundray VERSION {metadata['Version']}" in (ROOT / "CMakeLists.txt").read_text()
    )
    assert metadata["License-Expression"] == (
        "Apache-2.0 AND GPL-3.0-or-later AND BSD-3-Clause AND MIT"
    )
    names = {"LICENSE"} | {
        str(each.relative_to(ROOT)) for each in (ROOT / "data/LICENSES").iterdir()
    }
    assert set(metadata.get_all("License-File")) == names
    with zipfile.ZipFile(wheel) as file:
        (licences,) = {n.split("/")[0] for n in file.namelist() if ".dist-info/" in n}
        for name in names:
            assert file.read(f"{licences}/licenses/{name}") == (ROOT / name).read_bytes()
    for name, holder in (
        ("cgal_gpl_3", "GNU GENERAL PUBLIC LICENSE"),
        ("nanobind", "Wenzel Jakob"),
        ("openmesh", "RWTH-Aachen University"),
        ("robin_map", "Goetghebuer-Planchon"),
    ):
        assert holder in (ROOT / f"data/LICENSES/{name}.txt").read_text()


def test_the_complete_package_is_installed_and_nothing_else(installed):
    tops = {each.name for each in installed.iterdir()} - {"bin"}
    assert {re.sub(r"-.*dist-info$", ".dist-info", each) for each in tops} == {
        "groundray",
        "groundray.dist-info",
    }
    package, sources = installed / "groundray", ROOT / "apps/python/groundray"
    own = {str(f.relative_to(sources)) for f in sources.rglob("*") if "__pycache__" not in f.parts}
    found = {
        str(f.relative_to(package)) for f in package.rglob("*") if "__pycache__" not in f.parts
    }
    assert own <= found
    rest = {each for each in found - own if not re.match(r"data(/|$)", each)}
    assert "_core.pyi" in rest
    assert len(rest) == 2, rest
    data = {str(f.relative_to(ROOT)) for f in (ROOT / "data").rglob("*") if f.is_file()}
    certificates = {each for each in data if ".groundray/" in each}
    assert {each for each in data - certificates if "__pycache__" not in each} <= found
    assert not any(".groundray" in each for each in found)


def test_the_installed_package_scans_with_its_own_presets(installed, tmp_path):
    """A preset that only the installed folder has is found, so no other folder is read."""
    sensors = installed / "groundray/data/sensors"
    shutil.copy(sensors / "velodyne_vlp16.yaml", sensors / "only_here.yaml")
    try:
        (tmp_path / "scan.py").write_text(SCAN)
        dem = installed / "groundray/data/terrain/prairie_1m.tif"
        reported = run(
            *(sys.executable, "-P", tmp_path / "scan.py", dem, "only_here"),
            PYTHONPATH=str(installed),
        )
    finally:
        (sensors / "only_here.yaml").unlink()
    version, points, package = reported.split()
    assert f"VERSION {version}" in (ROOT / "CMakeLists.txt").read_text()
    assert int(points) > 10_000
    assert package == str(installed / "groundray")


def test_the_installed_program_runs(installed):
    reported = run(installed / "bin/groundray-export", "--help", PYTHONPATH=str(installed))
    assert reported.startswith("usage: groundray-export ")
    module = run(
        *(sys.executable, "-P", "-m", "groundray.export", "--help"),
        PYTHONPATH=str(installed),
    )
    assert module == reported
    reported = run(installed / "bin/groundray-index", "--help", PYTHONPATH=str(installed))
    assert reported.startswith("usage: groundray-index ")


def test_a_script_runs_the_program_of_its_name_in_the_package(tmp_path):
    for folder in ("bin", "site/groundray/bin"):
        (tmp_path / folder).mkdir(parents=True)
    script = tmp_path / "bin/groundray"
    shutil.copy(ROOT / "apps/python/run_program.py", script)
    bare = subprocess.run([sys.executable, "-S", script], capture_output=True, text=True, env={})
    assert bare.returncode == 1
    assert "has no package groundray: pip install groundray" in bare.stderr
    (tmp_path / "site/groundray/__init__.py").write_text("raise ImportError('it is not imported')")
    program = tmp_path / "site/groundray/bin/groundray"
    program.write_text('#!/bin/sh\necho "$GROUNDRAY_PYTHON|$1|$2"\nexit 3\n')
    program.chmod(0o755)
    done = subprocess.run(
        [sys.executable, script, "a b", "c"],
        capture_output=True,
        text=True,
        env={"PYTHONPATH": str(tmp_path / "site")},
    )
    assert (done.returncode, done.stdout) == (3, f"{sys.executable}|a b|c\n"), done.stderr


def test_pip_and_the_tests_use_the_same_build_tools():
    """Otherwise the wheel would be built by other versions than tested."""
    pins = (ROOT / "test/requirements.txt").read_text().splitlines()
    requires = SETTINGS["build-system"]["requires"]
    assert {each.split("==")[0] for each in requires} == {"nanobind", "scikit-build-core"}
    assert [each for each in requires if each not in pins] == []


def test_targets_and_options_of_pip_exist_in_cmake():
    settings = SETTINGS["tool"]["scikit-build"]
    assert settings["wheel"]["packages"] == ["apps/python/groundray"]
    cmake = (ROOT / "apps/python/CMakeLists.txt").read_text()
    built = cmake + "".join(file.read_text() for file in ROOT.glob("apps/*/CMakeLists.txt"))
    for target in settings["build"]["targets"]:
        assert re.search(rf"(add_executable|nanobind_add_stub)\({target}\s", built), target
    for component in settings["install"]["components"]:
        assert f"COMPONENT {component} " in cmake
    options = (ROOT / "CMakeLists.txt").read_text()
    for name in settings["cmake"]["define"]:
        assert name.startswith("CMAKE_") or f"option({name} " in options, name
