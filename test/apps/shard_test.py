"""Shards of a run, generated one by one and merged."""

import fcntl
import os
import resource
import shutil
import signal
import subprocess
import time

import pytest
import yaml
from dataset_runs import PROGRAM, files, generate, groundray, make_whole, rewrite


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return make_whole(tmp_path_factory.mktemp("whole"))


def make_shards(folder, count, *more):
    shards = []
    for k in range(1, count + 1):
        result = generate(folder, "--shard", f"{k}/{count}", *more, out=f"{k}_of_{count}")
        assert result.returncode == 0, result.stderr
        shards.append(folder / f"{k}_of_{count}")
    return shards


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    return make_shards(tmp_path_factory.mktemp("shards"), 3)


def merge(out, *shards):
    return groundray("merge", *shards, "-o", out)


def refused(result, *words):
    assert result.returncode == 1, result
    for word in words:
        assert word in result.stderr, result.stderr


def done_in(dataset):
    record = yaml.safe_load((dataset / "dataset.yaml").read_text())
    return {(f["sensor"], f["frame"]) for f in record["frames"] if f["state"] == "done"}


def test_shards_contain_each_frame_once_and_merge_to_the_complete_dataset(whole, shards, tmp_path):
    done = [done_in(shard) for shard in shards]
    assert [len(part) for part in done] == [3, 3, 3]
    assert set.union(*done) == done_in(whole)
    result = merge(tmp_path / "joined", shards[2], shards[0], shards[1])
    assert result.returncode == 0, result.stderr
    assert "9 frames of 3 shards" in result.stdout
    assert files(tmp_path / "joined") == files(whole)
    assert groundray("verify", *shards, tmp_path / "joined").returncode == 0
    assert "shard     2/3" in groundray("info", shards[1]).stdout


def test_a_sensor_with_fewer_frames_than_shards_is_merged(whole, tmp_path):
    """Images list echoes of scans in other shards."""
    parts = make_shards(tmp_path, 5)
    sizes = sorted(len(done_in(part)) for part in parts)
    assert sum(sizes) == 9
    assert sizes[-1] - sizes[0] <= 1
    assert merge(tmp_path / "joined", *parts).returncode == 0
    assert files(tmp_path / "joined") == files(whole)


def test_only_the_same_shard_is_resumed(shards, tmp_path):
    part = tmp_path / "1_of_3"
    shutil.copytree(shards[0], part)
    (part / "camera/eye/000000.exr").unlink()
    again = generate(tmp_path, "--shard", "1/3", "--resume", out="1_of_3")
    assert again.returncode == 0, again.stderr
    assert "000000.exr: missing; created again" in again.stderr
    assert files(part) == files(shards[0])
    other = generate(tmp_path, "--shard", "2/3", "--resume", out="1_of_3")
    refused(other, "shard 1/3", "shard 2/3", "a separate folder")
    refused(generate(tmp_path, "--resume", out="1_of_3"), "shard 1/3", "all frames")


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "1/0", "a/b", "1/3/2", "-1/3", "1/ 3", ""])
def test_an_invalid_shard_number_is_wrong_usage(tmp_path, text):
    result = generate(tmp_path, "--shard", text)
    assert result.returncode == 2
    assert not (tmp_path / "out").exists()


def test_shards_of_different_runs_are_not_merged(whole, shards, tmp_path):
    out = tmp_path / "joined"
    assert generate(tmp_path, "--shard", "3/3", "--seed", "8", out="seed").returncode == 0
    assert generate(tmp_path, "--shard", "1/2", out="half").returncode == 0
    refused(merge(out, *shards[:2], tmp_path / "seed"), "another run", "'seed: 8'", "'seed: 7'")
    refused(merge(out, *shards[:2], tmp_path / "half"), "shard 1/2", "1/3")
    refused(merge(out, *shards[:2]), "shard 3/3 is missing")
    refused(merge(out, *shards, shards[1]), "shard 2/3 is given twice")
    refused(merge(out, *shards, whole), "is complete, not a shard")
    refused(merge(out, *shards[:2], tmp_path / "none"), "none: there is no such file or folder")
    assert not out.exists()
    shutil.copytree(whole, out)
    refused(merge(out, *shards), "not empty")
    assert files(out) == files(whole)


def test_an_incomplete_shard_is_not_merged(shards, tmp_path):
    part = tmp_path / "part"
    shutil.copytree(shards[1], part)
    (part / "dataset.journal").write_text("")
    refused(merge(tmp_path / "joined", shards[0], part, shards[2]), "shard 2/3 is not complete")
    (part / "dataset.journal").unlink()
    text = (part / "dataset.yaml").read_text()
    (part / "dataset.yaml").write_text(text.replace("state: done", "state: pending", 1))
    refused(merge(tmp_path / "joined", shards[0], part, shards[2]), "changed since it was written")
    assert not (tmp_path / "joined").exists()


