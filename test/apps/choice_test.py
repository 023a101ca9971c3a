"""Runs of chosen sensors and frames, with chosen numbers of threads, and without messages."""

import os
import shutil
import subprocess

import pytest
import yaml
from dataset_runs import command, files, generate, groundray, make_whole


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return make_whole(tmp_path_factory.mktemp("whole"))


def refused(result, *words):
    assert result.returncode == 1, result
    assert len(result.stderr.splitlines()) == 1, result.stderr
    for word in words:
        assert word in result.stderr, result.stderr


def frame_files(folder):
    return {name: data for name, data in files(folder).items() if name != "dataset.yaml"}


CHOICES = {
    "a camera that shows another sensor's echoes": (["--sensor", "eye"], {"eye"}, {0, 1, 2}),
    "a lidar": (["--sensor", "front"], {"front"}, {0, 1, 2}),
    "two sensors": (["--sensor", "eye,top"], {"top", "eye"}, {0, 1, 2}),
    "a sensor twice": (["--sensor", "eye", "--sensor", "eye"], {"eye"}, {0, 1, 2}),
    "some frames": (["--frames", "1:"], {"top", "front", "eye"}, {1, 2}),
    "every other frame": (["--frames", "::2"], {"top", "front", "eye"}, {0, 2}),
    "one frame of one sensor": (["--sensor", "eye", "--frames", "1"], {"eye"}, {1}),
}


@pytest.mark.parametrize("name", CHOICES)
def test_chosen_frames_have_the_bytes_of_the_whole_run(whole, tmp_path, name):
    options, sensors, numbers = CHOICES[name]
    result = generate(tmp_path, *options)
    assert result.returncode == 0, result.stderr
    out = tmp_path / "out"
    expected = {}
    for path, data in frame_files(whole).items():
        folder, rest = path.split("/", 1)
        if folder in ("poses", "calibration"):
            chosen = rest.split(".")[0] in sensors
        else:
            sensor, file = rest.split("/")
            chosen = sensor in sensors and int(file[:6]) in numbers
        if chosen:
            expected[path] = data
    assert frame_files(out) == expected
    record = yaml.safe_load((out / "dataset.yaml").read_text())
    everything = yaml.safe_load((whole / "dataset.yaml").read_text())
    chosen = [f for f in everything["frames"] if f["sensor"] in sensors and f["frame"] in numbers]
    assert record["frames"] == chosen
    assert {sensor["name"]: sensor["number"] for sensor in record["sensors"]} == {
        sensor["name"]: sensor["number"]
        for sensor in everything["sensors"]
        if sensor["name"] in sensors
    }
    assert groundray("verify", out).returncode == 0
    info = groundray("info", out).stdout
    assert f"{len(chosen)} of {len(chosen)} frames are complete\n" in info
    assert f"chosen    {record['chosen']}\n" in info


def test_a_choice_of_everything_is_a_whole_run(whole, tmp_path):
    result = generate(tmp_path, "--sensor", "eye,front,top", "--frames", ":")
    assert result.returncode == 0, result.stderr
    assert files(tmp_path / "out") == files(whole)


def test_only_the_same_choice_is_resumed(whole, tmp_path):
    assert generate(tmp_path, "--sensor", "top", "--frames", "0:2").returncode == 0
    before = files(tmp_path / "out")
    (tmp_path / "out/lidar/top/000001.ply").unlink()
    again = generate(tmp_path, "--sensor", "top", "--frames", ":2", "--resume")
    assert again.returncode == 0, again.stderr
    assert "000001.ply: missing; created again" in again.stderr
    assert files(tmp_path / "out") == before
    ours = "the frames of --sensor top --frames 0:2"
    refused(generate(tmp_path, "--resume"), ours, "but all frames are requested", "-o")
    refused(
        generate(tmp_path, "--sensor", "eye", "--resume"), ours, "but the frames of --sensor eye"
    )
    refused(generate(tmp_path, "--shard", "1/2", "--resume"), ours, "but shard 1/2 is requested")
    assert files(tmp_path / "out") == before
    copy = shutil.copytree(whole, tmp_path / "copy")
    result = generate(tmp_path, "--sensor", "top", "--resume", out="copy")
    refused(result, "all frames", "but the frames of --sensor top are requested")
    assert files(copy) == files(whole)


