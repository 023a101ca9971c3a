"""A run on Dask workers that are killed at random, with a scheduler that is restarted, an S3 server
that fails for a while and attempts that are doubled, has the bytes of a single run.

GROUNDRAY_PROOF=full makes it large.
"""

import os
import random
import signal
import subprocess
import sys
import time

import pytest
from cluster_runs import PACKAGE, arguments, cluster, started
from cluster_store_test import Relay, bucket, dataset_in, free_port, port, serving  # noqa: F401
from dataset_runs import ROOT, files, groundray
from groundray.cluster.store import Store

pytest.importorskip("distributed", reason="the executor dask needs distributed")

SHARDS, KILLS = (200, 20) if os.environ.get("GROUNDRAY_PROOF") == "full" else (12, 3)
CAMERA = """\
groundray_camera: 1
model: A small camera
size_px: [32, 24]
rate_hz: 10
lens: {pinhole: {focal_px: [30, 30], centre_px: [15.5, 11.5]}}
shutter: {exposure_ms: 1}
products: [radiance, truth]
sampling: {samples: 4, most_samples: 4}
"""
SCENE = f"""\
groundray: 1
seed: 5
duration_s: {SHARDS / 10 + 0.3}
terrain: {{dem: {ROOT / "data/terrain/prairie_1m.tif"}, material: dry_soil}}
sky: {{analytic: {{}}, sun: {{azimuth_deg: 130, elevation_deg: 40}}}}
platform:
  drive: {{waypoints_m: [[429340, 5150600], [429560, 5150770]], speed_m_s: 8, height_m: 0.5}}
cameras:
  - {{name: eye, file: camera.yaml, mount: {{translation_m: [1, 0, 1.2]}}}}
"""


class Dask:
    """A scheduler and four workers, as processes."""

    def __init__(self, folder):
        self.folder, self.port = folder, free_port()
        self.start()

    def process(self, what, *given):
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{what}", *given, "--no-dashboard"],
            cwd=self.folder,
            env={
                **os.environ,
                "PYTHONPATH": str(PACKAGE),
                "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "100",
            },
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def start(self):
        self.scheduler = self.process("scheduler", "--host", "127.0.0.1", "--port", str(self.port))
        address = f"tcp://127.0.0.1:{self.port}"
        self.guards = [self.process("worker", address, "--nthreads", "1") for _ in range(4)]

    def restart(self):
        """Kills the scheduler, after which workers end by themselves, and starts all again."""
        self.scheduler.kill()
        for each in (self.scheduler, *self.guards):
            each.wait(timeout=120)
        self.start()

    def workers(self):
        """Returns the processes that make shards: each is the child of a process that guards it."""
        guards = ",".join(str(guard.pid) for guard in self.guards)
        call = ["pgrep", "-P", guards, "-f", "spawn_main"]
        return subprocess.run(call, capture_output=True, text=True, check=False).stdout.split()

    def stop(self):
        for process in (*self.guards, self.scheduler):
            process.kill()  # and the workers end without their guards
            process.wait()


def test_kills_restarts_failures_and_doubled_attempts_change_no_byte(
    tmp_path,
    bucket,  # noqa: F811
    port,  # noqa: F811
    monkeypatch,
):
    (tmp_path / "scene.yaml").write_text(SCENE)
    (tmp_path / "camera.yaml").write_text(CAMERA)
    (tmp_path / "scratch").mkdir()
    alone = groundray("generate", tmp_path / "scene.yaml", "-o", tmp_path / "out")
    assert alone.returncode == 0, alone.stderr
    url = f"s3://{bucket}/run"
    begin = time.monotonic()
    relay = Relay(port, lambda count: 20 < time.monotonic() - begin < 23 or count % 10 == 0)
    chance = random.Random(3)
    with serving(monkeypatch, relay):
        dask = Dask(tmp_path)
        try:
            given = [*arguments(tmp_path / "scene.yaml", url, shards=SHARDS), "--threads", 1]
            given += ["--scratch", tmp_path / "scratch"]
            on_dask = [*given, "--executor", f"dask://127.0.0.1:{dask.port}"]
            shard = ["shard", given[1], *given[4:], "--shard"]
            doubled = [started(*shard, f"{i}/{SHARDS}") for i in (1, 2)]
            run, killed, runs = started(*on_dask), 0, 1
            store = Store(url)

            def done():
                return sum(each.key.endswith(".done") for each in store.list("shards"))

            while run.poll() != 0:
                if run.poll() is not None:
                    assert "lost the scheduler; run the same command again" in run.stderr.read()
                    run, runs = started(*on_dask), runs + 1
                if killed < KILLS and (workers := dask.workers()):
                    os.kill(int(chance.choice(workers)), signal.SIGKILL)
                    killed += 1
                if runs == 1 and done() > SHARDS // 2:
                    dask.restart()
                    run.wait(timeout=120)
                time.sleep(chance.uniform(1, 5))
                assert time.monotonic() - begin < 1800
            for each in doubled:
                assert each.wait(timeout=60) == 0
        finally:
            run.kill()
            dask.stop()
        assert (killed, runs) == (KILLS, 2)
        assert dataset_in(url) == files(tmp_path / "out")
        assert cluster("verify", url) == 0
    assert relay.failed > SHARDS // 2
