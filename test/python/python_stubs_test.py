"""Docstrings and stubs of the package."""

import inspect
import pydoc
import subprocess
import sys

import groundray
import pytest
import small_scene

PUBLIC = [name for name in groundray.__all__ if name != "__version__"]


# NDArray and PathLike in stubs are of any kind.
STRICT = "[mypy]\nstrict = True\n[mypy-groundray._core]\ndisallow_any_generics = False\n"


def check(folder, text):
    """Runs mypy on a program that uses the package."""
    (folder / "sample.py").write_text(text)
    return mypy(folder, STRICT, "sample.py")


def mypy(folder, settings, *what):
    (folder / "mypy.ini").write_text(settings)
    return subprocess.run(
        [sys.executable, "-m", "mypy", "--cache-dir", folder / "cache", *what],
        cwd=folder,
        capture_output=True,
        text=True,
        env={"MYPYPATH": str(small_scene.PACKAGE), "PATH": "/usr/bin"},
        check=False,
    )


def test_stubs_let_mypy_check_a_program(tmp_path):
    right = check(
        tmp_path,
        """\
from pathlib import Path

import groundray
import numpy as np

scene: groundray.Scene = groundray.load_scene(Path("trail.yaml"), seed=3)
scan = scene.lidar("roof").scan(t_s=0.0)
longest_m = float(np.max(scan["range_true_m"]))
names: list[str] = scan.columns + scene.camera("eye").expose(frame=1).keys()
terrain = groundray.Terrain(np.zeros((3, 4)), cell_m=2.0)
hits: groundray.Points = terrain.cast_rays([[0, 0, 9]], np.array([[0, 0, -1]]))
mesh, counts = groundray.reconstruct_mesh([scan], preset="strict")
small, figures = groundray.simplify(mesh, triangles=100)
same = groundray.compare(mesh, small)["figures"]
made = groundray.scene({"groundray": 1}, folder="scenes", terrain=terrain)
raise groundray.Error("no")
""",
    )
    assert right.returncode == 0, right.stdout
    wrong = check(
        tmp_path,
        """\
import groundray

groundray.load_scene(5)
groundray.load_scene("a.yaml").lidar("roof").scan(0.0)
groundray.load_scene("a.yaml").lidar("roof").sweep()
groundray.simplify("mesh.ply")
""",
    )
    errors = [line for line in wrong.stdout.splitlines() if ": error:" in line]
    kinds = [line.split(":")[1] + line.split("[")[-1] for line in errors]
    assert kinds == ["3arg-type]", "4call-arg]", "5attr-defined]", "6arg-type]"], wrong.stdout


def test_the_package_passes_mypy(tmp_path):
    """Covers all of its Python files, those of the programs too."""
    foreign = (
        "OpenEXR",
        "cv2",
        "distributed",
        "laspy",
        "lazrs",
        "mcap",
        "mcap_ros2",
        "pyarrow",
        "pyoidn",
        "pyproj",
        "rosbags",
        "torch",
    )  # some have types
    settings = STRICT + "".join(
        f"[mypy-{name}.*]\nignore_missing_imports = True\n" for name in foreign
    )
    result = mypy(tmp_path, settings, "-p", "groundray")
    assert result.returncode == 0, result.stdout
    files = int(result.stdout.split(" source files")[0].split()[-1])
    assert files >= len(list((small_scene.ROOT / "apps/python/groundray").rglob("*.py")))


def test_every_public_name_has_a_docstring():
    for name in PUBLIC:
        thing = getattr(groundray, name)
        assert inspect.getdoc(thing), name
        if not inspect.isclass(thing):
            continue
        assert thing.__module__ == "groundray"
        for member in vars(thing):
            if not member.startswith("_") and member not in {
                "name",
                "sensor",
                "duration_s",
                "seed",
            }:
                assert inspect.getdoc(getattr(thing, member)), f"{name}.{member}"
    assert repr(groundray.Error) == "<class 'groundray.Error'>"
    assert groundray.__version__ in (small_scene.ROOT / "CMakeLists.txt").read_text()


def test_help_states_shapes_units_and_frames():
    text = pydoc.render_doc(groundray.Lidar.scan)
    for words in ("t_s", "frame", "range_true_m", "x forward, y left", "seconds", "Raises"):
        assert words in text
    assert "n x 3" in pydoc.render_doc(groundray.Scene.cast_rays)
    assert "height x width" in pydoc.render_doc(groundray.Camera.expose)


@pytest.mark.parametrize("page", ["docs/guide/python.md"])
def test_the_page_lists_every_public_name(page):
    text = (small_scene.ROOT / page).read_text()
    missing = [
        name for name in PUBLIC if f"`{name}" not in text and f"`groundray.{name}" not in text
    ]
    assert missing == []
