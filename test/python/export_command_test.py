"""The command groundray-export: what it refuses, and that it leaves nothing half-written."""

import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
import yaml
from export_runs import PACKAGE, export, fails, names_in, run_folder

FORMS = ["kitti", "semantic-kitti", "tum", "pcd", "las", "laz", "npz", "mcap"]
COMMAND = [sys.executable, "-m", "groundray.export.command"]


@pytest.fixture
def run(tmp_path):
    """A copy of the dataset that may be spoiled."""
    return shutil.copytree(run_folder(), tmp_path / "run")


def edit(file, old, new, count=1):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, count))


def only(run, kind, frames=None):
    """Leaves sensors of one kind in dataset.yaml; with `frames`, one lidar and so many scans."""
    record = yaml.safe_load((run / "dataset.yaml").read_text())
    sensors = [each for each in record["sensors"] if each["kind"] == kind]
    if frames is not None:
        sensors = [{**each, "frames": frames} for each in sensors if each["name"] == "bare-16"]
    names = [each["name"] for each in sensors]
    listed = [each for each in record["frames"] if each["sensor"] in names]
    if frames is not None:
        listed = [{**listed[0], "frame": i, "stamp_s": 0.001 * i} for i in range(frames)]
        for i in range(1, frames):
            file = run / f"lidar/bare-16/{i:06}.ply"
            file.unlink(missing_ok=True)
            os.link(run / "lidar/bare-16/000000.ply", file)
    record |= {"sensors": sensors, "frames": listed}
    (run / "dataset.yaml").write_text(yaml.safe_dump(record))


@pytest.mark.parametrize("form", FORMS)
def test_equal_datasets_give_equal_files_of_every_form(tmp_path, form):
    assert export(form, tmp_path / "a" / "one") == 0
    (tmp_path / "two").mkdir()  # an empty folder will do
    assert export(form, tmp_path / "two") == 0
    one = {p.relative_to(tmp_path / "a/one"): p for p in (tmp_path / "a/one").rglob("*")}
    two = {p.relative_to(tmp_path / "two"): p for p in (tmp_path / "two").rglob("*")}
    assert set(one) == set(two)
    for name, file in one.items():
        if file.is_file():
            assert file.read_bytes() == two[name].read_bytes(), name
    assert names_in(tmp_path) == ["a", "two"]
    assert names_in(tmp_path / "a") == ["one"]


@pytest.mark.parametrize("form", FORMS)
def test_a_folder_that_is_not_empty_is_left_alone(tmp_path, capsys, form):
    (tmp_path / "out").mkdir()
    (tmp_path / "out/mine.txt").write_text("mine")
    assert export(form, tmp_path / "out") == 1
    assert "the folder is not empty; choose a new one with -o" in capsys.readouterr().err
    assert names_in(tmp_path) == ["out"]
    assert names_in(tmp_path / "out") == ["mine.txt"]


def test_a_file_or_a_place_within_the_dataset_is_no_place_to_write_to(run, capsys):
    assert export("npz", run / "dataset.yaml", source=run) == 1
    assert "there is a file of this name" in capsys.readouterr().err
    assert export("npz", run / "npz", source=run) == 1
    assert "it lies within the dataset" in capsys.readouterr().err
    assert not (run / "npz").exists()


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (["--to", "rosbag"], "invalid choice: 'rosbag'"),
        (["--to", "npz", "--merge"], "--merge is of las, laz, not of npz"),
        (["--to", "tum", "--lidar", "top"], "--lidar is of"),
        (["--to", "kitti", "--labels", "map.yaml"], "--labels is of las, laz, semantic-kitti"),
        (["--to", "tum", "--depth-per-m", "0"], "0 must be above 0"),
        (["--to", "kitti", "--sequence", "100"], "100 must be from 0 to 99"),
        (["--to", "mcap", "--shift-s", "1e10"], "must be within 2^31 s"),
        (["--to", "kitti", "--camera", "left", "--no-images"], "exclude each other"),
        ([], "--to"),
    ],
)
def test_wrong_usage_is_told_before_anything_is_read(tmp_path, capsys, options, rule):
    from groundray.export import command

    with pytest.raises(SystemExit) as stopped:
        command.main([str(tmp_path / "nowhere"), "-o", str(tmp_path / "out"), *options])
    assert stopped.value.code == 2
    assert rule in capsys.readouterr().err
    assert names_in(tmp_path) == []


