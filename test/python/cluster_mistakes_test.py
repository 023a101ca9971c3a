"""Mistakes in the use of groundray-cluster and of its surroundings have one clear message."""

import contextlib
import importlib
import importlib.util
import os
import re
import shutil

import pytest
from cluster_runs import arguments, cluster, single_run


def test_a_scene_that_is_a_pipe_is_rejected(tmp_path, capsys):
    os.mkfifo(tmp_path / "scene.yaml")
    given = arguments(tmp_path / "scene.yaml", (tmp_path / "store").as_uri())
    assert cluster(*given) == 1
    assert "scene.yaml: it is a pipe or device, not a file" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["merge", "status", "verify"])
def test_a_folder_that_does_not_exist_is_reported_and_not_made(tmp_path, capsys, command):
    url = (tmp_path / "no store").as_uri()
    assert cluster(command, url) == 1
    assert capsys.readouterr().err == (
        f"groundray-cluster: {url}: there is no such folder; correct the store\n"
    )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("module", "given", "message"),
    [
        ("obstore", [], "stores need obstore, which is not installed: pip install obstore"),
        (
            "distributed",
            ["--executor", "dask://127.0.0.1:1"],
            "Dask is not installed: pip install 'dask[distributed]'",
        ),
    ],
)
def test_missing_packages_are_named(tmp_path, capsys, monkeypatch, module, given, message):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == module else found(name)
    )
    assert cluster(*arguments(single_run()[0], (tmp_path / "s").as_uri()), *given) == 1
    assert capsys.readouterr().err == f"groundray-cluster: {message}\n"


def test_a_fault_of_the_scene_is_reported_once_and_ends_the_run(tmp_path, capsys):
    shutil.copy(single_run()[0], tmp_path / "scene.yaml")  # without its camera
    store = tmp_path / "store"
    given = arguments(tmp_path / "scene.yaml", store.as_uri(), "--retries", 0)
    assert cluster(*given) == 1
    *_, line = capsys.readouterr().err.splitlines()
    assert line.startswith("groundray-cluster: 3 shards failed, 0 of 6 are done: ")
    assert "camera.yaml: there is no such file" in line
    assert not list(store.glob("shards/*.done"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("--scratch", "/nowhere"), "/nowhere: No such file or directory; choose another folder"),
        (("--groundray", "no-groundray"), "no-groundray: .*; name the program by --groundray"),
        (("--store", "ftp://host/x"), "ftp://host/x: a store is s3://BUCKET/PREFIX or file:///"),
        (("--store", "file:///dev/null/x"), "file:///dev/null/x: Not a directory"),
        (("--executor", "dask://127.0.0.1:1"), "127.0.0.1:1: no scheduler answers"),
    ],
)
def test_faults_of_the_surroundings_have_one_message(tmp_path, capsys, change, message):
    url = (tmp_path / "store").as_uri()
    patience = contextlib.nullcontext()
    if change[0] == "--executor":
        pytest.importorskip("distributed")
        patience = importlib.import_module("dask").config.set(
            {"distributed.comm.timeouts.connect": "2s"}
        )
    with patience:
        assert cluster(*arguments(single_run()[0], url), "--retries", 0, *change) == 1
    *_, line = capsys.readouterr().err.splitlines()
    assert re.search(message, line)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("run", "a.yaml", "--shards", "0"), "0 must be from 1 to 1000000"),
        (("shard", "a.yaml", "--shard", "3/2"), "3/2 must be I/N, with I from 1 to N"),
        (("run", "a.yaml", "--shards", "2", "--executor", "ray"), "must be local, dask:"),
        (
            ("run", "a.yaml", "--shards", "2", "--executor", "slurm", "--workers", "2"),
            "--workers applies to local, not to slurm",
        ),
    ],
)
def test_wrong_usage_exits_with_2(capsys, given, message):
    with pytest.raises(SystemExit) as ended:
        cluster(*given, "--store", "file:///tmp/none")
    assert ended.value.code == 2
    assert message in capsys.readouterr().err
