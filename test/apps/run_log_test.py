"""The log of `groundray generate --log-json`."""

import json
import signal
import subprocess
import time
from datetime import UTC, datetime

from dataset_runs import SCENE, command, files, generate, groundray
from plyfile import PlyData


def lines_of(text):
    lines = [json.loads(line) for line in text.splitlines()]
    times = [datetime.fromisoformat(line["time"]) for line in lines]
    assert times == sorted(times)
    assert all(abs((datetime.now(UTC) - time).total_seconds()) < 600 for time in times)
    return lines


def test_a_run_logs_its_start_each_frame_and_its_end(tmp_path):
    log = tmp_path / "log.jsonl"
    assert generate(tmp_path, "--log-json", log).returncode == 0
    first, *frames, last = lines_of(log.read_text())
    assert first["event"] == "begin"
    assert first["seed"] == 7
    assert (first["frames"], first["there"]) == (9, 0)
    assert first["scene"] == str(tmp_path / "scene.yaml")
    assert first["output"] == str(tmp_path / "out")
    assert last["event"] == "end"
    assert (last["done"], last["frames"]) == (9, 9)
    there = files(tmp_path / "out")
    for k, frame in enumerate(frames):
        assert frame["event"] == "frame"
        assert frame["done"] == k + 1
        assert 0 < frame["tracing_s"] < last["elapsed_s"]
        assert 0 < frame["writing_s"] < last["elapsed_s"]
        assert 0 <= frame["writing_cpu_s"] <= frame["writing_s"] + 0.01
        stem = f"{frame['sensor']}/{frame['frame']:06}"
        assert frame["bytes"] == sum(len(data) for path, data in there.items() if stem in path)
        if frame["sensor"] == "eye":
            assert frame["pixels"] == 48 * 36
        else:
            assert (
                frame["points"] == PlyData.read(tmp_path / f"out/lidar/{stem}.ply")["vertex"].count
            )
    assert generate(tmp_path, "--log-json", log, "--resume").returncode == 0
    begun = lines_of(log.read_text())[len(frames) + 2]
    assert (begun["event"], begun["frames"], begun["there"]) == ("begin", 0, 9)


def test_standard_output_contains_only_the_log_on_request(tmp_path):
    result = generate(tmp_path, "--log-json", "-", "--shard", "2/3")
    assert result.returncode == 0
    first, *frames, last = lines_of(result.stdout)
    assert first["shard"] == "2/3"
    assert len(frames) == 3
    assert last["event"] == "end"
    assert "dataset: " in result.stderr


def test_a_failed_run_logs_the_reason(tmp_path):
    result = generate(tmp_path, "--log-json", "-", scene=SCENE.replace("seed: 7", "sed: 7"))
    assert result.returncode == 1
    (line,) = lines_of(result.stdout)
    assert line["event"] == "failed"
    assert "scene.yaml:2:1" in line["message"]
    assert line["message"] in result.stderr
    nowhere = generate(tmp_path, "--log-json", tmp_path / "no/log")
    assert nowhere.returncode == 1
    assert "--log-json" in nowhere.stderr


def test_an_interrupted_run_logs_the_interruption(tmp_path):
    run = subprocess.Popen(
        command(tmp_path, "--log-json", "-"), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    while not (tmp_path / "out/lidar/top/000000.ply").exists() and run.poll() is None:
        time.sleep(0.002)
    run.send_signal(signal.SIGINT)
    said, _ = run.communicate(timeout=60)
    assert run.returncode == 130
    lines = lines_of(said.decode())
    assert lines[-1]["event"] == "interrupted"
    assert lines[-1]["done"] == len(lines) - 2


def test_frames_are_ordered_by_ten_seconds_and_then_by_sensor(tmp_path):
    """The time left of a long run is estimated from all sensors, whose first frames come first."""
    cameras = SCENE.split("cameras:")[1].replace(
        "{lidar: top, delay_ms: 20}\n    project: [top]", "X"
    )
    camera = cameras.replace("    trigger: X\n", "    rate_hz: 0.5\n")
    scene = SCENE.split("lidars:")[0].replace("duration_s: 0.3", "duration_s: 25.2")
    scene = scene.replace("speed_m_s: 8", "speed_m_s: 0.4")
    scene += "cameras:" + camera + camera[1:].replace("name: eye", "name: other")
    result = generate(tmp_path, "--log-json", "-", scene=scene)
    assert result.returncode == 0, result.stderr
    made = [(f["sensor"], f["frame"]) for f in lines_of(result.stdout)[1:-1]]
    parts = [range(1), range(1, 5), range(5, 10), range(10, 13)]  # an image each 2 s, from 0 s on
    assert made == [
        (sensor, frame) for part in parts for sensor in ("eye", "other") for frame in part
    ]


def test_a_run_continues_if_its_log_is_closed(tmp_path):
    run = subprocess.Popen(
        command(tmp_path, "--log-json", "-"), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert b"begin" in run.stdout.readline()
    run.stdout.close()
    assert run.wait(timeout=60) == 0
    assert groundray("verify", tmp_path / "out").returncode == 0
