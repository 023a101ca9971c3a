"""Links, pipes and full outputs in the way of the program: nothing else changes, and it ends."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("GROUNDRAY", ROOT / "build/release/bin/groundray"))
SCENE = ROOT / "data/scenes/first_light.yaml"
DEM = ROOT / "data/terrain/prairie_1m.tif"


def run(*arguments, **options):
    return subprocess.run(
        [PROGRAM, *map(str, arguments)],
        **({"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options),
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("link", [os.symlink, os.link])
@pytest.mark.parametrize("name", ["mesh.ply.part", "mesh.ply"])
def test_a_mesh_is_not_written_through_a_link(tmp_path, link, name):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    link(victim, tmp_path / name)
    options = ["--max-error-m", "1", "-o", tmp_path / "mesh.ply"]
    assert run("terrain", "mesh", DEM, *options).returncode == 0
    assert victim.read_text() == "precious"
    assert (tmp_path / "mesh.ply").read_bytes().startswith(b"ply")


@pytest.mark.parametrize("link", [os.symlink, os.link])
@pytest.mark.parametrize("name", ["dataset.yaml.part", "dataset.journal.part"])
def test_a_dataset_is_not_written_through_links(tmp_path, link, name):
    out, victim = tmp_path / "out", tmp_path / "victim"
    out.mkdir()
    victim.write_text("precious")
    link(victim, out / name)
    done = run("generate", SCENE, "-o", out)
    assert victim.read_text() == "precious"
    # It is written, or rejected because the folder is not empty.
    assert done.returncode == 0 or "is not empty" in done.stderr, done.stderr


def test_a_certificate_follows_no_link(tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "certificate.txt").write_text("precious")
    dem = tmp_path / "dem.tif"
    dem.write_bytes(DEM.read_bytes())
    for name in ("dem.tif.groundray", "dem.tif.groundray.part"):
        os.symlink(elsewhere, tmp_path / name)
    run("terrain", "certify", dem, env={"HOME": str(tmp_path)})
    assert (elsewhere / "certificate.txt").read_text() == "precious"
    assert os.listdir(elsewhere) == ["certificate.txt"]


@pytest.mark.parametrize("name", ["pipe.yaml", "pipe.ply"])
def test_pipes_are_rejected(tmp_path, name):
    os.mkfifo(tmp_path / name)
    command = ["generate"] if name.endswith("yaml") else ["reconstruct", "fill", "--fill-m", "1"]
    done = run(*command, tmp_path / name, "-o", tmp_path / "out.ply")
    assert done.returncode == 1
    assert name in done.stderr


def test_outputs_that_cannot_be_written_end_with_1():
    with open("/dev/full", "w") as full:
        assert run("info", "/nonexistent", stderr=full).returncode == 1
        done = run("info", DEM, stdout=full)
    assert done.returncode == 1
    assert done.stderr == "groundray: standard output cannot be written\n"
