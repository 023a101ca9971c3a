"""Makes the images of these inputs anew: an environment, a height map, a colour map and a bump map.

Everything is a closed form, so that the files hold nothing of anybody else's. Needs numpy, openexr
and opencv-python-headless (test/requirements.txt).
"""

from pathlib import Path

import cv2
import numpy as np
import OpenEXR

HERE = Path(__file__).parent


def environment() -> None:
    """A dusk: bright warm light low in the south-west, blue above, dark ground; 64 x 32."""
    y, x = np.mgrid[0:32, 0:64]
    azimuth = 2 * np.pi * ((x + 0.5) / 64 - 0.5)
    elevation = np.pi * (0.5 - (y + 0.5) / 32)
    up = np.clip(np.sin(elevation), 0, 1)
    glow = np.exp(-((azimuth - 2.2) ** 2) / 0.1 - (elevation - 0.35) ** 2 / 0.05)
    sky = elevation > 0
    image = np.stack(
        [
            sky * (1 + 60 * glow),
            sky * (1.2 + 0.3 * up + 40 * glow),
            sky * (1.5 + up + 15 * glow),
        ],
        axis=-1,
    )
    image += ~sky[..., None] * np.array([0.2, 0.15, 0.1])
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": image.astype(np.float32)}).write(str(HERE / "environment.exr"))


def maps() -> None:
    """Waves that repeat at the border: heights of 16 bits, colours, and normals of other waves."""
    y, x = np.mgrid[0:64, 0:64] * 2 * np.pi / 64
    heights = 0.5 + 0.3 * np.sin(x) * np.cos(2 * y) + 0.15 * np.cos(3 * x + y)
    cv2.imwrite(str(HERE / "waves.png"), np.round(heights * 65535).astype(np.uint16))
    colours = [0.5 + 0.4 * np.sin(k * x + y) for k in (1, 2, 3)]
    cv2.imwrite(str(HERE / "colours.png"), np.round(np.stack(colours, -1) * 255).astype(np.uint8))
    slope = np.stack([0.5 * np.sin(3 * x), 0.5 * np.cos(2 * y), np.ones_like(x)], -1)
    normals = slope / np.linalg.norm(slope, axis=-1, keepdims=True)
    pixels = np.round((normals * 0.5 + 0.5) * 255).astype(np.uint8)
    cv2.imwrite(str(HERE / "normals.png"), cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR))


if __name__ == "__main__":
    environment()
    maps()