@pytest.mark.parametrize("fault", ["flipped", "missing", "short"])
def test_a_changed_file_is_not_merged(whole, shards, tmp_path, fault):
    part = tmp_path / "part"
    shutil.copytree(shards[1], part)
    file = part / "lidar/front/000001.ply"
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data if fault == "flipped" else data[:-7])
    if fault == "missing":
        file.unlink()
    joined = tmp_path / "joined"
    result = merge(joined, shards[0], part, shards[2])
    refused(result, "lidar/front/000001.ply: missing or changed", "groundray verify")
    assert not list(joined.rglob("*.part"))
    assert not done_in(joined)
    again = groundray("merge", *shards, "-o", joined, "--resume")
    assert again.returncode == 0, again.stderr
    assert files(joined) == files(whole)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("kind: lidar", "kind: ../x"),
        ("kind: lidar", 'kind: "{there}"'),
        ('name: "top"', "name: ../x"),
        ('name: "top"', 'name: "{there}"'),
        ('name: "top"', 'name: "front"'),
    ],
)
def test_nothing_is_written_outside_of_the_dataset(shards, tmp_path, before, after):
    """Tested for several sensor names in shards."""
    parts = []
    for k, shard in enumerate(shards):
        parts.append(tmp_path / f"parts/{k}")
        shutil.copytree(shard, parts[-1])
        rewrite(parts[-1], (before, after.format(there=tmp_path / "x")))
    result = merge(tmp_path / "to/joined", *parts)
    refused(result, "dataset.yaml:", f"key '{before[:4]}'")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["parts"]


def test_more_shards_than_the_open_file_limit_are_merged_or_rejected(whole, shards, tmp_path):
    def limited(soft, hard):
        return groundray(
            "merge", *shards, "-o", tmp_path / "joined",
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard)),
        )  # fmt: skip

    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    refused(limited(30, 40), "3 shards need ", " but the system allows 40", "ulimit")
    assert not (tmp_path / "joined").exists()
    result = limited(16, most)
    assert result.returncode == 0, result.stderr
    assert files(tmp_path / "joined") == files(whole)


def test_a_merge_killed_before_writing_anything_resumes(whole, shards, tmp_path):
    joined = tmp_path / "joined"
    joined.mkdir()
    (joined / "dataset.yaml.part").write_text("groundray_data")
    result = groundray("merge", *shards, "-o", joined, "--resume")
    assert result.returncode == 0, result.stderr
    assert files(joined) == files(whole)


def test_a_folder_in_use_by_a_run_is_not_merged_into(shards, tmp_path):
    joined = tmp_path / "joined"
    joined.mkdir()
    (joined / "notes.txt").write_text("")
    held = os.open(joined, os.O_RDONLY)
    fcntl.flock(held, fcntl.LOCK_EX)
    refused(merge(joined, *shards), "another run is using this folder")
    os.close(held)
    refused(merge(joined, *shards), "not empty")


def test_a_killed_merge_resumes(whole, shards, tmp_path):
    joined = tmp_path / "joined"
    run = subprocess.Popen(
        [PROGRAM, "merge", *shards, "-o", joined],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    while not list(joined.glob("lidar/top/*.ply")) and run.poll() is None:
        time.sleep(0.0005)
    run.send_signal(signal.SIGKILL)
    run.wait()
    again = groundray("merge", *shards, "-o", joined, "--resume")
    assert again.returncode == 0, again.stderr
    assert files(joined) == files(whole)


def test_an_interrupted_merge_has_no_unexpected_files(whole, shards, tmp_path):
    broken = shutil.copytree(shards[0], tmp_path / "broken")
    scan = sorted(broken.glob("lidar/*/*.ply"))[-1]
    kept = scan.rename(tmp_path / "kept.ply")
    joined = tmp_path / "joined"
    refused(merge(joined, broken, *shards[1:]), f"{scan}: missing")
    result = groundray("verify", joined)
    assert result.returncode == 1
    assert f"{joined}: incomplete: 0 of 9 frames are complete" in result.stdout
    assert "not a file of the dataset" not in result.stdout
    assert "merge --resume" in result.stdout
    kept.rename(scan)
    again = groundray("merge", broken, *shards[1:], "-o", joined, "--resume")
    assert again.returncode == 0, again.stderr
    assert files(joined) == files(whole)
