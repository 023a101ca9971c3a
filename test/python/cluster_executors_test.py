"""Executors of groundray-cluster: a Dask cluster that loses a worker, and scripts for SLURM."""

import os
import re
import shlex
import shutil
import signal
import subprocess
import threading
from pathlib import Path

import pytest
import yaml
from cluster_runs import (
    PACKAGE,
    SHARDS,
    arguments,
    calls,
    cluster,
    hanging,
    is_alive,
    pid_in,
    single_run,
    wait_for,
)
from dataset_runs import ROOT, files


def test_a_dask_cluster_that_loses_a_worker_gives_the_bytes_of_a_single_run(tmp_path):
    distributed = pytest.importorskip("distributed", reason="the executor dask needs distributed")
    scene, whole = single_run()
    store, scratch = tmp_path / "store", tmp_path / "scratch"
    scratch.mkdir()
    killed = []

    def kill():
        killed.append(pid_in(tmp_path))
        status = Path(f"/proc/{killed[0]}/status").read_text()
        os.kill(int(re.search(r"PPid:\t(\d+)", status)[1]), signal.SIGKILL)

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    ) as workers:
        address = workers.scheduler_address.replace("tcp://", "dask://")
        killer = threading.Thread(target=kill)
        killer.start()
        assert (
            cluster(
                *arguments(scene, store.as_uri(), "--executor", address, "--threads", 1),
                *("--groundray", hanging(tmp_path), "--scratch", scratch),
            )
            == 0
        )
        killer.join()
    wait_for(lambda: not is_alive(killed[0]))
    assert files(store / "dataset") == whole
    assert len(calls(tmp_path)) >= SHARDS + 1  # Dask may repeat shards of the lost worker
    assert len(list(scratch.iterdir())) <= 1  # of the lost worker, if no attempt began after it


@pytest.fixture
def sbatch(tmp_path, monkeypatch):
    """A folder in which a program in sbatch's place notes what it is given."""
    folder = tmp_path / "slurm"
    folder.mkdir()
    (folder / "sbatch").write_text(
        f'#!/bin/sh\ncat > {folder}/script\necho "Submitted batch job 12"\n'
    )
    (folder / "sbatch").chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    return folder


def test_tasks_of_a_slurm_array_make_the_shards_that_are_missing(tmp_path, sbatch, capsys):
    scene, whole = single_run()
    store = tmp_path / "a store"
    url = "file://" + str(store)
    shard = ["shard", scene, "--store", url, *arguments(scene, url)[6:]]
    assert cluster(*shard, "--shard", f"3/{SHARDS}") == 0
    given = [*arguments(scene, url), "--executor", "slurm", "--sbatch=--partition=long"]
    capsys.readouterr()
    assert cluster(*given) == 0
    assert capsys.readouterr().out == "Submitted batch job 12\n"
    script = (sbatch / "script").read_text()
    assert "#SBATCH --array=1-2,4-6\n" in script
    assert "#SBATCH --partition=long\n" in script
    assert cluster(*given, "--print-script") == 0
    assert capsys.readouterr().out == script
    for i in (1, 2, 4, 5, 6):
        subprocess.run(
            ["sh", sbatch / "script"],
            env={**os.environ, "PYTHONPATH": str(PACKAGE), "SLURM_ARRAY_TASK_ID": str(i)},
            check=True,
        )
    assert cluster("merge", url) == 0
    assert files(store / "dataset") == whole
    capsys.readouterr()
    assert cluster(*given) == 0
    assert capsys.readouterr().out == (
        "all shards are done; merge them with groundray-cluster merge\n"
    )
    assert shlex.split(script.splitlines()[-1])[0] == "exec"


def test_refusals_of_sbatch_and_its_absence_are_reported(tmp_path, sbatch, capsys, monkeypatch):
    url = (tmp_path / "store").as_uri()
    given = [*arguments(single_run()[0], url), "--executor", "slurm"]
    (sbatch / "sbatch").write_text('#!/bin/sh\necho "no such partition" >&2\nexit 1\n')
    assert cluster(*given) == 1
    assert capsys.readouterr().err == "groundray-cluster: sbatch: no such partition\n"
    (sbatch / "sbatch").unlink()
    if shutil.which("sbatch") is None:
        assert cluster(*given) == 1
        assert "sbatch: No such file or directory; SLURM is not on" in capsys.readouterr().err


def test_the_manifest_of_the_page_fits_the_schema_of_kubernetes():
    schemas = pytest.importorskip("kubernetes_validate")
    page = (ROOT / "docs/reference/cluster.md").read_text()
    (block,) = (each for each in re.findall(r"```yaml\n(.*?)```", page, re.S) if "kind:" in each)
    manifest = yaml.safe_load(block)
    schemas.validate(manifest, "1.33", strict=True)
    with pytest.raises(schemas.ValidationError):
        schemas.validate({**manifest, "spec": {"completions": "all"}}, "1.33", strict=True)
    (container,) = manifest["spec"]["template"]["spec"]["containers"]
    (text,) = container["args"]
    last = manifest["spec"]["completions"] - 1
    words = subprocess.run(
        ["sh", "-c", text.replace("exec groundray-cluster", "printf '%s\\n'")],
        env={"JOB_COMPLETION_INDEX": str(last), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert words[words.index("--shard") + 1] == f"{last + 1}/{last + 1}"
