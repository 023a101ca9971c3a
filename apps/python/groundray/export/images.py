"""Images of cameras: pictures as files, and depths from the truth."""

from __future__ import annotations

import io
import os
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundray.dataset import Camera, Dataset, Error, Frame
from groundray.export.sensor_path import Floats
from groundray.file_content import read_listed

_GREY, _COLOUR = 0, 2  # colour types of PNG


class Picture(NamedTuple):
    """A picture and the data of its PNG file."""

    file: Path
    data: bytes
    bits: int
    is_colour: bool


def has_pictures(dataset: Dataset, camera: Camera) -> bool:
    """Returns whether any image of the camera has a picture; then all must have one."""
    return any(dataset.image_file(camera, frame, ".png").is_file() for frame in camera.frames)


def has_depths(dataset: Dataset, camera: Camera) -> bool:
    """Returns whether any image of the camera has depths; then all must have them."""
    files = (dataset.image_file(camera, frame, ".exr") for frame in camera.frames)
    first = next((file for file in files if file.is_file()), None)
    return first is not None and "Z" in read_channels(first, only_names=True)


def pinhole_of(dataset: Dataset, camera: Camera, form: str, otherwise: str) -> Floats:
    """Returns K of a camera with pictures: 3 x 3, px.

    Raises Error, with `otherwise` added to the remedy, if it has none or is not a pinhole.
    """
    if camera.frames and not has_pictures(dataset, camera):
        rule = f"camera {camera.name} has no pictures"
        raise Error(f"{dataset.folder}: {rule}; add picture to its products{otherwise}")
    if camera.pinhole_matrix is None:
        rule = f"camera {camera.name} has the lens {camera.lens_model}, but {form} needs pinholes"
        fix = "use a pinhole, or set images: rectified for its pair"
        raise Error(f"{dataset.folder}: {rule}; {fix}{otherwise}")
    return camera.pinhole_matrix


def read_picture(dataset: Dataset, camera: Camera, frame: Frame) -> Picture:
    """Reads a picture. Raises Error if it is missing, truncated or of another size."""
    return picture_in(dataset.image_file(camera, frame, ".png"), camera.size_px)


def picture_in(file: Path, size_px: tuple[int, int]) -> Picture:
    """Reads the picture in a file of this width and height. Raises Error as read_picture does."""
    data = read_listed(file, "the image")
    # Signature, then the chunk IHDR; the last one is IEND, which is empty.
    if data[:8] != b"\x89PNG\r\n\x1a\n" or data[12:16] != b"IHDR" or data[-8:-4] != b"IEND":
        raise Error(f"{file}: it is not a complete PNG file: it is damaged; generate it again")
    width, height, bits, colours = struct.unpack(">IIBB", data[16:26])
    if (width, height) != size_px or bits not in (8, 16) or colours not in (_GREY, _COLOUR):
        rule = f"must have {size_px[0]} x {size_px[1]} pixels, grey or RGB"
        raise Error(f"{file}: it {rule}, as its calibration states; is it from another camera?")
    return Picture(file, data, bits, colours == _COLOUR)


def pixels_of(picture: Picture) -> NDArray[Any]:
    """Returns height x width (x 3: red, green, blue), of 8 or 16 bits."""
    import cv2

    with _quiet_library():
        pixels = cv2.imdecode(np.frombuffer(picture.data, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise Error(f"{picture.file}: its pixels cannot be read: it is damaged; generate it again")
    return np.ascontiguousarray(pixels[..., ::-1]) if picture.is_colour else pixels


def png_of(pixels: NDArray[np.uint16]) -> bytes:
    """Returns a grey image of 16 bits as a PNG file."""
    import cv2

    return bytes(cv2.imencode(".png", pixels)[1])


def read_depths_m(dataset: Dataset, camera: Camera, frame: Frame) -> NDArray[np.float32]:
    """Reads the depths Z along the optical axis: height x width; infinite for sky."""
    file = dataset.image_file(camera, frame, ".exr")
    channels = read_channels(file)
    if "Z" not in channels:
        raise Error(f"{file}: it has no depths; add truth to the camera's products")
    depths_m = np.asarray(channels["Z"], dtype=np.float32)
    if depths_m.shape != camera.size_px[::-1]:
        rule = f"must have {camera.size_px[0]} x {camera.size_px[1]} pixels"
        raise Error(f"{file}: it {rule}, as its calibration states; is it from another camera?")
    return depths_m


def read_labels(
    dataset: Dataset, camera: Camera, frame: Frame
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Reads the labels and the instances of the pixels: height x width each."""
    file = dataset.image_file(camera, frame, ".exr")
    channels = read_channels(file)
    read = []
    for channel in ("Label", "Instance"):
        values = channels.get(channel)
        if values is None or values.shape != camera.size_px[::-1]:
            rule = f"must have a channel {channel} of the size that its calibration states"
            raise Error(
                f"{file}: it {rule}: add truth to its products; or is it from another camera?"
            )
        read.append(np.asarray(values, dtype=np.uint32))
    return read[0], read[1]


@contextmanager
def _quiet_library() -> Iterator[io.StringIO]:
    """Captures standard output, and discards what the library's C code prints to stderr."""
    sys.stderr.flush()
    saved, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        with redirect_stdout(io.StringIO()) as printed:
            yield printed
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(nowhere)


def read_channels(file: Path, *, only_names: bool = False) -> dict[str, Any]:
    """Reads the channels of an EXR file, or only their names. Raises Error if it is damaged."""
    import OpenEXR

    if not file.is_file():
        rule = "it does not exist, although dataset.yaml lists the image as done"
        raise Error(f"{file}: {rule}; was it removed?")
    try:
        # The library reports damaged pixels only by printing.
        with (
            _quiet_library() as printed,
            OpenEXR.File(str(file), separate_channels=True, header_only=only_names) as image,
        ):
            if only_names:
                return {each.name: None for each in image.header()["channels"]}
            channels = {name: each.pixels for name, each in image.channels().items()}
            if printed.getvalue():
                raise ValueError(printed.getvalue().strip())
            return channels
    except Exception as fault:  # whatever the library raises for a damaged file
        raise Error(f"{file}: cannot read it: {fault}: it is damaged; generate it again") from None
