"""Runs interrupted by a signal, a full disk or a changed file resume to the same bytes."""

import os
import pty
import random
import re
import resource
import shutil
import signal
import subprocess
import time

import pytest
from dataset_runs import SCENE, as_cut_off, command, files, generate, groundray, make_whole

IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return make_whole(tmp_path_factory.mktemp("whole"))


def resumed(folder, *more):
    result = generate(folder, "--resume", *more)
    assert result.returncode == 0, result.stderr
    return result


def refused(result, *words):
    assert result.returncode == 1, result
    assert result.stderr.splitlines()[-1].startswith("groundray: "), result.stderr
    for word in words:
        assert word in result.stderr, result.stderr


def seconds_to_make(folder):
    begin = time.monotonic()
    make_whole(folder)
    return time.monotonic() - begin


def kill_after(arguments, delay_s):
    run = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(delay_s)
    run.send_signal(signal.SIGKILL)
    run.wait()


def test_a_run_killed_at_any_moment_resumes_to_the_same_bytes(whole, tmp_path):
    """A third of the runs are killed again after resuming."""
    (tmp_path / "timed").mkdir()
    lasts_s = seconds_to_make(tmp_path / "timed")
    moments = random.Random(11)
    for k in range(50 if IS_FULL else 8):
        folder = tmp_path / f"killed_{k}"
        folder.mkdir()
        kill_after(command(folder), moments.uniform(0, lasts_s))
        if k % 3 == 0:
            kill_after(command(folder, "--resume"), moments.uniform(0, lasts_s))
        resumed(folder)
        assert files(folder / "out") == files(whole), k
        shutil.rmtree(folder)


def test_leftovers_of_a_killed_run_are_removed(whole, tmp_path):
    out = tmp_path / "out"
    as_cut_off(whole, out, 4)
    for name in (
        "dataset.yaml",
        "dataset.journal",
        "lidar/top/000002.ply",
        "lidar/front/000001_no_returns.ply",
        "camera/eye/000000_top.npy",
        "poses/eye.tum",
    ):
        (out / f"{name}.part").write_text("half")
    assert "4 scans already existed" in resumed(tmp_path).stdout
    assert files(out) == files(whole)


@pytest.mark.parametrize("fault", ["cut", "flipped", "garbage", "empty", "no newline", "twice"])
def test_a_damaged_journal_loses_only_its_damaged_lines(whole, tmp_path, fault):
    out = tmp_path / "out"
    lines = as_cut_off(whole, out, 5)
    text = "".join(lines).encode()
    torn, kept = {
        "cut": (text[:-30], 4),
        "flipped": (text.replace(b"frame: 1,", b"frame: 3,", 1), 4),
        "garbage": (text + b"\0" * 4096 + b"\xff", 5),
        "empty": (b"", 0),
        "no newline": (text[:-1], 5),
        "twice": (text + text, 5),
    }[fault]
    (out / "dataset.journal").write_bytes(torn)
    result = resumed(tmp_path)
    assert (f"{kept} scans already existed" in result.stdout) == (kept > 0), result.stdout
    assert ("damaged" in result.stderr) == (fault in ("cut", "flipped", "garbage")), result.stderr
    assert files(out) == files(whole)