def test_frames_that_are_pending_are_refused_or_told(run, capsys):
    text = (run / "dataset.yaml").read_text()
    line = next(each for each in text.splitlines() if 'sensor: "bare-16", frame: 1' in each)
    edit(run / "dataset.yaml", line, line.replace("done", "pending"))
    told = fails(capsys, run, "npz")
    assert "1 of its frames are pending; finish it with groundray generate" in told
    assert export("npz", run.parent / "out", "--skip-pending", source=run) == 0
    assert "note: 1 frames are pending and left out" in capsys.readouterr().out
    assert names_in(run.parent / "out/bare-16") == ["000000.npz", "000002.npz"]


def test_sensors_are_chosen_by_name_or_all_in_folders_of_their_own(tmp_path, capsys):
    assert export("pcd", tmp_path / "all") == 0
    assert names_in(tmp_path / "all") == ["bare-16", "front", "top"]
    assert export("pcd", tmp_path / "one", "--lidar", "top") == 0
    assert names_in(tmp_path / "one") == ["top"]
    assert export("kitti", tmp_path / "kitti", "--no-images", "--sequence", "4") == 0
    assert names_in(tmp_path / "kitti/sequences") == ["04", "05", "06"]
    capsys.readouterr()
    assert export("pcd", tmp_path / "none", "--lidar", "roof") == 1
    assert "it has no lidar roof; it has: top, front, bare-16" in capsys.readouterr().err
    assert export("tum", tmp_path / "none", "--camera", "rear") == 1
    assert "it has no camera rear; it has: left, right, eye" in capsys.readouterr().err


def test_datasets_without_cameras_or_lidars_say_what_they_lack(run, capsys):
    whole = (run / "dataset.yaml").read_text()
    only(run, "lidar")
    assert export("kitti", run.parent / "kitti", source=run) == 0
    assert "note: without a camera, camera 0 stands at the lidar" in capsys.readouterr().out
    assert "it has no camera, and TUM RGB-D is of cameras" in fails(capsys, run, "tum")
    assert export("mcap", run.parent / "mcap", source=run) == 0
    (run / "dataset.yaml").write_text(whole)
    capsys.readouterr()
    only(run, "camera")
    assert "it has no lidar, and kitti is of scans" in fails(capsys, run, "kitti")
    assert export("mcap", run.parent / "images", source=run) == 0


def test_kitti_refuses_cameras_that_are_no_pinholes_and_several_without_a_pair(run, capsys):
    line = fails(capsys, run, "kitti", "--camera", "eye")
    assert "camera eye has no pictures; give it the product picture, or export with --no-" in line
    for frame in range(3):
        shutil.copy(run / "camera/left/000000.png", run / f"camera/eye/{frame:06}.png")
    line = fails(capsys, run, "kitti", "--camera", "eye")
    assert "camera eye is a kannala_brandt, but KITTI's images are of pinholes" in line
    line = fails(capsys, run, "kitti", "--camera", "eye", "--camera", "right")
    assert "it has the cameras right, eye and no rectified pair among them" in line


def test_powers_have_no_full_scale_of_their_own(run, capsys):
    edit(run / "dataset.yaml", "intensity: reflectance", "intensity: power")
    line = fails(capsys, run, "las", "--lidar", "top")
    assert "powers in watts, which have no full scale; give one with --intensity-full-scale" in line
    options = ["--lidar", "top", "--intensity-full-scale", "2"]
    assert export("las", run.parent / "las", *options, source=run) == 0
    assert export("npz", run.parent / "npz", source=run) == 0  # needs none


def test_echoes_of_nothing_are_counted_where_nothing_marks_them(run, capsys):
    file = run / "lidar/top/000000.ply"
    data = file.read_bytes()
    begin = data.index(b"end_header\n") + len(b"end_header\n")
    from export_runs import dataset, read_scan

    lidar = dataset().lidars[0]
    rows = read_scan(dataset(), lidar, lidar.frames[0]).rows.copy()
    rows["kind"][:7] = 2
    rows["label"][:7] = 0
    file.write_bytes(data[:begin] + rows.tobytes())
    assert export("kitti", run.parent / "out", "--lidar", "top", source=run) == 0
    told = capsys.readouterr().out
    assert "note: 7 points are echoes of air or false alarms, which nothing marks" in told


