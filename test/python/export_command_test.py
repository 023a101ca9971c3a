"""The command groundray-export: it rejects invalid usage and leaves no partial files."""

import copy
import importlib
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
import yaml
from detection_runs import FORMS as OF_BOXES
from detection_runs import copy_of, source_of
from export_runs import PACKAGE, export, fails, names_in
from groundray.export import clouds

FORMS = ["kitti", "semantic-kitti", "tum", "pcd", "las", "laz", "npz", "mcap", *OF_BOXES]
COMMAND = [sys.executable, "-m", "groundray.export"]


@pytest.fixture
def run(tmp_path, request):
    """A copy of the dataset that tests may modify."""
    return copy_of(request, tmp_path / "run")


def edit(file, old, new, count=1):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, count))


def only(run, kind, frames=None, lidar="bare-16"):
    """Keeps sensors of one kind in dataset.yaml; with `frames`, one lidar and this many scans."""
    record = yaml.safe_load((run / "dataset.yaml").read_text())
    sensors = [each for each in record["sensors"] if each["kind"] == kind]
    if frames is not None:
        sensors = [{**each, "frames": frames} for each in sensors if each["name"] == lidar]
    names = [each["name"] for each in sensors]
    listed = [each for each in record["frames"] if each["sensor"] in names]
    if frames is not None:
        listed = [
            {**copy.deepcopy(listed[0]), "frame": i, "stamp_s": 0.001 * i} for i in range(frames)
        ]
        for i in range(1, frames):
            for first in (run / f"lidar/{lidar}").glob("000000*"):
                file = first.with_name(first.name.replace("000000", f"{i:06}"))
                file.unlink(missing_ok=True)
                os.link(first, file)
    record |= {"sensors": sensors, "frames": listed}
    (run / "dataset.yaml").write_text(yaml.safe_dump(record))


@pytest.mark.parametrize("form", FORMS)
def test_equal_datasets_yield_equal_files_in_every_format(tmp_path, form):
    assert export(form, tmp_path / "a" / "one", source=source_of(form)) == 0
    (tmp_path / "two").mkdir()  # an empty folder will do
    assert export(form, tmp_path / "two", source=source_of(form)) == 0
    one = {p.relative_to(tmp_path / "a/one"): p for p in (tmp_path / "a/one").rglob("*")}
    two = {p.relative_to(tmp_path / "two"): p for p in (tmp_path / "two").rglob("*")}
    assert set(one) == set(two)
    for name, file in one.items():
        if file.is_file():
            assert file.read_bytes() == two[name].read_bytes(), name
    assert names_in(tmp_path) == ["a", "two"]
    assert names_in(tmp_path / "a") == ["one"]


@pytest.mark.parametrize("form", FORMS)
def test_a_folder_that_is_not_empty_is_kept(tmp_path, capsys, form):
    (tmp_path / "out").mkdir()
    (tmp_path / "out/mine.txt").write_text("mine")
    assert export(form, tmp_path / "out", source=source_of(form)) == 1
    assert "the folder is not empty; choose a new one with -o" in capsys.readouterr().err
    assert names_in(tmp_path) == ["out"]
    assert names_in(tmp_path / "out") == ["mine.txt"]


def test_output_to_a_file_or_into_the_dataset_is_rejected(run, capsys):
    assert export("npz", run / "dataset.yaml", source=run) == 1
    assert "a file of this name exists" in capsys.readouterr().err
    assert export("npz", run / "npz", source=run) == 1
    assert "it is inside the dataset" in capsys.readouterr().err
    assert not (run / "npz").exists()


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        (["--to", "rosbag"], "invalid choice: 'rosbag'"),
        (["--to", "npz", "--merge"], "--merge applies to las, laz, not to npz"),
        (["--to", "tum", "--lidar", "top"], "--lidar applies to"),
        (["--to", "kitti", "--labels", "map.yaml"], "--labels applies to coco, labels, las"),
        (["--to", "npz", "--boxes-of", "tree"], "--boxes-of applies to coco"),
        (["--to", "nuscenes", "--keyframe-s", "0"], "0 must be above 0"),
        (["--to", "kitti-object", "--split", "50,60,-10"], "must be three percentages with the"),
        (["--to", "coco", "--crowd-below-px", "-1"], "-1 must not be negative"),
        (["--to", "tum", "--depth-per-m", "0"], "0 must be above 0"),
        (["--to", "kitti", "--sequence", "100"], "100 must be from 0 to 99"),
        (["--to", "mcap", "--shift-s", "1e10"], "must be within 2^31 s"),
        (["--to", "kitti", "--camera", "left", "--no-images"], "exclude each other"),
        ([], "--to"),
    ],
)
def test_wrong_usage_is_reported_before_anything_is_read(tmp_path, capsys, options, rule):
    from groundray.export import command

    with pytest.raises(SystemExit) as stopped:
        command.main([str(tmp_path / "nowhere"), "-o", str(tmp_path / "out"), *options])
    assert stopped.value.code == 2
    assert rule in capsys.readouterr().err
    assert names_in(tmp_path) == []


