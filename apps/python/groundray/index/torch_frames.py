"""Frames of an index as tensors; importing this module needs PyTorch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch.utils.data

if TYPE_CHECKING:
    from groundray.index.loader import Frames

# PyTorch has no unsigned numbers of 16 to 64 bits that its functions accept.
_SIGNED = {"uint16": np.int32, "uint32": np.int64, "uint64": np.int64}


class TorchFrames(torch.utils.data.Dataset):  # type: ignore[misc, type-arg, unused-ignore]
    """Dataset of tensors for a `torch.utils.data.DataLoader`, also with several workers."""

    def __init__(self, frames: Frames) -> None:
        """Keeps the frames."""
        self.frames = frames

    def __len__(self) -> int:
        """Returns the number of frames."""
        return len(self.frames)

    def __getitem__(self, i: int) -> Any:
        """Reads frame i; arrays in dicts, lists and tuples become tensors."""
        return to_tensors(self.frames[i])


def to_tensors(value: Any) -> Any:
    """Returns a value with tensors for its arrays: uint16 as int32, uint32 and uint64 as int64."""
    if isinstance(value, dict):
        return {key: to_tensors(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(to_tensors(each) for each in value)
    if not isinstance(value, np.ndarray):
        return value
    array = value.astype(_SIGNED.get(value.dtype.name, value.dtype), copy=not value.flags.writeable)
    return torch.from_numpy(np.ascontiguousarray(array))
