"""The time that groundray-cluster adds to that of groundray, and what passes Dask's scheduler."""

import os
import pickle
import subprocess
import sys

import pytest
from cluster_runs import PACKAGE, PROGRAM, arguments, camera_scene, cluster, single_run

IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
SHARE = 0.02
# Runs the command, and prints the time of processors of its own process and of its children.
TIMED = """
import resource, sys
from groundray.cluster.command import main
code = main(sys.argv[1:])
used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
print(*(each.ru_utime + each.ru_stime for each in used))
sys.exit(code)
"""


def test_the_time_that_it_adds_is_small_for_shards_of_a_minute(tmp_path, capsys):
    """CPU time, including `groundray --version`, of a shard in a process of its own."""
    scene, whole = single_run()
    program = tmp_path / "version"
    program.write_text(f'#!/bin/sh\n[ $1 = --version ] && exec {PROGRAM} "$@"\nexit 3\n')
    program.chmod(0o755)
    shard = ["shard", scene, "--shard", "1/1", "--retries", 0, "--scratch", tmp_path]

    def used_s(store, made_by):
        ran = subprocess.run(
            [
                *(sys.executable, "-P", "-c", TIMED),
                *map(str, (*shard, "--store", (tmp_path / store).as_uri(), "--groundray", made_by)),
            ],
            env={**os.environ, "PYTHONPATH": str(PACKAGE)},
            stdout=subprocess.PIPE,
            check=False,
        )
        return list(map(float, ran.stdout.splitlines()[-1].split()))

    own_s, _ = used_s("made", PROGRAM)
    _, version_s = used_s("asked", program)
    size_mib = sum(map(len, whole.values())) / 2**20
    with capsys.disabled():
        print(f"\nadded to a shard of {size_mib:.0f} MiB: {own_s + version_s:.2f} s of CPU")
    assert own_s + version_s < SHARE * 60


def test_what_passes_the_scheduler_does_not_depend_on_the_number_of_frames(tmp_path, capsys):
    distributed = pytest.importorskip("distributed", reason="the executor dask needs distributed")

    class Sizes(distributed.SchedulerPlugin):
        def __init__(self, scheduler):
            self.scheduler, self.found = scheduler, {}

        def transition(self, key, start, finish, *args, **kwargs):
            if finish == "memory":
                task = self.scheduler.tasks[key]
                self.found[key] = len(pickle.dumps(task.run_spec)), task.nbytes

    def sizes(frames):
        folder = tmp_path / f"{frames:06}"
        folder.mkdir()
        with distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            processes=False,
            dashboard_address=None,
            protocol="tcp",
            host="127.0.0.1",
        ) as workers:
            plugin = Sizes(workers.scheduler)
            workers.scheduler.add_plugin(plugin)
            address = workers.scheduler_address.replace("tcp://", "dask://")
            given = arguments(camera_scene(folder, frames), (folder / "store").as_uri(), shards=3)
            assert cluster(*given, "--executor", address) == 0
        assert len(plugin.found) == 3
        return sorted(plugin.found.values())

    few = sizes(10 if IS_FULL else 3)
    with capsys.disabled():
        print(f"\nbytes of the tasks and of their results: {few}")
    assert sizes(1000 if IS_FULL else 30) == few
    assert max(map(sum, few)) < 4096
