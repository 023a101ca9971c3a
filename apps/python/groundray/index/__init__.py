"""Index of datasets, its splits, and a loader for training; see docs/reference/dataset_index.md."""

from groundray.index.loader import Frames

__all__ = ["Frames"]