def test_an_interrupted_choice_is_resumed_and_verified(tmp_path):
    assert generate(tmp_path, "--frames", "1:3").returncode == 0
    out = tmp_path / "out"
    before = files(out)
    (out / "camera/eye/000002.exr").unlink()
    result = groundray("verify", out)
    assert result.returncode == 1
    assert "camera/eye/000002.exr: missing" in result.stdout
    (out / "lidar/top/000000.ply").write_bytes(before["lidar/top/000001.ply"])
    assert "lidar/top/000000.ply: not a file of the dataset" in groundray("verify", out).stdout
    (out / "lidar/top/000000.ply").unlink()
    assert generate(tmp_path, "--frames", "1:3", "--resume").returncode == 0
    assert files(out) == before


def test_chosen_frames_are_no_shard(whole, tmp_path):
    assert generate(tmp_path, "--sensor", "top").returncode == 0
    result = groundray("merge", tmp_path / "out", "-o", tmp_path / "joined")
    refused(result, "the dataset has chosen frames, not a shard")
    for option in (["--sensor", "top"], ["--frames", "0"]):
        result = generate(tmp_path, "--shard", "1/2", *option, out="both")
        assert result.returncode == 2
        assert option[0] in result.stderr
    assert not (tmp_path / "both").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--sensor", "tap"], ("no sensor 'tap'", "did you mean 'top'?", "top, front, eye")),
        (["--frames", "3:"], ("--frames: 3: includes no frame", "from 0 to 2")),
        (["--frames", "2:1"], ("--frames: '2:1' has no frame",)),
        (["--frames", "x"], ("--frames: 'x' must be A:B:STEP",)),
    ],
)
def test_an_invalid_choice_is_reported_before_anything_is_written(tmp_path, options, words):
    refused(generate(tmp_path, *options), *words)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("threads", ["1", "5"])
def test_results_are_the_same_for_any_number_of_threads(whole, tmp_path, threads):
    result = generate(tmp_path, "--threads", threads)
    assert result.returncode == 0, result.stderr
    assert files(tmp_path / "out") == files(whole)


def most_threads(folder, *more, out):
    """Returns the greatest number of threads that a run was seen to have."""
    run = subprocess.Popen(
        command(folder, *more, out=out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    most = 0
    while run.poll() is None:
        try:
            most = max(most, len(os.listdir(f"/proc/{run.pid}/task")))
        except OSError:  # it has just ended
            break
    assert run.wait() == 0
    return most


def test_the_number_of_threads_is_limited(tmp_path):
    few = most_threads(tmp_path, "--threads", "1", out="few")
    assert few <= 2  # this one, and one that writes files
    if len(os.sched_getaffinity(0)) > 1:
        assert most_threads(tmp_path, out="all") > few


@pytest.mark.parametrize("number", ["0", "-1", "x", "100000"])
def test_an_invalid_number_of_threads_is_wrong_usage(tmp_path, number):
    result = generate(tmp_path, "--threads", number)
    assert result.returncode == 2
    assert "--threads" in result.stderr


def test_quiet_commands_print_nothing_but_their_error(whole, tmp_path):
    result = generate(tmp_path, "--quiet")
    assert (result.returncode, result.stderr) == (0, "")
    assert "dataset: " in result.stdout
    assert files(tmp_path / "out") == files(whole)
    assert groundray("verify", tmp_path / "out", "-q").stderr == ""
    (tmp_path / "out/lidar/top/000001.ply").unlink()
    result = generate(tmp_path, "--resume", "-q")
    assert (result.returncode, result.stderr) == (0, "")
    refused(generate(tmp_path, "-q"), "add --resume")
