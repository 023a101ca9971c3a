"""An array of 20 tasks on a SLURM cluster of this machine alone, of which one is requeued.

It runs with GROUNDRAY_PROOF=full, if Debian's packages slurm-wlm and munge are installed: the test
starts their daemons itself, in a temporary folder, and stops them.
"""

import contextlib
import getpass
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from cluster_runs import (
    PACKAGE,
    arguments,
    calls,
    camera_run,
    cluster,
    hanging,
    is_alive,
    pid_in,
    wait_for,
)
from cluster_servers import free_port
from dataset_runs import files

SHARDS = 20
CONFIGURATION = """\
ClusterName=groundray
SlurmctldHost=localhost
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={controller_port}
SlurmdPort={node_port}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=5
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
NodeName=localhost NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=main Nodes=localhost Default=YES State=UP
"""


def _told(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


@pytest.fixture
def slurm(tmp_path, monkeypatch):
    """A cluster of one node, which the environment names; yields the folder of its logs."""
    if os.environ.get("GROUNDRAY_PROOF") != "full":
        pytest.skip("a cluster of SLURM is started with GROUNDRAY_PROOF=full only")
    path = f"{os.environ['PATH']}:/usr/sbin"
    programs = {
        name: shutil.which(name, path=path)
        for name in ("munged", "slurmctld", "slurmd", "sbatch", "scontrol")
    }
    if absent := [name for name, found in programs.items() if found is None]:
        pytest.skip(f"there is no {', '.join(absent)}: install slurm-wlm and munge")
    folder = tmp_path / "slurm"
    folder.mkdir(mode=0o700)
    for name in ("state", "spool"):
        (folder / name).mkdir()
    (folder / "munge.key").write_bytes(os.urandom(1024))
    (folder / "munge.key").chmod(0o600)
    text = CONFIGURATION.format(
        user=getpass.getuser(),
        folder=folder,
        controller_port=free_port(),
        node_port=free_port(),
    )
    (folder / "slurm.conf").write_text(text)
    monkeypatch.setenv("SLURM_CONF", str(folder / "slurm.conf"))
    monkeypatch.setenv("PYTHONPATH", str(PACKAGE))
    munge_files = [
        f"--{name}-file={folder}/munge{end}"
        for name, end in (("key", ".key"), ("pid", ".pid"), ("seed", ".seed"), ("log", ".log"))
    ]
    daemons = [
        ["munged", "--foreground", "--force", f"--socket={folder}/munge.socket", *munge_files],
        ["slurmctld", "-D", "-f", str(folder / "slurm.conf")],
        ["slurmd", "-D", "-f", str(folder / "slurm.conf"), "-N", "localhost"],
    ]
    with contextlib.ExitStack() as running:
        for name, *given in daemons:
            with (folder / f"{name}.out").open("wb") as output:
                daemon = subprocess.Popen(
                    [programs[name], *given], stdout=output, stderr=subprocess.STDOUT
                )
            running.callback(daemon.wait)
            running.callback(daemon.terminate)
            if name == "munged":
                wait_for((folder / "munge.socket").exists)

        def is_ready():
            told = subprocess.run(
                ["sinfo", "-h", "-o", "%T"], capture_output=True, text=True, check=False
            )
            return told.stdout.split() == ["idle"]

        wait_for(is_ready, 120)
        yield folder


def test_an_array_of_which_a_task_is_requeued_gives_the_bytes_of_a_single_run(
    tmp_path, slurm, capsys
):
    scene, whole = camera_run(tmp_path, SHARDS + 3)
    store = tmp_path / "store"
    given = arguments(scene, store.as_uri(), "--executor", "slurm", shards=SHARDS)
    given += ["--groundray", hanging(tmp_path), "--threads", 1]
    given += [f"--sbatch=-o {slurm}/task-%a.log"]
    assert cluster(*given) == 0
    (job,) = re.fullmatch(r"Submitted batch job (\d+)\n", capsys.readouterr().out).groups()

    hung = pid_in(tmp_path)
    (call,) = (each for each in calls(tmp_path) if _shard_of(hung) in each)
    shard = re.search(r"--shard (\d+)/", call)[1]
    _told("scontrol", "requeue", f"{job}_{shard}")
    wait_for(lambda: not is_alive(hung))
    wait_for(lambda: not _told("squeue", "-h", "-j", job), 900)

    tasks = {i: (slurm / f"task-{i}.log").read_text() for i in range(1, SHARDS + 1)}
    assert "DUE TO JOB REQUEUE" in tasks[int(shard)]
    for i, text in tasks.items():
        assert f"shard {i}/{SHARDS} made\n" in text
    assert len(calls(tmp_path)) == SHARDS + 1
    assert cluster("status", store.as_uri()) == 0
    assert f"{SHARDS} of {SHARDS} shards done" in capsys.readouterr().out
    assert cluster("merge", store.as_uri()) == 0
    assert files(store / "dataset") == whole
    assert cluster("verify", store.as_uri()) == 0


def _shard_of(pid):
    """Returns how the environment of a process names its shard."""
    text = Path(f"/proc/{pid}/environ").read_bytes().decode()
    return f"--shard {re.search(r'SLURM_ARRAY_TASK_ID=([0-9]+)', text)[1]}/{SHARDS}"
