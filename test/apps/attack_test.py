"""Links, pipes and full outputs in the way of the program: nothing else changes, and it ends."""

import json
import os
import re
import resource
import struct
import subprocess
import zlib
from pathlib import Path

import numpy as np
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


def escape_free(text):
    return not any((ord(c) < 32 and c not in "\n\t") or 127 <= ord(c) < 160 for c in text)


def test_names_from_files_do_not_control_the_terminal(tmp_path):
    out = tmp_path / "out"
    assert run("generate", SCENE, "-o", out).returncode == 0
    (out / "lidar/\x1b[2Jevil\r\x9b31m").write_text("")
    done = run("verify", out)
    assert done.returncode == 1
    assert "\\x1b[2Jevil\\x0d\\xc2\\x9b31m" in done.stdout
    assert escape_free(done.stdout + done.stderr)
    scene = tmp_path / "s\x1b]0;title\x07.yaml"
    scene.write_text('groundray: 1\nseed: 7\nlidars: "\\e[31m"\n"k\\e[2J": 1\n')
    for command in (["generate", "-o", tmp_path / "b"], ["info"]):
        done = run(command[0], scene, *command[1:])
        assert done.returncode == 1
        assert "\\x1b]0;title" in done.stderr
        assert escape_free(done.stderr)


def as_dataset(folder, sensors, frames):
    folder.mkdir()
    (folder / "dataset.yaml").write_text(
        "groundray_dataset: 1\ntime_origin_s: 0\norigin_w_m: [0, 0, 0]\n"
        f'crs: ""\nsensors:\n{sensors}\nframes:\n{frames}\n'
    )
    return folder


@pytest.mark.parametrize("name", ["../secret", "/etc/x", "a/b", ".."])
def test_a_dataset_names_no_sensor_outside_itself(tmp_path, name):
    dataset = as_dataset(
        tmp_path / "d",
        f"  - {{name: {name}, kind: lidar, number: 0, frames: 1}}",
        f"  - {{sensor: {name}, frame: 0, stamp_s: 0, state: done}}",
    )
    for what, ending in (("mesh", "ply"), ("dem", "tif")):
        done = run("reconstruct", what, dataset, "-o", tmp_path / f"out.{ending}")
        assert done.returncode == 1
        assert "is part of file names: only letters, digits" in done.stderr


def test_a_stereo_pair_names_no_camera_outside_the_dataset(tmp_path):
    dataset = as_dataset(
        tmp_path / "d",
        "  - {name: pair, kind: stereo, left: ../a, right: /b}",
        "  []",
    )
    options = ["--stereo", "pair", "--no-lidar", "--cell-m", "1", "-o", tmp_path / "out.tif"]
    done = run("reconstruct", "dem", dataset, *options)
    assert done.returncode == 1
    assert "key 'left': is '../a', but is part of file names" in done.stderr
    assert "key 'right': is '/b'" in done.stderr


def test_verify_leaves_what_links_lead_to_alone(tmp_path):
    """A link in place of an expected folder is followed, but not into folders beyond it."""
    out = tmp_path / "out"
    assert run("generate", SCENE, "-o", out).returncode == 0
    elsewhere = tmp_path / "elsewhere"
    (elsewhere / "private").mkdir(parents=True)
    (elsewhere / "private/letters").write_text("")
    for file in (out / "lidar/top").iterdir():
        file.rename(elsewhere / file.name)
    (out / "lidar/top").rmdir()
    os.symlink(elsewhere, out / "lidar/top")
    done = run("verify", out)
    assert "lidar/top/private: " in done.stdout
    assert "letters" not in done.stdout
    assert "1 fault" in done.stdout


def compare(file, out, memory_gib):
    """Compares a file with itself, with a limit of memory."""
    limits = (memory_gib << 30, memory_gib << 30)
    return subprocess.run(
        [PROGRAM.parent / "groundray-golden", "compare", file, file, "-o", out],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, limits),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def blank_png(side):
    pack = zlib.compressobj(9)
    packed = b"".join(pack.compress(bytes(side + 1)) for _ in range(side)) + pack.flush()
    header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        chunk(*each) for each in ((b"IHDR", header), (b"IDAT", packed), (b"IEND", b""))
    )


