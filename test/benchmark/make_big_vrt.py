"""Tiles copies of a raster into one virtual raster, for a DEM larger than memory.

For the DEM of 65,536 x 65,536 samples in docs/accuracy.md:

    gdalwarp -t_srs '+proj=tmerc +lat_0=30 +lon_0=16 +R=1737400 +units=m +no_defs' \
        -te -400000 -400000 400000 400000 -ts 8192 8192 -r bilinear -ot Int16 \
        -co TILED=YES -co COMPRESS=DEFLATE -co PREDICTOR=2 moon_gld100_8193.tif moon_metric.tif
    python3 make_big_vrt.py moon_metric.tif 8 moon_65536.vrt
"""

import json
import subprocess
import sys
from pathlib import Path
from xml.sax.saxutils import escape


def main() -> None:
    raster, copies, output = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    info = json.loads(subprocess.check_output(["gdalinfo", "-json", raster]))
    columns, rows = info["size"]
    band = info["bands"][0]
    nodata = f"<NoDataValue>{band['noDataValue']}</NoDataValue>" if "noDataValue" in band else ""
    block = band["block"]
    source = Path(raster).absolute()
    tiles = "".join(
        f'<SimpleSource><SourceFilename relativeToVRT="0">{escape(str(source))}</SourceFilename>'
        f"<SourceBand>1</SourceBand>"
        f'<SourceProperties RasterXSize="{columns}" RasterYSize="{rows}"'
        f' DataType="{band["type"]}" BlockXSize="{block[0]}" BlockYSize="{block[1]}"/>'
        f'<SrcRect xOff="0" yOff="0" xSize="{columns}" ySize="{rows}"/>'
        f'<DstRect xOff="{i * columns}" yOff="{j * rows}" xSize="{columns}" ySize="{rows}"/>'
        f"</SimpleSource>\n"
        for j in range(copies)
        for i in range(copies)
    )
    transform = ", ".join(repr(number) for number in info["geoTransform"])
    output.write_text(
        f'<VRTDataset rasterXSize="{copies * columns}" rasterYSize="{copies * rows}">\n'
        f"<SRS>{escape(info['coordinateSystem']['wkt'])}</SRS>\n"
        f"<GeoTransform>{transform}</GeoTransform>\n"
        f'<VRTRasterBand dataType="{band["type"]}" band="1">{nodata}\n{tiles}'
        f"</VRTRasterBand>\n</VRTDataset>\n"
    )


if __name__ == "__main__":
    main()
