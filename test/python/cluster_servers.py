"""S3 servers on this machine: in memory (moto), on disk (s3s-fs); some fail or are slow."""

import collections
import contextlib
import http.client
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from cluster_runs import wait_for
from groundray.cluster.store import Store

pytest.importorskip("moto.server", reason="an S3 server for tests is in moto[server]")

ON_DISK = os.environ.get("GROUNDRAY_S3S_FS") or shutil.which("s3s-fs")
"""S3 server that keeps objects in a folder (the crate s3s-fs), or nothing."""


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def answers(port):
    """Returns true if a server on this machine listens to a port."""
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@contextlib.contextmanager
def _started(port, *command):
    server = subprocess.Popen(
        list(map(str, command)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )

    def is_ready():
        assert server.poll() is None, command
        return answers(port)

    try:
        wait_for(is_ready)
        yield port
    finally:
        server.kill()
        server.wait()


def memory_server():
    """Runs an S3 server that keeps objects in memory; yields its port."""
    port = free_port()
    return _started(port, sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", port)


def disk_server(folder):
    """Runs an S3 server whose buckets are the folders of a folder; yields its port."""
    port, keys = free_port(), ("--access-key", "key", "--secret-key", "secret")
    return _started(port, ON_DISK, *keys, "--host", "127.0.0.1", "--port", port, folder)


def make_bucket(port, name):
    """Makes a bucket of a server in memory."""
    call = urllib.request.Request(f"http://127.0.0.1:{port}/{name}", method="PUT")
    urllib.request.urlopen(call).close()


def point_to(monkeypatch, port):
    values = {
        "AWS_ACCESS_KEY_ID": "key",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "AWS_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
    }
    for name, value in values.items():
        monkeypatch.setenv(name, value)


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


class _Server(ThreadingHTTPServer):
    def handle_error(self, request, address):  # a client that was killed
        pass


@contextlib.contextmanager
def serving(monkeypatch, answer):
    """Runs a server on this machine, which the environment names."""
    with _Server(("127.0.0.1", 0), Handler) as server:
        server.answer = answer
        point_to(monkeypatch, server.server_address[1])
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield
        server.shutdown()


class Relay:
    """Relays requests to a server, but answers some with 500: half of them after it has acted.

    Conditional writes of an object take turns, as those of S3 do: s3s-fs looks first and writes
    later.
    """

    def __init__(self, port):
        self.port = port
        self.count = self.failed = self.delayed = 0
        self.relayed = []
        """Method, path and size of the answer of each request."""
        self.lock = threading.Lock()
        self.turns = collections.defaultdict(threading.Lock)

    def is_failing(self, count):
        """Returns true if the request of this number, from 1, is answered with 500."""
        return False

    def delay_s(self):
        """Returns the time for which a request waits."""
        return 0

    def __call__(self, request, body):
        with self.lock:
            self.count += 1
            fails = self.is_failing(self.count)
            self.failed += fails
            acts = not fails or self.failed % 2 == 0
            delay_s = self.delay_s()
            self.delayed += delay_s > 0
            is_conditional = "If-None-Match" in request.headers
            turn = self.turns[request.path] if is_conditional else contextlib.nullcontext()
        time.sleep(delay_s)
        headers, answer = {}, b""
        if acts:
            server = http.client.HTTPConnection("127.0.0.1", self.port)
            with turn:
                server.request(request.command, request.path, body, dict(request.headers))
                got = server.getresponse()
                headers, answer = dict(got.getheaders()), got.read()
            server.close()
            self.relayed.append((request.command, request.path, len(answer)))
        if fails:
            return 500, {"Content-Length": "0"}, b""
        for name in ("Transfer-Encoding", "Connection", "Date", "Server"):
            headers.pop(name, None)
        headers = {name.title(): value for name, value in headers.items()}
        return got.status, {"Content-Length": str(len(answer)), **headers}, answer
