#!/usr/bin/env python3
"""Makes soil.png: the pattern of bare soil with small stones, for the ground of example scenes.

    pip install numpy opencv-python-headless
    python3 make.py

A generated texture needs no licence, unlike a photograph. The mean does not matter, because a
texture only modulates a material (docs/reference/textures.md). Grey values may differ with the
version of NumPy, and bytes with that of OpenCV; data/README.md names those that were used.
"""

from pathlib import Path

import cv2
import numpy as np

SIDE_PX, SIDE_M = 512, 4
STONES = 1200
STEPS = 64  # grey levels: fewer take less space


def clods(rng: np.random.Generator) -> np.ndarray:
    """Returns a periodic random field with an rms of 1, of wavelengths from 16 mm to 0.5 m."""
    waves = np.fft.fftfreq(SIDE_PX, SIDE_M / SIDE_PX)
    per_m = np.hypot(*np.meshgrid(waves, waves))
    with np.errstate(divide="ignore"):
        size = np.where((per_m > 2) & (per_m < 62.5), per_m**-0.9, 0)
    field = np.fft.ifft2(size * np.fft.fft2(rng.standard_normal(per_m.shape))).real
    return field / field.std()


def stones(rng: np.random.Generator) -> np.ndarray:
    """Returns the difference that stones of 1 to 10 cm make: lighter or darker than the soil."""
    difference = np.zeros((SIDE_PX, SIDE_PX))
    rows, columns = np.mgrid[:SIDE_PX, :SIDE_PX] * (SIDE_M / SIDE_PX)
    for _ in range(STONES):
        place = rng.uniform(0, SIDE_M, 2)
        radius_m = 0.005 * 10 ** rng.uniform() ** 2
        tone = rng.normal(0, 0.2)
        reach = int(np.ceil(radius_m * SIDE_PX / SIDE_M)) + 1
        middle = np.round(place * SIDE_PX / SIDE_M).astype(int)
        near = np.ix_(*((m + np.arange(-reach, reach + 1)) % SIDE_PX for m in middle))
        across = [
            np.abs((axis[near] - at + SIDE_M / 2) % SIDE_M - SIDE_M / 2)
            for axis, at in zip((rows, columns), place, strict=True)
        ]
        inside = np.clip((radius_m - np.hypot(*across)) * SIDE_PX / SIDE_M + 0.5, 0, 1)
        difference[near] += inside * (tone - difference[near])
    return difference


def main() -> None:
    rng = np.random.default_rng(27)
    light = np.clip(0.35 * (1 + 0.14 * clods(rng) + stones(rng)), 0.02, 1)
    srgb = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    grey = np.round(srgb * (STEPS - 1)) * (255 / (STEPS - 1))
    file = Path(__file__).with_name("soil.png")
    cv2.imwrite(str(file), grey.astype(np.uint8), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    print(f"{file}: contrast {light.std() / light.mean():.3f}, {file.stat().st_size} bytes")


if __name__ == "__main__":
    main()
