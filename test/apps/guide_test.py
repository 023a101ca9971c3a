"""The examples of the user's guide and the README, run as a reader would.

Each page has a folder of its own with a copy of data/; its sections run in their order, in a shell
that finds the programs. What a fenced block is, its first line tells:

    ```yaml NAME       a file, written under that name; likewise any other language with a name
    ```sh              commands, all of which must succeed
    ```console         commands after $ and what they print, results before messages; ... is any
                       text, or alone in a line any lines. What prints "groundray: ..." must fail
    ```python          a script
    ```sh not-run: WHY   left out, for that reason
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NoReturn

import pytest
from markdown_page import Block, Page

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ROOT / "build/release/bin"
PACKAGE = Path(os.environ.get("GROUNDRAY_PACKAGE", ROOT / "build/release/python"))
PAGES = ["docs/guide/guide.md", "README.md"]
COMMANDS = ("sh", "console", "python")
LEFT_OUT = 6  # blocks that are not run; a new one is a choice to make here, too


def sections() -> list[tuple[str, str]]:
    found = []
    for page in PAGES:
        blocks = Page(ROOT / page).blocks
        found += dict.fromkeys((page, block.section) for block in blocks)
    return found


def reason_left_out(block: Block) -> str | None:
    found = re.fullmatch(r"not-run: (.+)", block.words)
    return found[1] if found else None


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A folder for each page, with the files that its examples require."""
    made = {}
    for page in PAGES:
        folder = made[page] = tmp_path_factory.mktemp(Path(page).stem)
        leave_out = shutil.ignore_patterns("*.groundray")
        shutil.copytree(ROOT / "data", folder / "data", ignore=leave_out)
    make_small_demo(made["README.md"])
    return made


def make_small_demo(folder: Path) -> None:
    """The result of `./dev demo`, from a shorter run with smaller images."""
    scenes = folder / "data/scenes"
    scene = (scenes / "offroad_trail.yaml").read_text(encoding="utf-8")
    camera = (scenes / "trail_camera.yaml").read_text(encoding="utf-8")
    scene, changes = re.subn(r"(?m)^duration_s: 1$", "duration_s: 0.1", scene)
    fisheye = r"(?ms)^  - name: fisheye\n.*?^(?=stereo)"
    scene, more = re.subn(fisheye, "", scene)
    for old, new in [
        ("first_ms: 500", "first_ms: 0"),
        ("size_px: [640, 480]", "size_px: [160, 120]"),
        ("focal_px: [457, 457]", "focal_px: [114, 114]"),
        ("centre_px: [319.5, 239.5]", "centre_px: [79.5, 59.5]"),
    ]:
        more += camera.count(old)
        camera = camera.replace(old, new)
    assert changes + more == 6, "the demo's scene has changed: make it small in another way"
    (scenes / "small_trail.yaml").write_text(scene, encoding="utf-8")
    (scenes / "trail_camera.yaml").write_text(camera, encoding="utf-8")
    result = run_shell(
        "groundray generate data/scenes/small_trail.yaml -o out/offroad_trail", folder
    )
    assert result.returncode == 0, output_of(result)


def environment(folder: Path) -> dict[str, str]:
    """The shell's environment, with the programs and this Python first, without a display."""
    first = [PROGRAMS, Path(sys.executable).parent]
    path = os.pathsep.join([*map(str, first), os.environ["PATH"]])
    hidden = ("DISPLAY", "WAYLAND_DISPLAY")
    return {name: value for name, value in os.environ.items() if name not in hidden} | {
        "PATH": path,
        "PYTHONPATH": str(PACKAGE),
    }


def run(arguments: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        arguments,
        cwd=folder,
        env=environment(folder),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def output_of(result: subprocess.CompletedProcess[str]) -> str:
    """Results, then messages and progress, whose relative order is lost in files."""
    return (result.stdout + result.stderr).strip()


def run_shell(text: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return run(["bash", "-euo", "pipefail", "-c", text], folder)


def fail(where: str, why: str) -> NoReturn:
    pytest.fail(f"{where}: {why}", pytrace=False)


def pattern_of(expected: str) -> str:
    """Returns a regular expression for output: a line of ... is any lines, otherwise any text."""
    pattern = ""
    for line in expected.strip().splitlines():
        text = r".*".join(re.escape(piece) for piece in line.split("..."))
        pattern += r"(?:.*\n)*" if line == "..." else text + r"\n"
    return pattern


def check_console(block: Block, folder: Path, where: str) -> None:
    """Runs each command after $ and compares what it prints."""
    for part in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
        command, _, expected = part.partition("\n")
        result = run_shell(command, folder)
        said = output_of(result)
        fails = re.search(r"^groundray[a-z-]*: ", expected, re.MULTILINE) is not None
        if result.returncode != (1 if fails else 0):
            fail(where, f"{command}\nends with {result.returncode} and says\n{said}")
        if not re.fullmatch(pattern_of(expected), said + "\n" if said else ""):
            fail(where, f"{command}\nprints\n{said}\nnot\n{expected}")


def run_block(block: Block, folder: Path, where: str) -> None:
    if block.language not in COMMANDS:
        if not re.fullmatch(r"[\w./-]+", block.words):
            fail(where, "which file is this? its first line must name it")
        (folder / block.words).write_text(block.text, encoding="utf-8")
    elif block.language == "console":
        check_console(block, folder, where)
    else:
        python = block.language == "python"
        result = (
            run([sys.executable, "-c", block.text], folder)
            if python
            else run_shell(block.text, folder)
        )
        if result.returncode != 0:
            fail(where, f"this fails:\n{block.text}\nit says\n{output_of(result)}")


@pytest.mark.parametrize(("page", "section"), sections())
def test_examples_run_as_written(page: str, section: str, folders: dict[str, Path]) -> None:
    blocks = [block for block in Page(ROOT / page).blocks if block.section == section]
    for block in blocks:
        if reason_left_out(block) is None:
            run_block(block, folders[page], f"{page}:{block.line}")


def test_skipped_examples_are_marked_and_few() -> None:
    blocks = [block for page in PAGES for block in Page(ROOT / page).blocks]
    left_out = [reason for block in blocks if (reason := reason_left_out(block))]
    assert len(left_out) == LEFT_OUT, left_out
    runs = [block for block in blocks if block.language in COMMANDS and not block.words]
    assert len(runs) > 3 * LEFT_OUT
