"""Rasters of strangers (docs/reference/trust.md): no connection is opened, and no other file read.

The oracle of the network is a listener on this machine. GDAL's own gdalinfo connects to it for most
of the forms, so that the listener is known to notice.
"""

import gzip
import os
import resource
import shutil
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from dem_runs import PRAIRIE, PROGRAM, groundray

LOCAL_TIMEOUT_S = 20


class Listener:
    """Accepts connections on 127.0.0.1, counts them and closes them at once."""

    def __init__(self) -> None:
        self.count = 0
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self.socket.getsockname()[1]}"
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            try:
                connection, _ = self.socket.accept()
            except OSError:
                return
            self.count += 1
            connection.close()


@pytest.fixture
def listener() -> Iterator[Listener]:
    """A listener that nobody else knows."""
    server = Listener()
    yield server
    server.socket.close()


def vrt(source: str, band: str = "", more: str = "", relative: int = 0) -> str:
    """Returns a VRT of one band with one source."""
    return f"""<VRTDataset rasterXSize="8" rasterYSize="8">{more}
<GeoTransform>0, 1, 0, 8, 0, -1</GeoTransform>
<VRTRasterBand dataType="Float32" band="1" {band}><SimpleSource>
<SourceFilename relativeToVRT="{relative}">{source}</SourceFilename><SourceBand>1</SourceBand>
</SimpleSource></VRTRasterBand></VRTDataset>"""


def wms(address: str) -> str:
    """Returns GDAL's description of a tiled map on a server."""
    return f"""<GDAL_WMS><Service name="TMS">
<ServerUrl>http://{address}/${{z}}/${{x}}/${{y}}.png</ServerUrl></Service>
<DataWindow><UpperLeftX>0</UpperLeftX><UpperLeftY>8</UpperLeftY><LowerRightX>8</LowerRightX>
<LowerRightY>0</LowerRightY><TileLevel>0</TileLevel><TileCountX>1</TileCountX>
<TileCountY>1</TileCountY></DataWindow><BandsCount>1</BandsCount><BlockSizeX>8</BlockSizeX>
<BlockSizeY>8</BlockSizeY></GDAL_WMS>"""


Form = Callable[[Path, str], str | Path]


def file_of(text: Callable[[str], str], name: str = "dem.tif") -> Form:
    """Returns a form that is a file with the text, which contains the address."""

    def make(folder: Path, address: str) -> Path:
        (folder / name).write_text(text(address))
        return folder / name

    return make


def beside(ending: str, text: Callable[[str], str]) -> Form:
    """Returns a form that is a sound DEM with a file beside it."""

    def make(folder: Path, address: str) -> Path:
        shutil.copyfile(PRAIRIE, folder / "dem.tif")
        (folder / ("dem.tif" + ending)).write_text(text(address))
        return folder / "dem.tif"

    return make


def nested(folder: Path, address: str) -> Path:
    """A VRT of a VRT of a file on a server."""
    (folder / "inner.vrt").write_text(vrt(f"/vsicurl/http://{address}/a.tif"))
    (folder / "dem.vrt").write_text(vrt("inner.vrt", relative=1))
    return folder / "dem.vrt"


def mosaic_of_map(folder: Path, address: str) -> Path:
    """A VRT of a description of a map on a server."""
    (folder / "map.tif").write_text(wms(address))
    (folder / "dem.vrt").write_text(vrt("map.tif", relative=1))
    return folder / "dem.vrt"


def overview(address: str) -> str:
    """Returns metadata that say that the overviews are on a server."""
    return f"""<PAMDataset><Metadata domain="OVERVIEWS">
<MDI key="OVERVIEW_FILE">/vsicurl/http://{address}/a.tif</MDI></Metadata></PAMDataset>"""


def scene(folder: Path, dem: str | Path, reproject_to: str) -> Path:
    """Writes a scene that reprojects the DEM."""
    path = folder / "scene.yaml"
    path.write_text(
        f"groundray: 1\nseed: 1\nduration_s: 0.1\nterrain:\n  dem: {dem}\n"
        f"  reproject_to: {reproject_to}\nplatform:\n  drive:\n    speed_m_s: 1\n    height_m: 1\n"
        "    waypoints_m: [[429400, 5150650], [429420, 5150664]]\n"
        "lidars:\n  - {name: a, preset: velodyne_vlp16, mount: {translation_m: [0, 0, 1]}}\n"
    )
    return path


