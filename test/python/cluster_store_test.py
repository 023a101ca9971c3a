"""groundray-cluster with S3 servers: equal bytes, also from one that fails, and its faults."""

import http.client
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from cluster_runs import arguments, cluster, single_run, wait_for
from dataset_runs import groundray
from groundray.cluster.store import Store

pytest.importorskip("moto.server", reason="an S3 server for tests is in moto[server]")


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


@pytest.fixture(scope="module")
def port():
    """Port of an S3 server that keeps objects in memory."""
    number = free_port()
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(number)]
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def answers():
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", number)) == 0

    try:
        wait_for(answers)
        yield number
    finally:
        server.kill()
        server.wait()


def point_to(monkeypatch, port):
    values = {
        "AWS_ACCESS_KEY_ID": "key",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "AWS_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
    }
    for name, value in values.items():
        monkeypatch.setenv(name, value)


@pytest.fixture
def bucket(port, monkeypatch, request):
    """A new bucket, whose server the environment names."""
    name = "bucket-" + str(abs(hash(request.node.name)))
    call = urllib.request.Request(f"http://127.0.0.1:{port}/{name}", method="PUT")
    urllib.request.urlopen(call).close()
    point_to(monkeypatch, port)
    return name


def dataset_in(url):
    """Reads the objects of a dataset as files of a folder."""
    store = Store(url)
    return {
        each.key.removeprefix("dataset/"): store.get(each.key) for each in store.list("dataset")
    }


class Handler(BaseHTTPRequestHandler):
    """Answers as the function `answer` of its server says: status, headers, body."""

    protocol_version = "HTTP/1.1"

    def handle_request(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        status, headers, answer = self.server.answer(self, body)
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(answer)

    do_GET = do_PUT = do_HEAD = do_POST = do_DELETE = handle_request

    def log_message(self, *_):
        pass


@contextmanager
def serving(monkeypatch, answer):
    """Runs a server on this machine, which the environment names."""
    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        server.answer = answer
        point_to(monkeypatch, server.server_address[1])
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield
        server.shutdown()


class Relay:
    """Relays requests to a server, but answers some with 500: half of them after it has acted."""

    def __init__(self, port, is_failing):
        self.port, self.is_failing = port, is_failing
        self.count = self.failed = 0
        self.lock = threading.Lock()

    def __call__(self, request, body):
        with self.lock:
            self.count += 1
            fails = self.is_failing(self.count)
            self.failed += fails
            acts = not fails or self.failed % 2 == 0
        headers, answer = {}, b""
        if acts:
            server = http.client.HTTPConnection("127.0.0.1", self.port)
            server.request(request.command, request.path, body, dict(request.headers))
            got = server.getresponse()
            headers, answer = dict(got.getheaders()), got.read()
            server.close()
        if fails:
            return 500, {"Content-Length": "0"}, b""
        for name in ("Transfer-Encoding", "Connection", "Date", "Server"):
            headers.pop(name, None)
        return got.status, {"Content-Length": str(len(answer)), **headers}, answer


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
    relay = Relay(port, lambda count: time.monotonic() < begin + 2 or count % 4 == 0)
    url = f"s3://{bucket}/run"
    with serving(monkeypatch, relay):
        assert cluster(*arguments(scene, url, shards=2)) == 0
        assert dataset_in(url) == whole
    assert relay.failed > 10


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
