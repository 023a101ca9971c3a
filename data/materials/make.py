#!/usr/bin/env python3
"""Makes the material files of this folder from measured spectra.

    python3 make.py SPECTRA

SPECTRA is the folder of `earthlib` (earthlib_lidar_wavelengths.csv: the spectra of the package
earthlib 1.1.0 at wavelengths of lidars) and `ecostress_aster` (spectra of the ECOSTRESS library as
text files). The files' contents depend on those spectra alone.
"""

import csv
import hashlib
import statistics
import sys
from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent

EARTHLIB = "earthlib/earthlib_lidar_wavelengths.csv"
EARTHLIB_SHA256 = "42786250904e63330469e705b752aa6261a078213f24782342d57adc0d493b2c"
EARTHLIB_NM = [450, 550, 650, 850, 905, 940, 1064, 1550]
EARTHLIB_LIBRARY = (
    "earthlib 1.1.0 (https://pypi.org/project/earthlib/1.1.0/, MIT), its spectra linearly "
    "interpolated at eight wavelengths; between 1064 and 1550 nm the file knows nothing, so the "
    "water band near 1400 nm is not in it"
)

ECOSTRESS_NM = sorted([*range(400, 1701, 20), 532, 905, 1064, 1550])
ECOSTRESS_LIBRARY = (
    "ECOSTRESS spectral library, formerly ASTER (JPL, JHU, USGS; free to use, cite Baldridge et "
    "al. 2009 and Meerdink et al. 2019), from github.com/susanmeerdink/ASTER-Spectral-Library; "
    "linearly interpolated"
)
ROCKS = [
    "jhu.becknic.rock.igneous.intermediate.solid.andesi4",
    "rock.igneous.felsic.solid.all.granite_h1.jhu.becknic",
    "rock.igneous.felsic.solid.all.granite_h2.jhu.becknic",
    "rock.sedimentary.shale.solid.all.phop005.usgs.perknic",
    "rock.sedimentary.shale.solid.all.phop009.usgs.perknic",
]
ROCKS_SHA256 = "4920e8861bb473a96d1d3133e34e4cc196196a2dbf1b379c96f80621aa20475c"  # of all, joined
LEAVES = [
    "vegetation.tree.aloe.bainesii.all.jpl057.jpl.asdnicolet",
    "vegetation.tree.aloe.bainesii.all.jpl058.jpl.asdnicolet",
    "vegetation.tree.aloe.bainesii.all.jpl059.jpl.asdnicolet",
    "vegetation.shrub.agave.attenuata.all.jpl060.jpl.asdnicolet",
    "vegetation.shrub.agave.attenuata.all.jpl061.jpl.asdnicolet",
    "vegetation.shrub.agave.attenuata.all.jpl062.jpl.asdnicolet",
    "vegetation.shrub.agave.attenuata.all.jpl063.jpl.asdnicolet",
    "vegetation.shrub.portulacaria.afra.all.jpl064.jpl.asdnicolet",
    "vegetation.shrub.portulacaria.afra 'low form'.all.jpl065.jpl.asdnicolet",
    "vegetation.shrub.portulacaria.afra 'variegata'.all.jpl066.jpl.asdnicolet",
    "vegetation.tree.caesalpinia.cacalaco.all.jpl067.jpl.asdnicolet",
    "vegetation.tree.beaucarnea.recurvata.all.jpl068.jpl.asdnicolet",
    "vegetation.tree.beaucarnea.recurvata.all.jpl069.jpl.asdnicolet",
    "vegetation.tree.beaucarnea.recurvata.all.jpl070.jpl.asdnicolet",
]
LEAVES_SHA256 = "7cede852237f526608e0a5f86df21487e66f30bd99f0e9279de93d9b581911bc"  # of all, joined


@dataclass
class Material:
    name: str
    comment: str
    spectra: str
    library: str
    averaging: str


def checked(paths: list[Path], sha256: str) -> list[str]:
    """Returns texts, checked against the sum of all of them that this script was written for."""
    data = [path.read_bytes() for path in paths]
    found = hashlib.sha256(b"".join(data)).hexdigest()
    if found != sha256:
        sys.exit(f"{paths[0]}...: SHA-256 {found}, not {sha256}: is it another version?")
    return [text.decode("latin-1") for text in data]


def earthlib_spectra(rows: list[dict[str, str]], **wanted: str) -> list[list[float]]:
    """Returns the reflectances of all spectra whose columns have the wanted values."""
    return [
        [float(row[f"r{nm}"]) for nm in EARTHLIB_NM]
        for row in rows
        if all(row[key] in value.split() for key, value in wanted.items())
    ]


def ecostress_spectrum(text: str) -> list[float]:
    """Returns the reflectances of one file at ECOSTRESS_NM."""
    samples = {}
    for line in text.splitlines():
        words = line.split()
        if len(words) == 2 and all(word[0].isdigit() for word in words):
            samples[1000 * float(words[0])] = float(words[1]) / 100
    wavelengths = sorted(samples)
    reflectances = []
    for nm in ECOSTRESS_NM:
        above = bisect_left(wavelengths, nm - 1e-9)
        high = wavelengths[above]
        low = wavelengths[max(above - 1, 0)]
        share = (nm - low) / (high - low) if high > low else 0
        reflectances.append(samples[low] + share * (samples[high] - samples[low]))
    return reflectances