def geolocated(folder: Path, address: str) -> Path:
    """A scene whose DEM has its coordinates on a server."""
    place = f"""<SRS>EPSG:4326</SRS><Metadata domain="GEOLOCATION">
<MDI key="X_DATASET">/vsicurl/http://{address}/x.tif</MDI><MDI key="X_BAND">1</MDI>
<MDI key="Y_DATASET">/vsicurl/http://{address}/y.tif</MDI><MDI key="Y_BAND">1</MDI>
<MDI key="PIXEL_OFFSET">0</MDI><MDI key="LINE_OFFSET">0</MDI><MDI key="PIXEL_STEP">1</MDI>
<MDI key="LINE_STEP">1</MDI></Metadata>"""
    text = vrt(str(PRAIRIE), more=place).replace(
        "<GeoTransform>0, 1, 0, 8, 0, -1</GeoTransform>", ""
    )
    (folder / "dem.vrt").write_text(text)
    return scene(folder, folder / "dem.vrt", "utm")


FORMS: dict[str, Form] = {
    "curl": lambda _, at: f"/vsicurl/http://{at}/a.tif",
    "curl with options": lambda _, at: f"/vsicurl?url=http://{at}/a.tif",
    "streamed": lambda _, at: f"/vsicurl_streaming/http://{at}/a.tif",
    "S3": lambda _, at: "/vsis3/bucket/a.tif",
    "archive": lambda _, at: f"/vsizip/vsicurl/http://{at}/a.zip/a.tif",
    "archive in braces": lambda _, at: f"/vsizip/{{/vsicurl/http://{at}/a.zip}}/a.tif",
    "URL": lambda _, at: f"http://{at}/a.tif",
    "database": lambda _, at: "PG:host={} port={} dbname=a".format(*at.split(":")),
    "coverage": lambda _, at: f"WCS:http://{at}/wcs?version=1.0.0&coverage=a",
    "map": lambda _, at: f"WMS:http://{at}/wms?SERVICE=WMS&REQUEST=GetCapabilities",
    "map tiles": lambda _, at: f"WMTS:http://{at}/a.xml",
    "map as name": lambda _, at: wms(at),
    "VRT as name": lambda _, at: vrt(f"/vsicurl/http://{at}/a.tif"),
    "map in file": file_of(wms),
    "VRT": file_of(lambda at: vrt(f"/vsicurl/http://{at}/a.tif")),
    "relative VRT": file_of(lambda at: vrt(f"/vsicurl/http://{at}/a.tif", relative=1)),
    "VRT of database": file_of(
        lambda at: vrt("PG:host={} port={} dbname=a".format(*at.split(":")))
    ),
    "VRT of URL": file_of(lambda at: vrt(f"http://{at}/a.tif")),
    "VRT with CRS": file_of(lambda at: vrt(str(PRAIRIE), more=f"<SRS>http://{at}/a.wkt</SRS>")),
    "nested VRT": nested,
    "VRT of map": mosaic_of_map,
    "overview file": beside(".aux.xml", overview),
    "overviews": beside(".ovr", wms),
    "mask": beside(".msk", wms),
    "mask by VRT": beside(".msk", lambda at: vrt(f"/vsicurl/http://{at}/a.tif")),
    "CRS": lambda folder, at: scene(folder, PRAIRIE, f"http://{at}/a.wkt"),
    "positions": geolocated,
}


# GDAL itself does not follow these, or gdalinfo does not.
UNREACHED = ("VRT with CRS", "mask", "mask by VRT", "CRS", "positions")
# What is said of a scene, which shows that its DEM was opened.
IN_SCENES = {"CRS": ("key 'dem'", "a.wkt"), "positions": ("key 'waypoints_m'", "the DEM covers")}


