"""Denoised pictures: radiance of cameras after Open Image Denoise. They are not ground truth."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from groundray import _core
from groundray.dataset import Camera, Dataset, Error, Frame
from groundray.export.images import read_channels
from groundray.export.notes import Notes
from groundray.file_content import read_listed

SUFFIX = "_denoised_not_truth"
"""End of the names of all files, before the extension."""
_WARNING = "yes: biased, not ground truth; for viewing only"
_RADIANCE, _ALBEDO, _NORMAL = ("RGB", [f"Albedo.{c}" for c in "RGB"], [f"Ns.{c}" for c in "XYZ"])

Picture = NDArray[np.float32]


def denoise(
    radiance: ArrayLike, albedo: ArrayLike | None = None, normal: ArrayLike | None = None
) -> Picture:
    """Returns linear RGB with less noise, by the filter RT of Open Image Denoise (package pyoidn).

    All arrays are height x width x 3. The result is biased: it is for viewing, not a reference.
    Negative radiance becomes 0. Albedo and normals, if given, are those of the same pixels; values
    that are not finite count as 0, as for sky. Equal arrays give equal results on one type of CPU.

    Raises Error if shapes differ, radiance is not finite, normals are given without albedo (which
    the filter does not support), or the filter fails.
    """
    import pyoidn

    colour = np.ascontiguousarray(radiance, dtype=np.float32)
    if colour.ndim != 3 or colour.shape[2] != 3 or colour.size == 0:
        raise Error(f"denoise: radiance must be height x width x 3, but is {colour.shape}")
    if not np.all(np.isfinite(colour)):
        raise Error("denoise: radiance must be finite; fill or leave out the other pixels first")
    if normal is not None and albedo is None:
        raise Error("denoise: normals need the albedo of the same pixels; give both or neither")
    extra: dict[str, Picture] = {}
    for name, given, least in (("albedo", albedo, 0), ("normal", normal, -1)):
        if given is None:
            continue
        values = np.asarray(given, dtype=np.float32)
        if values.shape != colour.shape:
            rule = f"{name} must be {colour.shape} like radiance, but is {values.shape}"
            raise Error(f"denoise: {rule}")
        extra[name] = np.clip(np.where(np.isfinite(values), values, 0), least, 1)
    try:
        smooth: Picture = pyoidn.denoise(np.maximum(colour, 0), **extra, hdr=True, quality="high")
    except RuntimeError as fault:
        raise Error(f"denoise: Open Image Denoise failed: {fault}") from None
    return smooth


def write_denoised(dataset: Dataset, cameras: Sequence[Camera], out: Path, notes: Notes) -> str:
    """Writes a PNG and an EXR file of each image that has radiance. Raises Error if none has."""
    count = 0
    for camera in cameras:
        files = [dataset.image_file(camera, frame, ".exr") for frame in camera.frames]
        if not any(
            file.is_file() and _has(read_channels(file, only_names=True), _RADIANCE)
            for file in files[:1]
        ):
            notes.tell(f"camera {camera.name} has no radiance (product radiance): it is left out")
            continue
        folder = out / "camera" / camera.name
        folder.mkdir(parents=True)
        for frame in camera.frames:
            _write_image(dataset, camera, frame, folder, notes)
        count += len(camera.frames)
    if count == 0:
        rule = "none of its cameras has images with radiance"
        raise Error(f"{dataset.folder}: {rule}; add radiance to the products of a camera")
    notes.tell("denoised pictures are biased: they are for viewing, not for measuring or training")
    return f"{count} denoised images"


def _has(channels: dict[str, Any], names: Sequence[str]) -> bool:
    return all(name in channels for name in names)


def _write_image(
    dataset: Dataset, camera: Camera, frame: Frame, folder: Path, notes: Notes
) -> None:
    file = dataset.image_file(camera, frame, ".exr")
    channels = read_channels(file)
    size_px = camera.size_px

    def stacked(names: Sequence[str]) -> Picture | None:
        if not _has(channels, names):
            return None
        planes = np.stack([np.asarray(channels[name], np.float32) for name in names], axis=-1)
        if planes.shape[1::-1] != size_px:
            rule = f"must have {size_px[0]} x {size_px[1]} pixels, as its calibration states"
            raise Error(f"{file}: it {rule}; is it from another camera?")
        return planes

    radiance = stacked(_RADIANCE)
    if radiance is None:
        raise Error(
            f"{file}: it has no radiance, unlike other images of the camera; was it edited?"
        )
    if not np.all(np.isfinite(radiance)):
        raise Error(f"{file}: its radiance is not finite: it is damaged; generate it again")
    albedo, normal = stacked(_ALBEDO), stacked(_NORMAL)
    has_truth = albedo is not None and normal is not None
    if not has_truth:
        sentence = f"camera {camera.name} has no normals and albedo (product truth): denoised"
        notes.tell(f"{sentence} from its radiance alone")
    smooth = denoise(radiance, albedo, normal) if has_truth else denoise(radiance)
    if "Samples" in channels:  # 0 outside of the lens's image
        smooth[np.asarray(channels["Samples"]) == 0] = 0
    stem = folder / f"{frame.number:06}{SUFFIX}"
    _core.write_rgb_exr(stem.with_suffix(".exr"), smooth, _attributes(dataset, file, has_truth))
    _core.write_radiance_png(stem.with_suffix(".png"), smooth, radiance)


def _attributes(dataset: Dataset, file: Path, has_truth: bool) -> dict[str, str]:
    import pyoidn

    library = f"Open Image Denoise {pyoidn.version.oidn_version}, pyoidn {version('pyoidn')}"
    inputs = "radiance, Albedo, Ns" if has_truth else "radiance"
    return {
        "denoised": _WARNING,
        "denoiser": f"{library}: filter RT, HDR; {inputs}",
        "denoisedFrom": file.relative_to(dataset.folder).as_posix(),
        "denoisedFromSha256": hashlib.sha256(read_listed(file, "the image")).hexdigest(),
        "radianceUnit": "W/(m^2 sr), 683 lm/W",
    }
