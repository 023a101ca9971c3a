"""Every file that the programs write is a new one, never what a link of its name leads to.

`traced_opens` lists what a program opens to write it. A name is safe if it was created there, with
O_EXCL, before anything else writes to it (GDAL, say). Then a second run finds links
at all of these names, and nothing that they lead to may change.
"""

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from dataset_runs import PROGRAM, ROOT, files, generate

GOLDEN = PROGRAM.with_name("groundray-golden")
LIBRARY = PROGRAM.parent / "libtraced_opens.so"
DEM = ROOT / "data/terrain/prairie_1m.tif"


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    assert generate(folder).returncode == 0
    for part in "12":
        assert generate(folder, "--shard", f"{part}/2", out=f"shard{part}").returncode == 0
    assert run([GOLDEN, "passes", DEM, "-o", folder / "passes", "--rays", "10"]).returncode == 0
    shutil.copytree(folder / "passes", folder / "theirs")
    (folder / "theirs/manifest.json").write_text(
        '{"implementation": "a copy", "classes": ["bytes"]}'
    )
    return folder


COMMANDS = {
    "generate": lambda given, out: [
        *(PROGRAM, "generate", given / "scene.yaml", "-o", out / "run"),
        *("--log-json", out / "log.jsonl"),
    ],
    "merge": lambda given, out: [
        *(PROGRAM, "merge", given / "shard1", given / "shard2", "-o", out / "run")
    ],
    **{
        f"terrain mesh {ending}": lambda given, out, ending=ending: [
            *(PROGRAM, "terrain", "mesh", DEM, "--max-error-m", "1", "-o", out / f"a.{ending}")
        ]
        for ending in ("ply", "obj", "stl", "glb")
    },
    "terrain certify": lambda given, out: [PROGRAM, "terrain", "certify", out / "dem.tif"],
    "terrain fill": lambda given, out: [
        *(PROGRAM, "terrain", "fill", DEM, "-o", out / "a.tif", "--sd-out", out / "sd.tif")
    ],
    "reconstruct mesh": lambda given, out: [
        *(PROGRAM, "reconstruct", "mesh", given / "out", "-o", out / "a.ply"),
        *("--report", out / "a.json", "--occlusion", out / "faces.ply"),
    ],
    "reconstruct dem": lambda given, out: [
        *(PROGRAM, "reconstruct", "dem", given / "out", "--cell-m", "0.5", "-o", out / "a.tif"),
        *("--report", out / "a.json", "--picture", out / "a.png"),
        *("--truth", DEM, "--error-map", out / "error.tif"),
    ],
    "compare": lambda given, out: [GOLDEN, "compare", DEM, DEM, "-o", out / "report"],
    "passes": lambda given, out: [GOLDEN, "passes", DEM, "-o", out / "arrays", "--rays", "10"],
    "conform": lambda given, out: [
        *(GOLDEN, "conform", given / "passes", given / "theirs", "-o", out / "report")
    ],
}


def run(command, **variables):
    return subprocess.run(
        [*map(str, command)],
        env={**os.environ, "HOME": "/nonexistent", **variables},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def fresh(out):
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    shutil.copyfile(DEM, out / "dem.tif")


@pytest.mark.skipif(not LIBRARY.exists(), reason="the build has no traced_opens")
@pytest.mark.parametrize("what", COMMANDS)
def test_every_written_file_is_new(inputs, tmp_path, what):
    out, opened = tmp_path / "out", tmp_path / "opened"
    fresh(out)
    done = run(COMMANDS[what](inputs, out), LD_PRELOAD=str(LIBRARY), OPENS=str(opened))
    assert done.returncode == 0, done.stderr
    created, unsafe = set(), []
    for line in opened.read_text().splitlines():
        how, name = line.split(" ", 1)
        path = Path(os.path.normpath(name))
        if how == "new":
            created.add(path)
        elif path.parent.name == "dem.tif.groundray.part":
            created.add(path)  # in a folder that was found empty, and is locked
        elif path not in created and not str(path).startswith(("/dev/", "/proc/")):
            unsafe.append(path)
    # The log is appended to, by whatever name it is given.
    assert unsafe == ([out / "log.jsonl"] if what == "generate" else [])
    written = {path for path in files(out) if path not in ("dem.tif", "log.jsonl")}
    assert written
    assert created

    victim = tmp_path / "victim"
    victim.write_text("precious")
    fresh(out)
    for planted in sorted(created | {out / path for path in written}):
        planted.parent.mkdir(parents=True, exist_ok=True)
        planted.symlink_to(victim)
    run(COMMANDS[what](inputs, out))
    assert victim.read_text() == "precious"
