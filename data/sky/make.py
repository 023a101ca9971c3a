#!/usr/bin/env python3
"""Makes the tables of this folder from published ones.

    pip install mitsuba==3.9.1 pvlib==0.16.1
    python3 make.py

The tables are C++ array contents, compiled into sensors/sky/sky.cpp and
sensors/sky/sun.cpp. They depend on those two packages alone.
"""

import hashlib
import importlib.util
import struct
from pathlib import Path

import mitsuba
import numpy as np
from pvlib.spectrum.spectrl2 import _SPECTRL2_COEFFS

HERE = Path(__file__).resolve().parent
# Of mitsuba/data/sunsky/sunsky_datasets.bin:
DATASETS_SHA256 = "f110fa54ebcaf5f764da3a20bb4aafeeffd28111fcd0986f50a2489c12b294c7"

# IEC 61966-2-1: from CIE XYZ to linear sRGB.
RGB_FROM_XYZ = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)


def read_datasets() -> dict[str, np.ndarray]:
    """Returns the arrays of Mitsuba's file of the Hosek-Wilkie model's coefficients."""
    root = Path(importlib.util.find_spec("mitsuba").origin).parent
    data = (root / "data/sunsky/sunsky_datasets.bin").read_bytes()
    assert hashlib.sha256(data).hexdigest() == DATASETS_SHA256
    (count,) = struct.unpack_from("<I", data, 14)
    place, arrays = 18, {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", data, place)
        name = data[place + 2 : place + 2 + length].decode()
        dimensions, _, begin = struct.unpack_from("<HBQ", data, place + 2 + length)
        place += 13 + length
        shape = struct.unpack_from(f"<{dimensions}Q", data, place)
        place += 8 * dimensions
        arrays[name] = np.frombuffer(data, "<f8", int(np.prod(shape)), begin).reshape(shape)
    return arrays


def color_matching(wavelengths_nm: np.ndarray) -> np.ndarray:
    """Returns the CIE 1931 colour matching functions of linear sRGB, a row for each wavelength."""
    mitsuba.set_variant("scalar_rgb")
    xyz = np.array([list(mitsuba.cie1931_xyz(float(w))) for w in wavelengths_nm])
    return xyz @ RGB_FROM_XYZ.T


def row(values: np.ndarray, form: str) -> str:
    return ", ".join(format(v, form) for v in values) + ",\n"


def write_hosek_wilkie(arrays: dict[str, np.ndarray]) -> None:
    """Writes nine parameters and the mean radiance for each turbidity, albedo, node and channel."""
    table = np.concatenate(
        [arrays["sky_params_rgb"], arrays["sky_rad_rgb"][..., np.newaxis]], axis=-1
    )
    text = """\
// The Hosek-Wilkie sky model's coefficients for linear sRGB: for turbidities 1 to 10, ground
// albedos 0 and 1, six nodes of the sun's elevation and three channels, a row of the parameters
// A to I and the mean radiance in W/(m^2 sr). Copyright (c) 2012 - 2013, Lukas Hosek and Alexander
// Wilkie; BSD licence, data/LICENSES/hosek_wilkie.txt. Made by data/sky/make.py: do not edit.
"""
    text += "".join(row(values, ".7g") for values in table.reshape(-1, 10))
    (HERE / "hosek_wilkie_rgb.inc").write_text(text)


def rgb_weights(nodes_nm: np.ndarray) -> np.ndarray:
    """Returns the weights that turn a spectrum linear between the nodes into linear sRGB, nm."""
    fine_nm = np.arange(360, 830.01, 0.5)
    matching = color_matching(fine_nm)
    weights = np.empty((len(nodes_nm), 3))
    for k in range(len(nodes_nm)):
        hat = np.interp(fine_nm, nodes_nm, np.eye(len(nodes_nm))[k])
        weights[k] = 0.5 * (hat[:, np.newaxis] * matching).sum(axis=0)
    return weights


def write_solar_spectrum(arrays: dict[str, np.ndarray]) -> None:
    table = _SPECTRL2_COEFFS
    weights = rgb_weights(table["wavelength"])
    text = """\
// The sun's spectrum above the air and the air's absorption, Bird and Riordan, Simple solar
// spectral model for direct and diffuse irradiance on horizontal and tilted planes at the earth's
// surface for cloudless atmospheres, SERI/TR-215-2436 (1984), as in the package pvlib 0.16.1 (BSD
// licence, data/LICENSES/pvlib.txt): wavelength in nm, irradiance at 1 au in W/(m^2 nm), absorption
// coefficients of water vapour (1/cm), ozone (1/cm) and uniformly mixed gases; then weights in nm
// that sum a spectrum linear between the rows up to linear sRGB, by the CIE 1931 colour matching
// functions. Made by data/sky/make.py: do not edit.
"""
    for k in range(len(table)):
        text += "{" + ", ".join(format(v, "g") for v in table[k])
        text += ", {" + ", ".join(format(v, ".7g") for v in weights[k]) + "}},\n"
    (HERE / "solar_spectrum.inc").write_text(text)
    # The limb's darkening in sRGB: each wavelength's polynomial, weighed by what the sun sends.
    nodes_nm = np.arange(320, 721, 40)
    fine_nm = np.arange(360, 720.01, 1)
    sun = np.interp(fine_nm, table["wavelength"], table["spectral_irradiance_et"])
    coefficients = np.array(
        [np.interp(fine_nm, nodes_nm, arrays["sun_ld_spec"][:, j]) for j in range(6)]
    )
    matching = color_matching(fine_nm)
    darkening = (coefficients * sun) @ matching / (sun @ matching)
    text = """\
// The darkening of the sun's limb in linear sRGB: for each channel the coefficients of a polynomial
// in the cosine of the angle between ray and the sun's surface, from the power 0 to 5. Neckel and
// Labs, Solar limb darkening 1986-1990, Solar Physics 153 (1994), as in the Hosek-Wilkie model
// (BSD licence, data/LICENSES/hosek_wilkie.txt), each wavelength weighed by the sun's spectrum and
// the CIE 1931 colour matching functions. Made by data/sky/make.py: do not edit.
"""
    text += "".join("{" + row(values, ".6g")[:-2] + "},\n" for values in darkening.T)
    (HERE / "limb_darkening.inc").write_text(text)


if __name__ == "__main__":
    ARRAYS = read_datasets()
    write_hosek_wilkie(ARRAYS)
    write_solar_spectrum(ARRAYS)
