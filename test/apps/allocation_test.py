"""Every single allocation that fails ends the program with one message, and leaves nothing behind.

`failing_new` lets one call of `operator new` fail. Calls are told apart by their stacks, so each
place of the program that allocates is one case, however often it does.
"""

import hashlib
import os
import random
import re
import shutil
import signal
import subprocess
from pathlib import Path

import pytest
from dataset_runs import PROGRAM, ROOT, SCENE, files, generate

IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
LIBRARY = PROGRAM.parent / "libfailing_new.so"
DEM = ROOT / "data/terrain/prairie_1m.tif"
SHORT = SCENE.replace("duration_s: 0.3", "duration_s: 0.1")
# GDAL and PROJ use what failed: see docs/reference/trust.md.
UNSAFE = re.compile(r"lib(gdal|proj)\.so")


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    assert generate(folder, scene=SHORT).returncode == 0
    for part in "12":
        done = generate(folder, "--shard", f"{part}/2", scene=SHORT, out=f"shard{part}")
        assert done.returncode == 0, done.stderr
    return folder


def arguments(what, inputs, out):
    return {
        "generate": ["generate", inputs / "scene.yaml", "-o", out / "run"],
        "verify": ["verify", inputs / "out"],
        "merge": ["merge", inputs / "shard1", inputs / "shard2", "-o", out / "run"],
        "terrain mesh": ["terrain", "mesh", DEM, "--max-error-m", "1", "-o", out / "a.ply"],
        "reconstruct mesh": ["reconstruct", "mesh", inputs / "out", "-o", out / "a.ply"],
        "reconstruct dem": [
            *("reconstruct", "dem", inputs / "out", "--cell-m", "0.5", "-o", out / "a.tif")
        ],
    }[what]


def hashes(folder):  # of whose differences a message can be made in time
    return {name: hashlib.sha256(data).hexdigest() for name, data in files(folder).items()}


def run(what, inputs, out, **variables):
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    return subprocess.run(
        [PROGRAM, *map(str, arguments(what, inputs, out))],
        env={**os.environ, "LD_PRELOAD": str(LIBRARY), **variables},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def calls(what, inputs, out):
    """Returns the stacks of all allocations of a command, and the files whose code allocates."""
    record = out.with_suffix(".calls")
    done = run(what, inputs, out, NEW_CALLS=str(record))
    assert done.returncode == 0, done.stderr
    lines = (line.split(" ", 1) for line in record.read_text().splitlines())
    return [(name, Path(file).name) for name, file in lines]


def is_in_cli11(stack):
    """Returns whether CLI11 copied an argument in its noexcept search: see trust.md."""
    places = re.findall(rf"{re.escape(str(PROGRAM))}\(\+(0x[0-9a-f]+)\)", stack)
    done = subprocess.run(
        ["addr2line", "-Cfie", PROGRAM, *places], capture_output=True, text=True, check=True
    )
    return "CLI::App::_find_subcommand" in done.stdout


def check(what, inputs, out, name, whole):
    done = run(what, inputs, out, NEW_FAILS=name, NEW_SHOWN="1")
    stack = done.stderr  # begins with the stack
    if done.returncode == -signal.SIGABRT and is_in_cli11(stack):
        assert not files(out), stack
        return
    if done.returncode == 0:  # what failed was not needed
        assert hashes(out) == whole, stack
        return
    assert done.returncode == 1, stack
    messages = [line for line in stack.splitlines() if line.startswith("groundray: ")]
    assert len(messages) == 1, stack
    if what == "generate":  # the run is incomplete, and is resumed
        if not (out / "run/dataset.yaml").exists():
            assert not files(out).keys() - {"run/dataset.yaml.part"}, stack
        return
    if what != "merge":
        assert not files(out), stack


@pytest.mark.skipif(not LIBRARY.exists(), reason="the build has no failing_new")
@pytest.mark.parametrize(
    "what",
    ["generate", "verify", "merge", "terrain mesh", "reconstruct mesh", "reconstruct dem"],
)
def test_a_failing_allocation_at_any_place_ends_with_one_message(inputs, tmp_path, what):
    out = tmp_path / "out"
    found = calls(what, inputs, out)
    whole = hashes(out)
    assert any(file == "groundray" or file == "" for _, file in found)
    safe = [name for name, file in found if not UNSAFE.match(file)]
    for name in random.Random(5).sample(safe, min(len(safe), 600 if IS_FULL else 24)):
        check(what, inputs, out, name, whole)


@pytest.mark.skipif(not LIBRARY.exists(), reason="the build has no failing_new")
def test_a_run_without_memory_resumes_to_the_same_bytes(inputs, tmp_path):
    out = tmp_path / "out"
    whole = hashes(inputs / "out")
    found = calls("generate", inputs, out)
    own = [name for name, file in found if not UNSAFE.match(file)]
    interrupted = 0
    for name in random.Random(7).sample(own, 40 if IS_FULL else 6):
        done = run("generate", inputs, out, NEW_FAILS=name)
        interrupted += done.returncode == 1
        again = subprocess.run(
            [PROGRAM, "generate", inputs / "scene.yaml", "-o", out / "run", "--resume"],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        assert again.returncode == 0, again.stderr
        assert hashes(out / "run") == whole, name
    assert interrupted > 0