def flow(numbers: Iterable[float], digits: int) -> str:
    """Returns a YAML list in lines of at most twelve numbers."""
    words = [f"{number:.{digits}f}" for number in numbers]
    rows = [", ".join(words[i : i + 12]) for i in range(0, len(words), 12)]
    return "[" + ",\n    ".join(rows) + "]"


def write(material: Material, wavelengths: list[int], spectra: list[list[float]]) -> None:
    columns = list(zip(*spectra, strict=True))
    means = [statistics.fmean(column) for column in columns]
    deviations = [statistics.stdev(column) for column in columns]
    (HERE / f"{material.name}.yaml").write_text(
        f"# {material.comment} Made by make.py; format: docs/materials.md.\n"
        "groundray_material: 1\n"
        f"name: {material.name}\n"
        "spectrum:\n"
        f"  wavelengths_nm: {flow(wavelengths, 0)}\n"
        f"  reflectances: {flow(means, 4)}\n"
        f"  deviations: {flow(deviations, 4)}\n"
        "sources:\n"
        f"  spectra: '{len(spectra)} spectra: {material.spectra}'\n"
        f"  library: '{material.library}'\n"
        f"  averaging: '{material.averaging}'\n"
    )


AVERAGING = (
    "reflectances are arithmetic means in which each spectrum counts once; deviations are the "
    "standard deviations of single spectra (n - 1)"
)


def make_earthlib(folder: Path) -> None:
    rows = list(csv.DictReader(checked([folder / EARTHLIB], EARTHLIB_SHA256)[0].splitlines()))
    santa_barbara = "of the urban reflectance spectra from Santa Barbara"
    classes = [
        (
            "dry_soil",
            "Soil of all kinds, from a soil archive.",
            "class soil of the ICRAF-ISRIC soil database; the source says nothing of moisture, "
            "archived samples are taken as air-dry",
            {"level3": "soil", "source": "icraf-isric-soil-database"},
        ),
        (
            "sand",
            "Sand of one beach, so the deviations say nothing of other sands.",
            f"class sand {santa_barbara}",
            {"level3": "sand"},
        ),
        (
            "gravel",
            "Gravel on the ground: four materials, from light to very dark.",
            f"class gravel {santa_barbara}, those of bare ground (gravel roofs are left out)",
            {"level3": "gravel", "level2": "bare"},
        ),
        (
            "dry_grass",
            "Dead grass: two spectra, too few for the deviations to mean much.",
            "goldgras and deadgras of the Joint Fire Science Program, class litter",
            {"name": "goldgras deadgras"},
        ),
        (
            "bark",
            "Bark of several trees.",
            "class bark, of the urban reflectance spectra from Santa Barbara and of the Joint Fire "
            "Science Program",
            {"level3": "bark"},
        ),
        (
            "asphalt",
            "What the library calls asphalt.",
            f"class asphalt {santa_barbara}; their names begin like those of roofs. The class "
            "road, not only of asphalt, is lighter: 0.1235 at 905 nm",
            {"level3": "asphalt"},
        ),
        (
            "metal",
            "Metal of buildings, taken as Lambertian, which bare metal is not.",
            f"class metal {santa_barbara}; the source does not say which are coated",
            {"level3": "metal"},
        ),
    ]
    for name, comment, spectra, wanted in classes:
        material = Material(name, comment, spectra, EARTHLIB_LIBRARY, AVERAGING)
        write(material, EARTHLIB_NM, earthlib_spectra(rows, **wanted))


def make_ecostress(folder: Path) -> None:
    classes = [
        (
            "rock",
            "Solid rock: two granites, an andesite and two phosphorites.",
            "granite_h1, granite_h2, andesi4, phop005 and phop009 (powders are left out)",
            ROCKS,
            ROCKS_SHA256,
        ),
        (
            "leaf",
            "Fresh leaves of trees and shrubs of a garden in California, mostly succulents.",
            "jpl057 to jpl070: agave, portulacaria, aloe, beaucarnea, caesalpinia",
            LEAVES,
            LEAVES_SHA256,
        ),
    ]
    for name, comment, spectra, files, sha256 in classes:
        texts = checked([folder / f"{file}.spectrum.txt" for file in files], sha256)
        material = Material(name, comment, spectra, ECOSTRESS_LIBRARY, AVERAGING)
        write(material, ECOSTRESS_NM, [ecostress_spectrum(text) for text in texts])


def make_retro_reflector() -> None:
    (HERE / "retro_reflector.yaml").write_text(
        "# White retro-reflecting sheeting of encapsulated beads, at the least that its class "
        "allows. Made by make.py; format: docs/materials.md.\n"
        "groundray_material: 1\n"
        "name: retro_reflector\n"
        "coefficient_cd_lx_m2: 250\n"
        "sources:\n"
        "  coefficient_cd_lx_m2: 'ASTM D4956-01, type III, white, new: minimum at 0.2 degrees of "
        "observation and -4 degrees of entrance, as given in "
        "http://www.angelfire.com/trek/cityton/american.htm; a value of visible light "
        "(illuminant A), taken for the laser too'\n"
    )


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    make_earthlib(Path(sys.argv[1]))
    make_ecostress(Path(sys.argv[1]) / "ecostress_aster")
    make_retro_reflector()