@pytest.mark.parametrize(
    ("form", "told"),
    [
        (
            "kitti",
            ["points have x, y, z and intensity alone", "waveforms are not", "of images pictures"],
        ),
        ("semantic-kitti", ["of the truth points have labels and instances alone"]),
        ("tum", ["tum is of cameras alone", "of images pictures and depths are exported, and no"]),
        ("npz", ["npz is of scans alone", "pulses without an echo are not", "waveforms are not"]),
        ("laz", ["laz is of scans alone: images are not exported"]),
        ("mcap", ["points have the fields of the velodyne layout alone, and no truth"]),
    ],
)
def test_what_a_form_has_no_place_for_is_told_once(run, capsys, form, told):
    for frame in range(3):
        (run / f"lidar/top/{frame:06}_no_returns.ply").write_bytes(b"")
        (run / f"lidar/top/{frame:06}_wave.npy").write_bytes(b"")
    options = ["--points", "velodyne"] if form == "mcap" else []
    assert export(form, run.parent / "out", *options, source=run) == 0
    notes = [line for line in capsys.readouterr().out.splitlines() if line.startswith("note: ")]
    assert len(set(notes)) == len(notes)
    for each in told:
        assert sum(each in note for note in notes) == 1, each


@pytest.fixture
def long_run(run):
    only(run, "lidar", frames=400)
    return run


def environment():
    return {**os.environ, "PYTHONPATH": str(PACKAGE)}


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_export_leaves_nothing(long_run, stop):
    arguments = [long_run, "--to", "laz", "-o", long_run.parent / "out"]
    with subprocess.Popen(
        [*COMMAND, *arguments], env=environment(), stderr=subprocess.PIPE, text=True
    ) as process:
        deadline = time.monotonic() + 60
        while not list(long_run.parent.glob(".out.*.part/*/000002.laz")):
            assert time.monotonic() < deadline
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(stop)
        _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert told == "groundray-export: interrupted; nothing was written\n"
    assert names_in(long_run.parent) == ["run"]


def test_a_caller_keeps_its_own_handler_of_sigterm(tmp_path, capsys):
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        assert export("npz", tmp_path / "out") == 0
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
        assert export("npz", tmp_path / "out") == 1  # the folder is not empty
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGTERM, before)


def test_any_thread_may_export(tmp_path, capsys):
    """Handlers of signals are the main thread's alone to set."""
    before = signal.getsignal(signal.SIGTERM)
    with ThreadPoolExecutor(1) as threads:
        assert threads.submit(export, "npz", tmp_path / "out").result(timeout=120) == 0
    assert signal.getsignal(signal.SIGTERM) is before
    assert names_in(tmp_path) == ["out"]


@pytest.mark.parametrize("form", FORMS)
def test_a_disk_that_is_full_is_told_and_nothing_remains(tmp_path, form):
    """Files may not grow beyond 20 kB, of small images beyond 2 kB; every form needs more."""
    import resource

    most_bytes = 2_000 if form == "tum" else 20_000
    done = subprocess.run(
        [*COMMAND, run_folder(), "--to", form, "-o", tmp_path / "out"],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes)),
    )
    assert done.returncode == 1, done.stderr
    assert done.stderr.count("\n") == 1
    assert "nothing was written" in done.stderr
    assert names_in(tmp_path) == []


@pytest.mark.parametrize("form", ["kitti", "laz", "npz", "mcap"])
def test_memory_does_not_grow_with_the_number_of_scans(run, form):
    """A scan more in memory at a time would be 3 MB; 46 of them 140 MB."""
    peaks_kb = []
    for frames in (4, 50):
        only(run, "lidar", frames=frames)
        code = (
            "import resource, sys; from groundray.export.command import main; code = main(); "
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss); sys.exit(code)"
        )
        out = run.parent / f"out_{frames}"
        extra = ["--compression", "none"] if form == "mcap" else []
        done = subprocess.run(
            [sys.executable, "-c", code, run, "--to", form, "-o", out, *extra],
            env=environment(),
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        peaks_kb.append(int(done.stdout.splitlines()[-1]))
        shutil.rmtree(out)
    assert peaks_kb[1] < peaks_kb[0] + 15_000