def test_changed_files_are_reported_and_generated_again(whole, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    scan = out / "lidar/top/000001.ply"
    data = bytearray(scan.read_bytes())
    data[-5] ^= 4
    scan.write_bytes(data)
    (out / "lidar/front/000000_no_returns.ply").unlink()
    image = out / "camera/eye/000002.exr"
    image_bytes = image.stat().st_size
    image.write_bytes(image.read_bytes()[:-1])
    with (out / "lidar/top/000000_preview.png").open("ab") as file:
        file.write(b"more")
    (out / "poses/top.tum").unlink()
    (out / "calibration/eye.yaml").write_text("mine")
    result = resumed(tmp_path)
    for words in (
        "lidar/top/000001.ply: changed: its SHA-256 differs; created again",
        "lidar/front/000000_no_returns.ply: missing; created again",
        f"has {image_bytes - 1} bytes instead of {image_bytes}: truncated; created again",
        "lidar/top/000000_preview.png: has",
        "poses/top.tum: missing; it is written again",
        "calibration/eye.yaml: has 4 bytes instead of",
    ):
        assert words in result.stderr, result.stderr
    assert "3 scans already existed" in result.stdout
    assert "2 images already existed" in result.stdout
    assert files(out) == files(whole)


def test_a_changed_record_is_repaired(whole, tmp_path):
    """Lines are compared with their frames, and other lines are ignored."""
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    record = (out / "dataset.yaml").read_text()
    for old, new in (
        ('"top", frame: 1, stamp_s: 0.1', '"top", frame: 1, stamp_s: 0.2'),
        ('"front", frame: 2, stamp_s', '"front", frame:  2, stamp_s'),
        ('{sensor: "eye", frame: 0', '{sensor: "../eye", frame: 0'),
    ):
        assert old in record
        record = record.replace(old, new)
    (out / "dataset.yaml").write_text(record)
    result = resumed(tmp_path)
    assert result.stderr.count("changed since it was written; its frame is created again") == 2
    assert files(out) == files(whole)


def test_a_changed_setting_in_the_record_is_shown_and_may_be_corrected(whole, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    record = (out / "dataset.yaml").read_bytes()
    (out / "dataset.yaml").write_bytes(record.replace(b"seed: 7", b"seed: 5", 1))
    refused(generate(tmp_path, "--resume"), "another scene", "'seed: 5' instead of 'seed: 7'")
    (out / "dataset.yaml").write_bytes(record)
    assert "6 scans already existed" in resumed(tmp_path).stdout
    assert files(out) == files(whole)


def test_resuming_without_a_folder_starts_a_run(whole, tmp_path):
    resumed(tmp_path)
    assert files(tmp_path / "out") == files(whole)
    again = resumed(tmp_path)
    assert "6 scans already existed" in again.stdout
    assert files(tmp_path / "out") == files(whole)


def test_only_the_same_run_is_resumed(whole, tmp_path):
    shutil.copytree(whole, tmp_path / "out")
    refused(generate(tmp_path), "already contains a dataset of this run", "add --resume")
    refused(generate(tmp_path, "--resume", "--seed", "8"), "another scene")
    refused(generate(tmp_path, "--resume", "--shard", "1/2"), "all frames", "shard 1/2")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/notes.txt").write_text("keep")
    refused(generate(tmp_path, "--resume", out="mine"), "not empty")
    assert files(tmp_path / "out") == files(whole)


def test_only_one_run_at_a_time_may_use_a_folder(tmp_path):
    long = SCENE.replace("duration_s: 0.3", "duration_s: 1.2")
    first = subprocess.Popen(
        command(tmp_path, scene=long), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    while not (tmp_path / "out/lidar/top/000000.ply").exists() and first.poll() is None:
        time.sleep(0.01)
    refused(generate(tmp_path, "--resume", scene=long), "another run is using this folder")
    first.send_signal(signal.SIGKILL)
    first.wait()
    assert generate(tmp_path, "--resume", scene=long).returncode == 0


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupted_run_resumes_to_the_same_bytes(whole, tmp_path, by):
    run = subprocess.Popen(
        command(tmp_path),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(
            by, signal.SIG_DFL
        ),  # a job in the background ignores some
    )
    while not (tmp_path / "out/lidar/top/000001.ply").exists() and run.poll() is None:
        time.sleep(0.002)
    run.send_signal(by)
    said = run.communicate(timeout=60)[1].decode()
    assert run.returncode == 130, said
    assert "continues with --resume" in said
    assert not list((tmp_path / "out").rglob("*.part"))
    assert not (tmp_path / "out/dataset.journal").exists()
    incomplete = groundray("verify", tmp_path / "out")
    assert incomplete.returncode == 1
    assert re.search(r"incomplete: \d of 9 frames are complete", incomplete.stdout)
    resumed(tmp_path)
    assert files(tmp_path / "out") == files(whole)


@pytest.mark.parametrize("limit_bytes", [3_000, 100_000, 500_000])
def test_a_run_stopped_by_a_file_size_limit_resumes_to_the_same_bytes(whole, tmp_path, limit_bytes):
    """A limit on file size makes writes fail, as a full disk does."""
    limits = (limit_bytes, limit_bytes)
    result = generate(
        tmp_path, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    )
    refused(result, "cannot be written", "File too large")
    assert not list((tmp_path / "out").rglob("*.part"))
    resumed(tmp_path)
    assert files(tmp_path / "out") == files(whole)


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting a small disk needs root")
def test_a_run_on_a_full_disk_resumes_to_the_same_bytes_once_space_is_free(whole, tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=4k", "tmpfs", disk]
    if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("mounting a small disk is not permitted here")
    try:
        total = sum(len(data) for data in files(whole).values())
        sizes = random.Random(3)
        rooms = [8192, *sorted(sizes.randrange(16384, total) for _ in range(12 if IS_FULL else 4))]
        for room in rooms:
            subprocess.run(["mount", "-o", f"remount,size={room}", disk], check=True)
            refused(generate(tmp_path, "--resume", out="disk/out"), "No space left on device")
            assert not list(disk.rglob("*.part"))
        subprocess.run(["mount", "-o", "remount,size=64m", disk], check=True)
        assert generate(tmp_path, "--resume", out="disk/out").returncode == 0
        assert files(disk / "out") == files(whole)
    finally:
        subprocess.run(["umount", disk], check=True)


def peak_kib(arguments):
    run = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(run.pid, 0)
    run.returncode = os.waitstatus_to_exitcode(status)
    assert run.returncode == 0
    return usage.ru_maxrss


def test_memory_does_not_grow_with_the_number_of_frames(tmp_path):
    """Ten times the frames; a scan in memory, before and while it is written, takes 10 MiB."""
    peaks = []
    frames = (10, 100) if IS_FULL else (5, 20)
    for count in frames:
        (tmp_path / str(count)).mkdir()
        scene = SCENE.split("  - {name: front")[0].replace("0.3", f"{count / 10 + 0.05}")
        scene = scene.replace("speed_m_s: 8", "speed_m_s: 1")
        peaks.append(peak_kib(command(tmp_path / str(count), scene=scene)))
    assert peaks[1] - peaks[0] < 10 * 1024, peaks


def test_progress_counts_scans_and_images_on_a_terminal(tmp_path):
    master, slave = pty.openpty()
    run = subprocess.Popen(command(tmp_path), stdout=subprocess.DEVNULL, stderr=slave)
    os.close(slave)
    said = b""
    try:
        while part := os.read(master, 4096):
            said += part
    except OSError:
        pass  # the terminal goes with the run
    os.close(master)
    assert run.wait() == 0
    assert re.search(rb"\rscans \d/6, images \d/3", said), said
    assert re.search(rb"\rscans 6/6, images 3/3 in [\d.]+ s *\r?\n$", said), said


def test_info_counts_the_frames_of_a_journal(whole, tmp_path):
    lines = as_cut_off(whole, tmp_path / "out", 4)
    with (tmp_path / "out/dataset.journal").open("a") as journal:
        journal.write(lines[0] + lines[1][:-20])
    said = groundray("info", tmp_path / "out").stdout
    assert "4 of 9 frames are complete; a run is in progress, or was interrupted" in said
    assert "3 of 3" in said
    assert "1 of 3" in said
    assert "0 of 3" in said


def test_frames_after_a_changed_line_are_kept(whole, tmp_path):
    shutil.copytree(whole, tmp_path / "out")
    record = (tmp_path / "out/dataset.yaml").read_text()
    changed = record.replace('  - {sensor: "top", frame: 0', '  * {sensor: "top", frame: 0', 1)
    (tmp_path / "out/dataset.yaml").write_text(changed)
    result = resumed(tmp_path)
    assert "changed since it was written; its frame is created again" in result.stderr
    assert "dataset.yaml: changed since it was written" in result.stderr
    assert "5 scans already existed" in result.stdout
    assert "3 images already existed" in result.stdout
    assert files(tmp_path / "out") == files(whole)
