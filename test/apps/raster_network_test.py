"""DEMs on servers, if the user permits them: over HTTP (/vsicurl/) and from stores (/vsis3/).

The oracle is the same file on disk. The server is one of this machine, which counts what it sends.
"""

import filecmp
import os
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
import yaml
from dem_runs import PRAIRIE, PROGRAM, ROOT

LOCAL_TIMEOUT_S = 60


class Store(BaseHTTPRequestHandler):
    """Serves ranges of the files in `folder`; fails the first `faults` requests for contents."""

    folder: Path
    faults = 0
    sent_bytes = 0
    requests = 0

    def do_HEAD(self) -> None:
        self._answer(with_content=False)

    def do_GET(self) -> None:
        self._answer(with_content=True)

    def _answer(self, with_content: bool) -> None:
        store = type(self)
        store.requests += 1
        file = store.folder / self.path.split("?")[0].lstrip("/")
        if with_content and store.faults > 0:
            store.faults -= 1
            self.send_error(503)
            return
        if not file.is_file():
            self.send_error(404)
            return
        content = file.read_bytes()
        size = len(content)
        wanted = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        if wanted:
            first = int(wanted[1])
            last = min(int(wanted[2] or size), size - 1)
            content = content[first : last + 1]
            self.send_response(206)
            self.send_header("Content-Range", f"bytes {first}-{last}/{size}")
        else:
            self.send_response(200)
        self.send_header("Accept-Ranges", "bytes")
        self.send_header("Last-Modified", "Mon, 02 Nov 2026 10:00:00 GMT")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if with_content:
            store.sent_bytes += len(content)
            self.wfile.write(content)

    def log_message(self, *_: object) -> None:
        """Prints nothing."""


@pytest.fixture
def store(tmp_path: Path) -> Iterator[tuple[type[Store], str]]:
    """A server of a folder with a DEM as COG, in a bucket, and its address."""
    folder = tmp_path / "served"
    (folder / "bucket").mkdir(parents=True)
    cog = folder / "bucket/dem.tif"
    subprocess.run(["gdal_translate", "-q", "-of", "COG", str(PRAIRIE), str(cog)], check=True)
    handler = type("OneStore", (Store,), {"folder": folder})
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield handler, f"127.0.0.1:{server.server_port}"
    server.shutdown()


def run(
    *arguments: str | Path, home: Path, address: str = "", **environment: str
) -> subprocess.CompletedProcess[str]:
    """Runs groundray with a home, and with S3 at an address."""
    return subprocess.run(
        [PROGRAM, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=LOCAL_TIMEOUT_S,
        env={
            "PATH": "/usr/bin:/bin",
            "HOME": str(home),
            "AWS_NO_SIGN_REQUEST": "YES",
            "AWS_S3_ENDPOINT": address,
            "AWS_HTTPS": "NO",
            "AWS_VIRTUAL_HOSTING": "NO",
            "GDAL_HTTP_RETRY_DELAY": "0.05",
            **environment,
        },
    )


def facts(text: str) -> list[str]:
    """Returns the lines of `info` that do not depend on where the file is."""
    return [line for line in text.splitlines() if not re.match(r"file|.*dem\.tif", line)]


@pytest.mark.parametrize("system", ["/vsicurl/http://{}/bucket/dem.tif", "/vsis3/bucket/dem.tif"])
def test_dem_on_a_server_is_the_same_as_on_disk(
    system: str, store: tuple[type[Store], str], tmp_path: Path
) -> None:
    handler, address = store
    remote = system.format(address)
    local = handler.folder / "bucket/dem.tif"
    expected = run("info", local, home=tmp_path)
    assert expected.returncode == 0, expected.stderr
    assert len(facts(expected.stdout)) > 5
    for permission in (["--network"], []):
        environment = {} if permission else {"GROUNDRAY_NETWORK": "1"}
        found = run("info", remote, *permission, home=tmp_path, address=address, **environment)
        assert found.returncode == 0, found.stderr
        assert facts(found.stdout) == facts(expected.stdout)
    scene = yaml.safe_load((ROOT / "data/scenes/first_light.yaml").read_text())
    for name, dem in {"remote": remote, "local": str(local)}.items():
        scene["terrain"]["dem"] = dem
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump(scene))
        done = run(
            "generate",
            *(tmp_path / f"{name}.yaml", "-o", tmp_path / name, "--frames", "0", "--network"),
            home=tmp_path,
            address=address,
        )
        assert done.returncode == 0, done.stderr
    scans = sorted(
        path.relative_to(tmp_path / "local") for path in tmp_path.glob("local/*/*/*.ply")
    )
    assert scans
    for scan in scans:
        assert filecmp.cmp(tmp_path / "local" / scan, tmp_path / "remote" / scan, shallow=False)


def test_network_is_closed_by_default(store: tuple[type[Store], str], tmp_path: Path) -> None:
    handler, address = store
    for environment in ({}, {"GROUNDRAY_NETWORK": "0"}, {"GROUNDRAY_NETWORK": ""}):
        result = run(
            "info", f"/vsicurl/http://{address}/bucket/dem.tif", home=tmp_path, **environment
        )
        assert result.returncode == 1
        assert (
            "/vsicurl is not read: rasters must be local files, unless --network or "
            "GROUNDRAY_NETWORK=1 permits servers" in result.stderr
        )
    assert handler.requests == 0


