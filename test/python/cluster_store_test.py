"""groundray-cluster with S3 servers: equal bytes, also from one that fails, and its faults."""

import time

import obstore
import pytest
from cluster_runs import arguments, cluster, single_run
from cluster_servers import Relay, dataset_in, make_bucket, memory_server, point_to, serving
from dataset_runs import groundray
from groundray.cluster.store import Store


@pytest.fixture(scope="module")
def port():
    """Port of an S3 server that keeps objects in memory."""
    with memory_server() as number:
        yield number


@pytest.fixture
def bucket(port, monkeypatch, request):
    """A new bucket, whose server the environment names."""
    name = "bucket-" + str(abs(hash(request.node.name)))
    make_bucket(port, name)
    point_to(monkeypatch, port)
    return name


def test_a_run_in_a_bucket_has_the_bytes_of_a_single_run(bucket, capsys):
    scene, whole = single_run()
    url = f"s3://{bucket}/some/run"
    assert cluster(*arguments(scene, url, shards=3)) == 0
    assert dataset_in(url) == whole
    assert cluster("verify", url) == 0
    assert cluster("status", url) == 0
    assert "3 of 3 shards done, 0 running, 0 failed, 0 waiting; merged" in capsys.readouterr().out
    Store(url).put("dataset/poses/top.tum", b"other")
    assert cluster("verify", url) == 1
    assert "dataset/poses/top.tum: changed since it was written" in capsys.readouterr().out


def test_a_server_that_fails_for_a_while_and_then_now_and_again_changes_nothing(
    bucket, port, monkeypatch
):
    scene, whole = single_run()
    begin = time.monotonic()
    relay = Relay(port)
    relay.is_failing = lambda count: time.monotonic() < begin + 1 or count % 5 == 0
    url = f"s3://{bucket}/run"
    with serving(monkeypatch, relay):
        assert cluster(*arguments(scene, url, shards=2)) == 0
        assert dataset_in(url) == whole
    assert relay.failed > 10


def test_merge_reads_no_file_of_the_dataset(bucket, port, monkeypatch):
    """Files are under their final names from the beginning: nothing is copied."""
    scene, whole = single_run()
    url = f"s3://{bucket}/run"
    assert cluster(*arguments(scene, url, shards=3)) == 0
    obstore.delete(Store(url)._store, "dataset/dataset.yaml")
    relay = Relay(port)
    with serving(monkeypatch, relay):
        assert cluster("merge", url) == 0
    point_to(monkeypatch, port)
    assert dataset_in(url) == whole
    keys = [
        (method, path.partition("/run/")[2])
        for method, path, _ in relay.relayed
        if "?" not in path  # of a listing
    ]
    markers = [f"shards/{i}.done" for i in (1, 2, 3)]
    assert keys == [
        *(("GET", key) for key in ("run.json", "common.yaml", *markers, "dataset/dataset.yaml")),
        ("PUT", "dataset/dataset.yaml"),
    ]
    assert sum(size for _, _, size in relay.relayed) < 5 * len(whole["dataset.yaml"])


def test_other_bytes_in_the_bucket_are_named_and_kept(bucket, capsys):
    url = f"s3://{bucket}/run"
    key = "dataset/lidar/top/000000.ply"
    Store(url).put(key, b"other")
    assert cluster(*arguments(single_run()[0], url, shards=2)) == 1
    assert f"{url}/{key}: it has other bytes than this attempt made" in capsys.readouterr().err
    assert Store(url).get(key) == b"other"


@pytest.mark.parametrize("command", ["run", "merge", "status", "verify"])
def test_a_missing_bucket_is_named(bucket, capsys, command):
    url = "s3://no-such-bucket/run"
    given = arguments(single_run()[0], url) if command == "run" else [command, url]
    assert cluster(*given) == 1
    assert capsys.readouterr().err == (
        f"groundray-cluster: {url}: there is no such bucket; create it, or correct the store\n"
    )


def test_a_bucket_without_a_run_is_reported(bucket, capsys):
    assert cluster("status", f"s3://{bucket}/none") == 1
    assert "it has no run, which groundray-cluster run would begin" in capsys.readouterr().err


def test_missing_rights_are_reported(monkeypatch, capsys):
    with serving(monkeypatch, lambda *_: (403, {"Content-Length": "0"}, b"")):
        for given in (arguments(single_run()[0], "s3://b/run"), ["status", "s3://b/run"]):
            assert cluster(*given) == 1
            assert capsys.readouterr().err == (
                "groundray-cluster: s3://b/run: no access: check AWS_ACCESS_KEY_ID, "
                "AWS_SECRET_ACCESS_KEY and the bucket's rights\n"
            )


def test_a_dataset_downloaded_from_the_bucket_passes_groundray_verify(bucket, tmp_path):
    scene, _ = single_run()
    url = f"s3://{bucket}/run"
    assert cluster(*arguments(scene, url, shards=2)) == 0
    for path, data in dataset_in(url).items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(data)
    verified = groundray("verify", tmp_path)
    assert verified.returncode == 0, verified.stdout