def test_a_small_picture_takes_little_memory(tmp_path):
    """It took 13.7 GiB."""
    picture = tmp_path / "a.png"
    picture.write_bytes(blank_png(16384))
    assert picture.stat().st_size < 300_000
    done = compare(picture, tmp_path / "out", 2)
    assert done.returncode == 1
    assert "it has 16384 x 16384 pixels; it must have at least one and at most" in done.stderr
    picture.write_bytes(blank_png(8192))
    done = compare(picture, tmp_path / "out", 2)
    assert done.returncode == 1
    message = r"a.png: its values and errors take 9\.2 GiB of memory, but [01]\.. GiB are"
    assert re.search(message, done.stderr)


def test_a_small_archive_takes_little_memory(tmp_path):
    archive = tmp_path / "a.npz"
    np.savez_compressed(archive, xyz=np.zeros((3 << 24, 3), np.float64))
    assert archive.stat().st_size < 2 << 20
    done = compare(archive, tmp_path / "out", 1)
    assert done.returncode == 1
    assert "xyz.npy: its unpacked bytes take 1.1 GiB of memory" in done.stderr


def test_a_file_larger_than_memory_is_not_read(tmp_path):
    """Nor is a line without an end, as in a search for the end of a header."""
    for name in ("a.ply", "a.obj", "a.stl", "a.glb", "a.npy", "a.pcd"):
        with (tmp_path / name).open("wb") as sparse:
            sparse.truncate(1 << 40)
        done = compare(tmp_path / name, tmp_path / "out", 4)
        assert done.returncode == 1
        assert f"{name}: its bytes take 1024.0 GiB of memory, but" in done.stderr, name


@pytest.mark.parametrize("name", ["pipe.stl", "pipe.glb", "pipe.obj", "pipe.exr", "pipe.png"])
def test_pipes_are_no_meshes_or_images(tmp_path, name):
    os.mkfifo(tmp_path / name)
    done = compare(tmp_path / name, tmp_path / "out", 4)
    assert done.returncode == 1
    assert name in done.stderr


def test_a_clock_that_jumps_changes_nothing(tmp_path):
    """The time of day is written to the log alone."""
    clock = {**os.environ, "LD_PRELOAD": str(PROGRAM.parent / "libjumping_clock.so")}
    outputs = []
    for name, variables in (("steady", os.environ), ("jumping", clock)):
        out, log = tmp_path / name, tmp_path / f"{name}.log"
        done = run("generate", SCENE, "-o", out, "--log-json", log, env=variables)
        assert done.returncode == 0, done.stderr
        outputs.append({p.relative_to(out): p.read_bytes() for p in out.rglob("*") if p.is_file()})
    assert outputs[0] == outputs[1]
    elapsed_s = [json.loads(line).get("elapsed_s", 0) for line in log.read_text().splitlines()]
    assert 0 < max(elapsed_s) < 100
    years = {json.loads(line)["time"][:4] for line in log.read_text().splitlines()}
    assert max(map(int, years)) - min(map(int, years)) == 20


def test_a_long_drive_is_refused_before_it_takes_all_memory(tmp_path):
    scene = tmp_path / "scene.yaml"
    text = SCENE.read_text().replace("../terrain", str(ROOT / "data/terrain"))
    scene.write_text(re.sub(r"duration_s: [0-9.]+", "duration_s: 100000", text))
    limit = (2 << 30, 2 << 30)
    done = run("info", scene, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, limit))
    assert done.returncode == 1
    assert "GiB are available; shorten duration_s" in done.stderr


def test_empty_arguments_are_named():
    done = run("info", "")
    assert done.returncode == 2
    assert done.stderr.startswith("argument 2 is empty")


def test_a_log_waits_for_no_reader_and_reports_a_full_disk(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    done = run("generate", SCENE, "-o", tmp_path / "a", "--log-json", tmp_path / "pipe")
    assert done.returncode == 1
    assert "it is a pipe that nobody reads" in done.stderr
    done = run("generate", SCENE, "-o", tmp_path / "b", "--log-json", "/dev/full")
    assert done.returncode == 0
    assert done.stderr.count("the log cannot be written: No space left on device") == 1
