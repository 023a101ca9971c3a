"""Data of GDAL and PROJ, and licences, for packages that contain their own libraries."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

PROJ_DATA = Path("/usr/share/proj")
SLIM = ("assimp", "gdal")  # built from Debian's sources by ./dev wheel
COMMON_LICENCES = Path("/usr/share/common-licenses")


def run(*command: str | Path, environment: dict[str, str] | None = None) -> str:
    """Runs a command and returns its output; exits with all that it printed if it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}:\n{done.stdout}{done.stderr}")
    return done.stdout


def loaded_libraries(files: Iterable[Path], slim: Path) -> dict[str, Path]:
    """Returns the libraries that programs and libraries load, with their files."""
    environment = {"LD_LIBRARY_PATH": str((slim / "lib").resolve())}
    loaded = {}
    for file in files:
        for name, path in re.findall(
            r"\s(\S+) => (\S+)", run("ldd", file, environment=environment)
        ):
            if not path.startswith("/"):
                sys.exit(f"{file}: {name} => {path}")
            loaded[name] = Path(path)
    return loaded


def add_geodata(folder: Path, slim: Path) -> None:
    """Adds the files that GDAL and PROJ read to groundray's own folder (core/own_folder.h)."""
    of_other_drivers = shutil.ignore_patterns(
        "grib2_*", "gml*", "inspire_*", "jpfgdgml_*", "plscenesconf.json", "*.svg", "*.png"
    )
    shutil.copytree(slim / "share/gdal", folder / "gdal", ignore=of_other_drivers)
    # Heights are never transformed, and PROJ 9 knows the Swiss grids by another name.
    unused = shutil.ignore_patterns("*.schema.json", "egm96_15.gtx", "CHENYX06*.gsb")
    shutil.copytree(PROJ_DATA, folder / "proj", ignore=unused)


def package_of(path: Path) -> str:
    """Returns the Debian package that has the file."""
    for name in (path, path.resolve(), Path("/usr") / path.relative_to("/")):
        found = subprocess.run(["dpkg", "-S", name], capture_output=True, text=True, check=False)
        if found.returncode == 0:
            return found.stdout.split(":")[0]
    sys.exit(f"no package of Debian has {path}, so its licence is not known")


def add_licences(folder: Path, libraries: dict[str, Path], built: Path) -> None:
    """Writes the licence of each library, and which source it is built of, to the folder.

    `libraries` maps names to files of Debian packages; sources of slim ones are in `built`.
    """
    texts = {"gdal": built / "gdal_source/debian/copyright"}
    lines = ["The files of this folder are the licences of included libraries and data:\n\n"]
    for name, path in sorted(libraries.items()):
        if name == "libGLX.so.0":  # groundray's own stand-in (.ci/wheel.sh)
            continue
        slim = next((slim for slim in SLIM if name.startswith(f"lib{slim}.")), None)
        if slim is not None:
            package, source_folder = slim, built / f"{slim}_source/debian"
            heading = (source_folder / "changelog").read_text().splitlines()[0]
            source = f"{slim} {re.search(r'[(](.+)[)]', heading)[1]}, built with fewer parts"
            texts[package] = source_folder / "copyright"
        else:
            package = package_of(path)
            source = run("dpkg-query", "-W", "-f=${source:Package} ${source:Version}", package)
            texts[package] = Path("/usr/share/doc") / package / "copyright"
        lines.append(f"{name}: {package}.txt; from Debian's source package {source}\n")
    for package in ("libproj25", "proj-data"):
        texts[package] = Path("/usr/share/doc") / package / "copyright"
    lines.append("files in gdal/: gdal.txt; in proj/: libproj25.txt and proj-data.txt\n")
    folder.mkdir(parents=True)
    (folder / "README.txt").write_text("".join(lines))
    for package, file in texts.items():
        text = file.read_text(errors="replace")
        (folder / f"{package}.txt").write_text(text)
        for licence in re.findall(r"common-licenses/([A-Za-z0-9.-]*[A-Za-z0-9])", text):
            if (COMMON_LICENCES / licence).is_file():
                shutil.copy(COMMON_LICENCES / licence, folder / f"{licence}.txt")