@pytest.mark.parametrize("form", FORMS)
def test_no_raster_reaches_the_network(form: str, tmp_path: Path, listener: Listener) -> None:
    """No form of DEM, nor a file beside one, makes the program connect to a server."""
    name = FORMS[form](tmp_path, listener.address)
    environment = {
        "PATH": "/usr/bin:/bin",
        "AWS_NO_SIGN_REQUEST": "YES",
        "AWS_S3_ENDPOINT": listener.address,
        "AWS_HTTPS": "NO",
        "AWS_VIRTUAL_HOSTING": "NO",
        "GDAL_VRT_ENABLE_PYTHON": "YES",
        "HOME": str(tmp_path),
    }
    result = subprocess.run(
        [PROGRAM, "info", str(name)],
        capture_output=True,
        text=True,
        env=environment,
        timeout=LOCAL_TIMEOUT_S,
    )
    assert listener.count == 0
    assert result.returncode in (0, 1), result.stderr
    for word in IN_SCENES.get(form, ()):
        assert word in result.stderr
    if form in UNREACHED:
        return
    subprocess.run(
        ["gdalinfo", "-checksum", str(name)],
        capture_output=True,
        env=environment,
        timeout=LOCAL_TIMEOUT_S,
    )
    assert listener.count > 0


@pytest.mark.parametrize("form", ["curl", "VRT", "VRT of map", "overviews", "overview file"])
def test_a_permitted_driver_opens_no_network(form: str, tmp_path: Path, listener: Listener) -> None:
    """Naming further drivers does not open the file systems of networks."""
    name = FORMS[form](tmp_path, listener.address)
    environment = {"PATH": "/usr/bin:/bin", "GROUNDRAY_RASTER_DRIVERS": "netCDF"}
    subprocess.run(
        [PROGRAM, "info", str(name)], capture_output=True, env=environment, timeout=LOCAL_TIMEOUT_S
    )
    assert listener.count == 0


# Files that GDAL looks for beside a raster.
BESIDE = (
    *("dem.tif.aux.xml", "dem.tif.ovr", "dem.tif.msk", "dem.imd", "dem.IMD", "dem.RPB", "dem.aux"),
    *("dem_rpc.txt", "dem_RPC.TXT", "dem.tfw", "dem.wld", "dem.prj", "METADATA.DIM"),
)


@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to("/dev/zero")])
@pytest.mark.parametrize("dem", ["dem.tif", "dem.asc"])
def test_pipes_and_devices_beside_a_raster_are_ignored(dem: str, make: Callable, tmp_path: Path):
    """Neither waits for a writer nor reads without end."""
    form = "GTiff" if dem == "dem.tif" else "AAIGrid"
    subprocess.run(["gdal_translate", "-q", "-of", form, PRAIRIE, tmp_path / dem], check=True)
    alone = groundray("info", tmp_path / dem)
    for name in BESIDE:
        path = tmp_path / name.replace("dem.tif", dem)
        path.unlink(missing_ok=True)
        make(path)
        result = groundray("info", tmp_path / dem, timeout=LOCAL_TIMEOUT_S)
        path.unlink()
        assert result.returncode == 0, (name, result.stderr)
        if dem == "dem.tif":
            assert result.stdout == alone.stdout, name


def test_a_raster_refers_to_no_file_of_another_folder(tmp_path: Path) -> None:
    """Erdas Imagine keeps large rasters in a second file, which may be named anywhere."""
    (tmp_path / "inner").mkdir()
    dem = tmp_path / "inner/dem.img"
    subprocess.run(
        ["gdal_translate", "-q", "-of", "HFA", "-co", "USE_SPILL=YES", PRAIRIE, dem], check=True
    )
    assert groundray("info", dem).returncode == 0
    dem.write_bytes(dem.read_bytes().replace(b"dem.ige", b"../m.ig"))
    (tmp_path / "inner/dem.ige").rename(tmp_path / "m.ig")
    refused(dem, "it refers to ", "not in its folder")


@pytest.mark.parametrize("driver", ["VRT", "MEM", "COG"])
def test_needed_drivers_are_there_whatever_gdal_skips(driver: str) -> None:
    """GDAL's setting for its own programs is not groundray's."""
    environment = {**os.environ, "GDAL_SKIP": driver}
    assert groundray("info", PRAIRIE, env=environment).returncode == 0