def test_pending_frames_are_rejected_or_reported(run, capsys):
    text = (run / "dataset.yaml").read_text()
    line = next(each for each in text.splitlines() if 'sensor: "bare-16", frame: 1' in each)
    edit(run / "dataset.yaml", line, line.replace("done", "pending"))
    reported = fails(capsys, run, "npz")
    assert "1 of its frames are pending; finish it with groundray generate" in reported
    assert export("npz", run.parent / "out", "--skip-pending", source=run) == 0
    assert "note: 1 frames are pending and skipped" in capsys.readouterr().out
    assert names_in(run.parent / "out/bare-16") == ["000000.npz", "000002.npz"]


def test_sensors_are_selected_by_name_and_have_their_own_folders(tmp_path, capsys):
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


def test_datasets_without_cameras_or_lidars_are_reported(run, capsys):
    whole = (run / "dataset.yaml").read_text()
    only(run, "lidar")
    assert export("kitti", run.parent / "kitti", source=run) == 0
    assert "note: without a camera, camera 0 stands at the lidar" in capsys.readouterr().out
    assert "it has no camera, but TUM RGB-D needs images" in fails(capsys, run, "tum")
    assert export("mcap", run.parent / "mcap", source=run) == 0
    (run / "dataset.yaml").write_text(whole)
    capsys.readouterr()
    only(run, "camera")
    assert "it has no lidar, but kitti needs scans" in fails(capsys, run, "kitti")
    assert export("mcap", run.parent / "images", source=run) == 0


def test_kitti_rejects_non_pinhole_and_unpaired_cameras(run, capsys):
    line = fails(capsys, run, "kitti", "--camera", "eye")
    assert "camera eye has no pictures; add picture to its products, or export with --no-" in line
    for frame in range(3):
        shutil.copy(run / "camera/left/000000.png", run / f"camera/eye/{frame:06}.png")
    line = fails(capsys, run, "kitti", "--camera", "eye")
    assert "camera eye has the lens kannala_brandt, but KITTI needs pinholes" in line
    line = fails(capsys, run, "kitti", "--camera", "eye", "--camera", "right")
    assert "it has the cameras right, eye and no rectified pair among them" in line


def test_powers_need_an_explicit_full_scale(run, capsys):
    edit(run / "dataset.yaml", "intensity: reflectance", "intensity: power")
    line = fails(capsys, run, "las", "--lidar", "top")
    assert "powers in watts, which have no full scale: give one with --intensity-full-scale" in line
    assert "--lidar top if it is not that of all lidars" in line
    options = ["--lidar", "top", "--intensity-full-scale", "2"]
    assert export("las", run.parent / "las", *options, source=run) == 0
    assert export("npz", run.parent / "npz", source=run) == 0  # needs none


def test_echoes_of_air_and_false_alarms_are_counted(run, capsys):
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
    reported = capsys.readouterr().out
    assert "note: 7 points are unmarked echoes of air or false alarms" in reported


