"""groundray-index: one message for each mistake and each damage, and no partial files."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest
from export_runs import PACKAGE, names_in
from index_runs import command, fails, index, worlds_folder

COMMAND = [sys.executable, "-m", "groundray.index"]


@pytest.fixture
def data(tmp_path):
    """A folder with copies of two datasets that tests may modify, in a folder of their own."""
    for world in ("000000", "000001"):
        shutil.copytree(worlds_folder() / world, tmp_path / "data" / world)
    return tmp_path / "data"


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (["-o", "index.csv"], "index.csv must end in .parquet"),
        (["-o", "i.parquet", "--report", "r.pdf"], "r.pdf must end in .html"),
        (["-o", "i.parquet", "--split", "a=0.5,b=0.4"], "the shares sum to 0.9, but must sum to 1"),
        (["-o", "i.parquet", "--seed", "3"], "--seed applies to --split"),
        (["-o", "i.parquet", "--split", "a=1", "--seed", "-3"], "--seed"),
        ([], "-o"),
    ],
)
def test_wrong_usage_is_reported_before_anything_is_read(capsys, options, rule):
    with pytest.raises(SystemExit) as stopped:
        command.main(["nowhere", *options])
    assert stopped.value.code == 2
    assert rule in capsys.readouterr().err


def test_folders_without_datasets_are_reported(data, capsys):
    (data / "empty").mkdir()
    out = data.parent
    line = fails(capsys, out, source=data / "empty")
    assert "empty: there is no dataset.yaml in it or below; give an output of groundray" in line
    assert "data/00000: there is no such folder; did you mean '00000" in fails(
        capsys, out, source=data / "00000"
    )
    line = fails(capsys, out, source=data / "000000/dataset.yaml")
    assert "it is a file; give the folder that groundray generate wrote" in line


def test_one_world_cannot_be_split(data, capsys):
    line = fails(capsys, data.parent, "--split", "train=0.8,test=0.2", source=data / "000000")
    assert "the datasets show one world, which cannot be divided among train, test: " in line


def test_the_same_frame_twice_is_reported(data, capsys):
    shutil.copytree(data / "000001", data / "copy")
    line = fails(capsys, data.parent, source=data)
    assert "data/copy: frame 0 of top is also in " in line
    assert "data/000001, a dataset of the same world and seed; leave out one of them" in line


def test_pending_frames_are_rejected_or_reported(data, capsys):
    record = data / "000001/dataset.yaml"
    text = record.read_text()
    line = next(each for each in text.splitlines() if 'sensor: "top", frame: 1' in each)
    record.write_text(text.replace(line, line.replace("done", "pending")))
    reported = fails(capsys, data.parent, source=data)
    assert "data/000001: 1 of its frames are pending; finish it with groundray generate" in reported
    out = data.parent / "index.parquet"
    assert index(out, "--skip-pending", source=data) == 0
    assert capsys.readouterr().out == (
        f"note: 1 frames are pending and skipped\n{out}: 7 frames of 2 datasets, 2 worlds\n"
    )


@pytest.mark.parametrize(
    ("file", "spoil", "rule"),
    [
        ("dataset.yaml", lambda data: data[: len(data) // 2], "dataset.yaml"),
        ("dataset.yaml", lambda data: data.replace(b"world: 1", b"world: one"), "world = one must"),
        ("dataset.yaml", lambda data: data.replace(b"\nseed: ", b"\nseed: -"), "must be a whole"),
        ("dataset.yaml", lambda data: data.replace(b"\ndrawn: {", b"\ndrawn: [{"), "dataset.yaml"),
        ("calibration/eye.yaml", None, "cannot read it: No such file or directory"),
        ("poses/top.tum", lambda data: data[:-20], "was the file cut short?"),
        ("poses/top.tum", None, "cannot read it: No such file or directory"),
        ("lidar/top/000001.ply", lambda data: data[:-1], "its header requires"),
        ("lidar/top/000001.ply", None, "although dataset.yaml lists it as done"),
        ("camera/eye/000000.exr", lambda data: data[: len(data) // 2], "it is damaged"),
        ("camera/eye/000000.exr", lambda data: b"", "it is damaged"),
    ],
)
def test_each_damage_is_reported_with_its_file(data, capsys, file, spoil, rule):
    damaged = data / "000001" / file
    if spoil is None:
        damaged.unlink()
    else:
        damaged.write_bytes(spoil(damaged.read_bytes()))
    line = fails(capsys, data.parent, "--report", data.parent / "report.html", source=data)
    assert f"data/000001/{file}" in line
    assert rule in line


def test_images_without_files_are_reported(data, capsys):
    shutil.rmtree(data / "000001/camera/eye")
    line = fails(capsys, data.parent, source=data)
    assert "data/000001/camera/eye/000000.*: there is none, although dataset.yaml lists it" in line


def test_other_files_and_datasets_are_not_overwritten(data, capsys):
    mine = data.parent / "mine.parquet"
    mine.write_bytes(b"mine")
    assert index(mine, source=data) == 1
    assert "mine.parquet: a file of this name exists that is no index" in capsys.readouterr().err
    assert mine.read_bytes() == b"mine"
    assert index(data / "000000/index.parquet", source=data) == 1
    assert "it is inside the dataset" in capsys.readouterr().err
    assert index(data / "index.parquet", "--report", data / "000000/a.html", source=data) == 1
    assert "it is inside the dataset" in capsys.readouterr().err
    (data / "folder.html").mkdir()
    assert index(data / "index.parquet", "--report", data / "folder.html", source=data) == 1
    assert "folder.html: it is a folder; choose another name" in capsys.readouterr().err
    assert not (data / "index.parquet").exists()


def test_an_older_index_stays_unless_the_new_one_is_complete(data, capsys):
    out = data.parent / "index.parquet"
    assert index(out, source=data) == 0
    whole = out.read_bytes()
    scan = data / "000001/lidar/top/000001.ply"
    complete = scan.read_bytes()
    scan.write_bytes(complete[:-1])
    assert index(out, source=data) == 1
    assert out.read_bytes() == whole
    scan.write_bytes(complete)
    assert index(out, "--split", "a=0.5,b=0.5", source=data) == 0
    assert out.read_bytes() != whole
    assert names_in(data.parent) == ["data", "index.parquet"]


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_index_leaves_no_files(data, stop):
    """A scan that is a pipe without a writer would be rejected; many copies take long enough."""
    for i in range(150):
        shutil.copytree(data / "000000", data / f"copy/{i}", copy_function=os.link)
        record = data / f"copy/{i}/dataset.yaml"
        text = record.read_text().replace("world: 0\n", f"world: {1000 + i}\n")
        record.unlink()
        record.write_text(text)
    arguments = [data, "-o", data.parent / "made/out.parquet", "--report", data.parent / "r.html"]
    with subprocess.Popen(
        [*COMMAND, *arguments],
        env={**os.environ, "PYTHONPATH": str(PACKAGE)},
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        deadline = time.monotonic() + 60
        while not list(data.parent.glob("made/.out.parquet.*.part")):
            assert time.monotonic() < deadline
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(stop)
        _, reported = process.communicate(timeout=60)
    assert reported == "groundray-index: interrupted; nothing was written\n"
    assert process.returncode == 130
    assert names_in(data.parent) == ["data"]


def test_a_full_disk_is_reported_and_leaves_no_files(data):
    """Files are limited to 2 kB; the index needs more."""
    import resource

    done = subprocess.run(
        [*COMMAND, data, "-o", data.parent / "out.parquet"],
        env={**os.environ, "PYTHONPATH": str(PACKAGE)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000)),
    )
    assert done.returncode == 1, done.stderr
    assert done.stderr.count("\n") == 1
    assert "nothing was written" in done.stderr
    assert names_in(data.parent) == ["data"]


def test_missing_packages_are_named(tmp_path):
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['pyarrow'] = None\n")
    done = subprocess.run(
        [*COMMAND, worlds_folder(), "-o", tmp_path / "out.parquet"],
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{PACKAGE}"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.stderr == (
        "groundray-index: an index needs pyarrow, which is not installed: pip install pyarrow\n"
    )
