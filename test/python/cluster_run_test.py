"""groundray-cluster with a store in a folder: equal bytes, after kills and repetitions."""

import os
import re
import shutil
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from cluster_runs import (
    PACKAGE,
    PROGRAM,
    SHARDS,
    arguments,
    calls,
    cluster,
    faulty_program,
    hanging,
    is_alive,
    pid_in,
    program,
    single_run,
    started,
    wait_for,
)
from dataset_runs import files
from groundray.cluster.identity import Task
from groundray.cluster.shard import make_shard


@pytest.fixture
def scratch(tmp_path):
    (tmp_path / "scratch").mkdir()
    return tmp_path / "scratch"


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The store of a run that is done and merged."""
    store = tmp_path_factory.mktemp("done") / "store"
    assert cluster(*arguments(single_run()[0], store.as_uri())) == 0
    return store


@pytest.fixture
def store(done, tmp_path):
    """A copy of it that a test may change."""
    return shutil.copytree(done, tmp_path / "store")


def test_shards_of_which_one_is_killed_give_the_bytes_of_a_single_run(tmp_path, scratch, capfd):
    scene, whole = single_run()
    store = tmp_path / "store"
    given = arguments(scene, store.as_uri(), "--workers", 2, "--scratch", scratch)
    run = started(*given, "--groundray", hanging(tmp_path))
    os.kill(pid_in(tmp_path), signal.SIGKILL)
    told, faults = run.communicate(timeout=120)
    assert run.returncode == 0, faults
    assert told.endswith(f"9 frames of {SHARDS} shards\n")
    assert files(store / "dataset") == whole
    assert len(calls(tmp_path)) == SHARDS + 1
    assert list(scratch.iterdir()) == []
    logs = "".join(file.read_text() for file in (store / "shards").glob("*.log"))
    assert logs.count(": begun\n") == SHARDS + 1
    assert logs.count(": failed: groundray was ended by SIGKILL\n") == 1
    assert logs.count(": done\n") == SHARDS


def test_the_command_run_again_makes_only_what_is_missing(store, tmp_path, capsys):
    given = [*arguments(single_run()[0], store.as_uri()), "--groundray", program(tmp_path)]
    before = files(store)
    assert cluster(*given) == 0
    assert calls(tmp_path) == []
    (store / "shards/3.done").unlink()
    assert cluster(*given) == 0
    (call,) = calls(tmp_path)
    assert f"--shard 3/{SHARDS}" in call
    after = files(store)
    assert after.pop("shards/3.log") != before.pop("shards/3.log")
    assert after == before
    assert f"shard 3/{SHARDS} made, {SHARDS} of {SHARDS}" in capsys.readouterr().out


def test_a_killed_command_takes_its_processes_with_it_and_continues(tmp_path, scratch):
    scene, whole = single_run()
    store = tmp_path / "store"
    given = arguments(scene, store.as_uri(), "--workers", 2, "--scratch", scratch)
    run = started(*given, "--groundray", hanging(tmp_path))
    child = pid_in(tmp_path)
    wait_for(lambda: len(list((store / "shards").glob("*.done"))) >= 2)
    os.kill(run.pid, signal.SIGKILL)
    run.communicate()
    wait_for(lambda: not is_alive(child))
    made = len(list((store / "shards").glob("*.done")))
    assert made < SHARDS
    assert list(scratch.iterdir()) != []
    (tmp_path / "calls").unlink()
    assert cluster(*given, "--groundray", program(tmp_path)) == 0
    assert len(calls(tmp_path)) == SHARDS - made
    assert files(store / "dataset") == whole
    assert list(scratch.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_command_stops_its_processes(tmp_path, scratch, number):
    store = tmp_path / "store"
    given = arguments(single_run()[0], store.as_uri(), "--scratch", scratch)
    run = started(*given, "--groundray", hanging(tmp_path))
    child = pid_in(tmp_path)
    os.kill(run.pid, number)
    told, faults = run.communicate(timeout=60)
    assert run.returncode == 130
    assert (told, faults) == (
        "",
        "groundray-cluster: interrupted; the same command continues\n",
    )
    assert not is_alive(child)
    assert list(scratch.iterdir()) == []
    assert (store / "shards/1.log").read_text().endswith(": interrupted\n")


def task(store, **changes):
    values = {
        "scene": str(single_run()[0]),
        "shards": SHARDS,
        "store": store.as_uri(),
        "seed": None,
        "program": str(PROGRAM),
        "scratch": str(store.parent),
        "threads": 1,
    }
    return Task(**{**values, **changes})


def test_two_attempts_at_a_shard_at_once_agree(tmp_path):
    _, whole = single_run()
    store = tmp_path / "store"
    barrier = threading.Barrier(2)

    def attempt(_):
        barrier.wait()
        return make_shard(task(store), 2)

    with ThreadPoolExecutor(2) as pool:
        assert sorted(pool.map(attempt, range(2))) in (["made", "made"], ["made", "there"])
    there = files(store)
    assert "shards/2.done" in there
    written = {key.removeprefix("dataset/"): data for key, data in there.items() if "/" in key}
    assert {key: whole[key] for key in written if not key.startswith("shards/")} == {
        key: data for key, data in written.items() if not key.startswith("shards/")
    }
    assert make_shard(task(store), 2) == "there"


@pytest.mark.parametrize(
    ("file", "named"),
    [
        (
            "lidar/top/*.ply",
            r"/dataset/lidar/top/000000\.ply: it has other bytes than this attempt",
        ),
        ("poses/top.tum", r"/common\.yaml: this machine makes another run than the first shard: "),
    ],
)
def test_a_machine_that_makes_other_bytes_is_found_and_the_object_named(
    store, tmp_path, capsys, file, named
):
    """Its shard was uploaded by an attempt that died before the marker."""
    (store / "shards/1.done").unlink()
    (store / "dataset/dataset.yaml").unlink()
    before = files(store)
    faulty = faulty_program(tmp_path, file)
    assert cluster(*arguments(single_run()[0], store.as_uri(), "--groundray", faulty)) == 1
    assert re.search(named, capsys.readouterr().err)
    assert len(calls(tmp_path)) == 1  # another attempt would not help
    before.pop("shards/1.log")
    assert {key: data for key, data in files(store).items() if key != "shards/1.log"} == before


def test_a_file_that_changed_in_scratch_is_not_uploaded(tmp_path, capsys):
    corrupt = '"{real}" "$@"; for file in "$4"/lidar/top/*.ply; do echo >> "$file"; done; exit'
    broken = program(tmp_path, corrupt.format(real=PROGRAM))
    store = tmp_path / "store"
    given = arguments(single_run()[0], store.as_uri(), "--retries", 0, "--groundray", broken)
    assert cluster(*given) == 1
    assert "000000.ply: changed since it was written; check the disk" in capsys.readouterr().err
    assert not list(store.glob("dataset/lidar/top/*.ply"))


def test_another_run_in_the_store_is_rejected(store, tmp_path, capsys):
    scene, _ = single_run()
    before = files(store)
    url = store.as_uri()

    def reported(*given):
        assert cluster(*given) == 1
        (line,) = capsys.readouterr().err.splitlines()
        return line

    assert "with shards = 6, but this one of scene.yaml has 5" in reported(
        *arguments(scene, url, shards=5)
    )
    assert "with seed = None, but this one" in reported(*arguments(scene, url, "--seed", 3))
    old = program(tmp_path, version="0.1.9")
    assert "but this one of scene.yaml has 0.1.9; choose another store" in reported(
        *arguments(scene, url, "--groundray", old)
    )
    other = tmp_path / "other.yaml"
    other.write_text(scene.read_text() + "# more\n")
    assert "with scene_sha256 = " in reported(*arguments(other, url))
    assert files(store) == before


def test_a_worker_with_another_version_or_other_inputs_is_rejected(store, tmp_path):
    """The scene is the same, but not what it names."""
    (store / "shards/2.done").unlink()
    old = program(tmp_path, version="0.1.9")
    with pytest.raises(Exception, match=r"has 0\.1\.9"):
        make_shard(task(store, program=str(old)), 2)
    moved = shutil.copytree(single_run()[0].parent, tmp_path / "moved")
    camera = moved / "camera.yaml"
    camera.write_text(camera.read_text().replace("exposure_ms: 1", "exposure_ms: 2"))
    with pytest.raises(Exception, match="another run than the first shard: 'inputs: "):
        make_shard(task(store, scene=str(moved / "scene.yaml")), 2)
    other = program(tmp_path, f"export LD_PRELOAD={PROGRAM.parent}/libother_sleef.so")
    with pytest.raises(Exception, match="another run than the first shard: 'functions: "):
        make_shard(task(store, program=str(other)), 2)
    assert not (store / "shards/2.done").exists()


def test_verify_names_what_is_missing_changed_or_superfluous(store, capsys):
    url = store.as_uri()
    assert cluster("verify", url) == 0
    count = len(list(store.glob("dataset/*/**/*.*")))
    assert re.fullmatch(
        rf"{url}: {count} files of [\d.]+ MiB, no faults\n", capsys.readouterr().out
    )
    (store / "dataset/lidar/top/000001.ply").unlink()
    with (store / "dataset/poses/eye.tum").open("ab") as file:
        file.write(b"\n")
    (store / "dataset/lidar/top/000009.ply").write_text("more")
    assert cluster("verify", url) == 1
    told = capsys.readouterr().out.splitlines()
    assert told[:3] == [
        "dataset/lidar/top/000001.ply: missing",
        "dataset/poses/eye.tum: changed since it was written",
        "dataset/lidar/top/000009.ply: does not belong to the run",
    ]
    assert told[3].endswith(", 3 faults")
    (store / "dataset/dataset.yaml").unlink()
    assert cluster("verify", url) == 1
    assert "it is not merged yet; run groundray-cluster merge" in capsys.readouterr().err


def test_merge_names_shards_that_are_missing_or_damaged(store, capsys):
    url, (_, whole) = store.as_uri(), single_run()
    (store / "dataset/dataset.yaml").unlink()
    assert cluster("merge", url) == 0
    assert files(store / "dataset") == whole
    first = (store / "shards/1.done").read_bytes()
    (store / "shards/1.done").write_bytes(first[:-200])
    assert cluster("merge", url) == 1
    assert "shards/1.done: changed since it was written" in capsys.readouterr().err
    (store / "shards/1.done").write_bytes((store / "shards/2.done").read_bytes())
    assert cluster("merge", url) == 1
    assert "shards/1.done: it is the marker of another shard" in capsys.readouterr().err
    (store / "shards/1.done").unlink()
    assert cluster("merge", url) == 1
    assert "1 of 6 shards are not done, such as 1; " in capsys.readouterr().err


def test_status_counts_shards_and_shows_the_end_of_logs(store, tmp_path, capsys):
    url = store.as_uri()
    assert cluster("status", url) == 0
    assert capsys.readouterr().out.endswith(
        ": 6 of 6 shards done, 0 running, 0 failed, 0 waiting; merged\n"
    )
    now = Path(store / "shards/1.done").stat().st_mtime
    for shard in (1, 2, 3):
        os.utime(store / f"shards/{shard}.done", (now, now + 60 * shard))
    for shard in (4, 5, 6):
        (store / f"shards/{shard}.done").unlink()
    begun = "# attempt, 2026-01-02T03:04:05Z on rock, process 7: begun\n"
    (store / "shards/4.log").write_text(begun)
    ended = "groundray: disk full\n# attempt, now on rock, process 7: failed: disk full\n"
    (store / "shards/5.log").write_text(begun + ended)
    (store / "shards/6.log").unlink()
    assert cluster("status", url) == 0
    told = capsys.readouterr().out
    assert re.search(
        r"shard 4 is running, last heard from \d s ago: attempt, .* on rock, process 7: beg", told
    )
    assert "shard 5 failed in 1 attempts; the end of its log:\n" in told
    assert "    groundray: disk full\n" in told
    assert told.endswith(
        ": 3 of 6 shards done, 1 running, 1 failed, 1 waiting; 60 shards/h, 3.0 min left\n"
    )


def test_a_full_disk_is_reported_and_leaves_nothing(tmp_path, scratch):
    """In a file system of 600 KiB, which only processes of this command see."""
    mount = f"mount -t tmpfs -o size=600k none {scratch}"
    if subprocess.run(["unshare", "-rm", "sh", "-c", mount], check=False).returncode != 0:
        pytest.skip("this machine does not let users mount file systems")
    store = tmp_path / "store"
    given = arguments(single_run()[0], store.as_uri(), "--retries", 0, "--scratch", scratch)
    run = subprocess.run(
        [
            *("unshare", "-rm", "sh", "-c"),
            *(f'{mount} && "$@"; code=$?; ls {scratch}; exit $code', "sh"),
            *(sys.executable, "-P", "-m", "groundray.cluster", *given),
        ],
        env={**os.environ, "PYTHONPATH": str(PACKAGE)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 1
    *_, line = run.stderr.splitlines()
    assert "No space left on device" in line
    assert run.stdout == ""  # nothing is left in scratch
    assert not list(store.glob("dataset/*/*/*"))
