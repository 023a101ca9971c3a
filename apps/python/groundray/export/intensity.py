"""Intensities on the scales of other formats."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Error, Lidar
from groundray.export.sensor_path import Floats

# Intensity that is exported as full scale: a white plane at normal incidence, or the largest 8-bit
# value.
_FULL_SCALES = {"cosine": 1.0, "reflectance": 1.0, "eight_bit": 255.0}


class FullScale:
    """Divisor of intensities: the user's choice, or the one that the sensor's scale implies."""

    def __init__(self, chosen: float | None) -> None:
        self.chosen = chosen

    def of(self, lidar: Lidar) -> float:
        """Returns the full scale. Raises Error for powers, which have none."""
        if self.chosen is not None:
            return self.chosen
        if lidar.intensity_scale not in _FULL_SCALES:
            rule = "its intensities are powers in watts, which have no full scale"
            raise Error(f"lidar {lidar.name}: {rule}; give one with --intensity-full-scale")
        return _FULL_SCALES[lidar.intensity_scale]

    def shares(self, lidar: Lidar, rows: NDArray[Any]) -> Floats:
        """Returns intensities as shares of full scale, not clipped."""
        return rows["intensity"].astype(float) / self.of(lidar)

    def whole(self, lidar: Lidar, rows: NDArray[Any], most: int) -> tuple[NDArray[np.int64], int]:
        """Returns intensities as whole numbers from 0 to `most`, and how many were clipped."""
        scaled = np.rint(self.shares(lidar, rows) * most)
        clipped = np.clip(np.nan_to_num(scaled, nan=0.0), 0, most)
        return clipped.astype(np.int64), int(np.count_nonzero(clipped != scaled))