@pytest.mark.parametrize(
    ("form", "reported"),
    [
        (
            "kitti",
            [
                "points have only x, y, z and intensity",
                "waveforms are not",
                "images are exported as pictures only",
            ],
        ),
        ("semantic-kitti", ["labels and instances are the only truth of points"]),
        ("tum", ["tum contains only cameras", "images are exported as pictures and depths only"]),
        ("npz", ["npz contains only scans", "pulses without an echo are not", "waveforms are not"]),
        ("laz", ["laz contains only scans: images are not exported"]),
        ("mcap", ["points have only the fields of the velodyne layout, and no truth"]),
        (
            "kitti-object",
            [
                "points have only x, y, z and intensity",
                "waveforms are not",
                "images are exported as pictures only",
                "here top: front is left out",
            ],
        ),
        (
            "nuscenes",
            ["points have only x, y, z, intensity and ring", "front has no boxes", "map is empty"],
        ),
        ("coco", ["coco contains only cameras: lidars are not exported"]),
    ],
)
def test_data_that_a_format_omits_is_reported_once(run, capsys, form, reported):
    for frame in range(3):
        (run / f"lidar/top/{frame:06}_no_returns.ply").write_bytes(b"")
        (run / f"lidar/top/{frame:06}_wave.npy").write_bytes(b"")
    options = ["--points", "velodyne"] if form == "mcap" else []
    assert export(form, run.parent / "out", *options, source=run) == 0
    notes = [line for line in capsys.readouterr().out.splitlines() if line.startswith("note: ")]
    assert len(set(notes)) == len(notes)
    for each in reported:
        assert sum(each in note for note in notes) == 1, each


@pytest.fixture
def long_run(run):
    only(run, "lidar", frames=400)
    return run


def environment():
    return {**os.environ, "PYTHONPATH": str(PACKAGE)}


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_export_leaves_no_files(long_run, stop):
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
        _, reported = process.communicate(timeout=60)
    assert reported == "groundray-export: interrupted; nothing was written\n"
    assert process.returncode == 130
    assert names_in(long_run.parent) == ["run"]


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_that_a_library_turns_into_its_own_error_is_one(
    tmp_path, capsys, monkeypatch, stop
):
    class LibraryError(Exception):
        pass

    def write(*_):
        try:
            os.kill(os.getpid(), stop)
        except KeyboardInterrupt as raised:
            raise LibraryError from raised

    monkeypatch.setattr(clouds, "write_npz", write)
    assert export("npz", tmp_path / "out") == 130
    assert capsys.readouterr().err == "groundray-export: interrupted; nothing was written\n"
    assert names_in(tmp_path) == []


@pytest.mark.parametrize("form", OF_BOXES)
def test_an_interrupt_between_frames_leaves_no_files(tmp_path, capsys, monkeypatch, form):
    module = importlib.import_module(f"groundray.export.{form.replace('-', '_')}")
    read, frames = module.read_boxes, []

    def read_or_stop(*arguments):
        frames.append(arguments)
        if len(frames) == 3:
            assert list(tmp_path.glob(".out.*.part/*"))
            os.kill(os.getpid(), signal.SIGTERM)
        return read(*arguments)

    monkeypatch.setattr(module, "read_boxes", read_or_stop)
    assert export(form, tmp_path / "out", source=source_of(form)) == 130
    assert capsys.readouterr().err == "groundray-export: interrupted; nothing was written\n"
    assert len(frames) == 3
    assert names_in(tmp_path) == []


def test_the_sigterm_handler_of_the_caller_is_restored(tmp_path, capsys):
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        assert export("npz", tmp_path / "out") == 0
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
        assert export("npz", tmp_path / "out") == 1  # the folder is not empty
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGTERM, before)


def test_any_thread_may_export(tmp_path, capsys):
    """Only the main thread may set signal handlers."""
    before = signal.getsignal(signal.SIGTERM)
    with ThreadPoolExecutor(1) as threads:
        assert threads.submit(export, "npz", tmp_path / "out").result(timeout=120) == 0
    assert signal.getsignal(signal.SIGTERM) is before
    assert names_in(tmp_path) == ["out"]


@pytest.mark.parametrize("form", FORMS)
def test_a_full_disk_is_reported_and_leaves_no_files(tmp_path, form):
    """Files are limited to 20 kB, small images to 2 kB; every format needs more."""
    import resource

    most_bytes = 2_000 if form in {"tum", "coco"} else 20_000
    done = subprocess.run(
        [*COMMAND, source_of(form), "--to", form, "-o", tmp_path / "out"],
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


@pytest.mark.parametrize("form", ["kitti", "laz", "npz", "mcap", "nuscenes"])
def test_memory_does_not_grow_with_the_number_of_scans(run, form):
    """One more scan in memory takes 3 MB; 46 of them take 140 MB."""
    peaks_kb = []
    for frames in (4, 50):
        only(run, "lidar", frames=frames, lidar="top" if form == "nuscenes" else "bare-16")
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