NOT_READ = "is not read: rasters must be local files; download it first"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("/vsicurl?url=http://{}/bucket/dem.tif", "there is no such file"),
        ("/vsicurl_streaming/http://{}/bucket/dem.tif", NOT_READ),
        ("/vsigs/bucket/dem.tif", NOT_READ),
        ("/vsizip//vsiaz/bucket/dem.zip/dem.tif", NOT_READ),
        ("http://{}/bucket/dem.tif", "it is an address, but must be a file"),
    ],
)
def test_other_systems_of_servers_stay_closed(
    name: str, message: str, store: tuple[type[Store], str], tmp_path: Path
) -> None:
    handler, address = store
    result = run("info", name.format(address), "--network", home=tmp_path, address=address)
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1, result.stderr
    assert message in result.stderr
    assert handler.requests == 0


def dem_with_overviews(folder: Path, name: str) -> Path:
    """Returns a DEM whose metadata say that its overviews are in the named raster."""
    shutil.copyfile(PRAIRIE, folder / "dem.tif")
    (folder / "dem.tif.aux.xml").write_text(
        f"""<PAMDataset><Metadata domain="OVERVIEWS">
<MDI key="OVERVIEW_FILE">{name}</MDI></Metadata></PAMDataset>"""
    )
    return folder / "dem.tif"


@pytest.mark.parametrize(("system", "is_read"), [("vsicurl", True), ("vsicurl_streaming", False)])
def test_vrt_leads_to_the_permitted_systems_alone(
    system: str, is_read: bool, store: tuple[type[Store], str], tmp_path: Path
) -> None:
    handler, address = store
    vrt = tmp_path / "dem.vrt"
    subprocess.run(["gdalbuildvrt", "-q", str(vrt), str(PRAIRIE)], check=True)
    source = f"/{system}/http://{address}/bucket/dem.tif"
    text = re.sub(
        r"(<SourceFilename[^>]*)>[^<]*<",
        rf'<SourceFilename relativeToVRT="0">{source}<',
        vrt.read_text(),
    )
    vrt.write_text(text)
    result = run("info", vrt, "--network", home=tmp_path)
    assert (result.returncode == 0) == is_read, result.stderr
    assert (handler.requests > 0) == is_read


def test_metadata_lead_to_no_server(store: tuple[type[Store], str], tmp_path: Path) -> None:
    """With the permission, too, a raster other than a VRT refers to no file elsewhere."""
    _, address = store
    dem = dem_with_overviews(tmp_path, f"/vsicurl/http://{address}/bucket/dem.tif")
    result = run("info", dem, "--network", home=tmp_path)
    assert result.returncode == 1
    assert "dem.tif, which is not in its folder" in result.stderr


def test_network_stays_closed_after_a_value_that_is_not_known(
    store: tuple[type[Store], str], tmp_path: Path
) -> None:
    """A process that goes on after the error can read no more than others."""
    handler, address = store
    dem = dem_with_overviews(tmp_path, f"/vsicurl/http://{address}/bucket/dem.tif")
    script = f"""
import os, groundray
os.environ["GROUNDRAY_NETWORK"] = "yes"
try:
    groundray.load_terrain({str(dem)!r})
except groundray.Error as fault:
    print(fault)
os.environ["GROUNDRAY_NETWORK"] = "0"
print(groundray.load_terrain({str(dem)!r}).crs)
"""
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        timeout=LOCAL_TIMEOUT_S,
        env={**os.environ, "PYTHONPATH": str(ROOT / "build/release/python")},
    )
    assert done.returncode == 0, done.stderr
    assert "GROUNDRAY_NETWORK must be 1" in done.stdout.splitlines()[0]
    assert "NAD83" in done.stdout.splitlines()[1]
    assert handler.requests == 0


def test_value_of_the_environment_must_be_known(tmp_path: Path) -> None:
    result = run("info", PRAIRIE, home=tmp_path, GROUNDRAY_NETWORK="yes")
    assert result.returncode == 1
    assert "GROUNDRAY_NETWORK must be 1 (rasters are read from servers) or 0" in result.stderr


def test_server_that_fails_for_a_while_is_asked_again(
    store: tuple[type[Store], str], tmp_path: Path
) -> None:
    handler, address = store
    handler.faults = 2
    result = run("info", f"/vsicurl/http://{address}/bucket/dem.tif", "--network", home=tmp_path)
    assert result.returncode == 0, result.stderr
    assert handler.faults == 0


def test_lasting_faults_give_one_message(store: tuple[type[Store], str], tmp_path: Path) -> None:
    handler, address = store
    url = f"/vsicurl/http://{address}/bucket"
    absent = run("info", f"{url}/absent.tif", "--network", home=tmp_path)
    handler.faults = 10**6
    broken = run("info", f"{url}/dem.tif", "--network", home=tmp_path)
    nobody = run("info", "/vsicurl/http://127.0.0.1:9/dem.tif", "--network", home=tmp_path)
    for result, words in (
        (absent, "HTTP response code: 404"),
        (broken, "503"),
        (nobody, "Failed to connect"),
    ):
        assert result.returncode == 1
        assert len(result.stderr.splitlines()) == 1, result.stderr
        assert "the server does not give it: " in result.stderr
        assert words in result.stderr


def test_cut_file_on_a_server_gives_one_message(
    store: tuple[type[Store], str], tmp_path: Path
) -> None:
    handler, address = store
    cut = handler.folder / "bucket/cut.tif"
    content = (handler.folder / "bucket/dem.tif").read_bytes()
    cut.write_bytes(content[: len(content) // 2])
    result = run("info", f"/vsicurl/http://{address}/bucket/cut.tif", "--network", home=tmp_path)
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1, result.stderr


def test_dem_in_an_archive_on_a_server_is_read(
    store: tuple[type[Store], str], tmp_path: Path
) -> None:
    handler, address = store
    shutil.make_archive(str(handler.folder / "dem"), "zip", handler.folder / "bucket", "dem.tif")
    result = run(
        "info", f"/vsizip/vsicurl/http://{address}/dem.zip/dem.tif", "--network", home=tmp_path
    )
    assert result.returncode == 0, result.stderr