def test_no_file_is_written_beside_an_archive(tmp_path: Path) -> None:
    """GDAL would write the size of what is packed, and through links."""
    packed, victim = tmp_path / "dem.tif.gz", tmp_path / "victim"
    packed.write_bytes(gzip.compress(PRAIRIE.read_bytes()))
    victim.write_text("precious")
    for place in (tmp_path / "elsewhere", victim):
        (tmp_path / "dem.tif.gz.properties").symlink_to(place)
        assert groundray("info", f"/vsigzip/{packed}").returncode == 0
        (tmp_path / "dem.tif.gz.properties").unlink()
    assert victim.read_text() == "precious"
    assert sorted(os.listdir(tmp_path)) == ["dem.tif.gz", "victim"]


@pytest.mark.parametrize(("form", "name"), [("ENVI", "dem.img"), ("EHdr", "dem.bil")])
def test_a_cut_raw_raster_is_refused(form: str, name: str, tmp_path: Path) -> None:
    """GDAL takes what it lacks for heights of 0."""
    path = tmp_path / name
    subprocess.run(["gdal_translate", "-q", "-of", form, PRAIRIE, path], check=True)
    assert groundray("info", path).returncode == 0
    os.truncate(path, path.stat().st_size - 1)
    refused(path, "is it complete?")


def test_files_that_crashed_libraries_are_refused(tmp_path: Path) -> None:
    """A netCDF file of 20 bytes, which crashes libnetcdf, is refused under any name."""
    for name in ("dem.tif", "dem.nc"):
        (tmp_path / name).write_bytes(b"CDF\1\0\0\0\0\0\0\0\12\42\0\0\0\2")
        refused(tmp_path / name, "it is in none of the formats GTiff, VRT, ", "gdal_translate ")


def test_raw_bytes_do_not_become_heights(tmp_path: Path) -> None:
    """A VRT that reads any file as raw samples is refused, as a DEM and as the mask of one."""
    (tmp_path / "secret.txt").write_text("0123456789" * 100)
    raw = """<VRTDataset rasterXSize="8" rasterYSize="8"><VRTRasterBand dataType="Byte" band="1"
subClass="VRTRawRasterBand"><SourceFilename relativeToVRT="1">secret.txt</SourceFilename>
<ImageOffset>0</ImageOffset><PixelOffset>1</PixelOffset><LineOffset>8</LineOffset>
</VRTRasterBand></VRTDataset>"""
    (tmp_path / "dem.tif").write_text(raw)
    refused(
        tmp_path / "dem.tif", "has a VRTRawRasterBand; only mosaics and warps of files are read"
    )
    dem = tmp_path / "masked.tif"
    subprocess.run(["gdal_translate", "-q", "-outsize", "8", "8", PRAIRIE, dem], check=True)
    (tmp_path / "masked.tif.msk").write_text(raw)
    result = groundray("info", dem)
    assert "holes     0 samples" in result.stdout, result


def test_filtered_sources_are_refused(tmp_path: Path) -> None:
    """A kernel of any size would take any time."""
    source = vrt(str(PRAIRIE)).replace("SimpleSource", "KernelFilteredSource")
    (tmp_path / "dem.vrt").write_text(source)
    refused(tmp_path / "dem.vrt", "has a KernelFilteredSource; only mosaics and warps of files")


def test_a_raster_beyond_the_memory_is_refused(tmp_path: Path) -> None:
    """A file of 200 bytes that declares 8 GiB of heights is refused before they are allocated."""
    path = tmp_path / "dem.vrt"
    path.write_text(
        '<VRTDataset rasterXSize="46000" rasterYSize="46000">'
        '<VRTRasterBand dataType="Float32" band="1"/></VRTDataset>'
    )

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))

    result = groundray("terrain", "fill", path, "-o", tmp_path / "out.tif", preexec_fn=limit)
    assert result.returncode == 1
    assert "46000 x 46000 samples take 7.9 GiB of memory, but " in result.stderr
    assert "gdal_translate -srcwin" in result.stderr


def refused(path: Path, *words: str) -> None:
    """Asserts that the program rejects the raster with a message that contains the words."""
    result = groundray("info", path)
    assert result.returncode == 1, result
    for word in words:
        assert word in result.stderr
