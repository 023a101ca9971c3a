"""Packs the wheels that are distributed, from one that scikit-build-core has built.

There are two: that of Python 3.11, and that of the stable ABI, for 3.12 and later. Each gets the
shared libraries that it loads (by auditwheel) with their licences, and the data of GDAL and PROJ.
Run by `./dev wheel` on Debian 12.
"""

import argparse
import re
import shutil
import sys
from pathlib import Path

from bundle import add_geodata, add_licences, loaded_libraries, run

MOST_BYTES = 60 << 20


def unpacked(wheel: Path, parent: Path) -> Path:
    """Unpacks a wheel below `parent`; returns its folder."""
    shutil.rmtree(parent, ignore_errors=True)
    run(sys.executable, "-m", "wheel", "unpack", wheel, "--dest", parent)
    return next(parent.iterdir())


def with_stable_abi(wheel: Path, folder: Path) -> Path:
    """Returns a copy of the wheel with the module of the stable ABI that CMake built besides."""
    content = unpacked(wheel, folder / "abi3")
    for module in (content / "groundray").glob("_core.*.so"):
        module.unlink()
    module = content / "groundray/_core.abi3.so"
    shutil.copy(folder / "tree/python_abi3/_core.abi3.so", module)
    run("strip", module)
    packed = folder / "built_abi3"
    shutil.rmtree(packed, ignore_errors=True)
    packed.mkdir()
    run(sys.executable, "-m", "wheel", "pack", content, "--dest-dir", packed)
    tags = ("--python-tag", "cp312", "--abi-tag", "abi3")
    run(sys.executable, "-m", "wheel", "tags", "--remove", *tags, next(packed.iterdir()))
    return next(packed.iterdir())


def repaired(wheel: Path, folder: Path, platform: str) -> Path:
    """Returns a copy of the wheel that contains the shared libraries that it loads."""
    shutil.rmtree(folder / "repaired", ignore_errors=True)
    run(
        *(sys.executable, "-m", "auditwheel", "repair", "--strip", "--plat", platform),
        *("--wheel-dir", folder / "repaired", wheel),
        environment={
            "LD_LIBRARY_PATH": str(folder / "slim/lib"),
            "PATH": f"{Path(sys.executable).parent}:/usr/bin:/bin",
        },
    )
    return next((folder / "repaired").iterdir())


def included_libraries(content: Path, folder: Path) -> dict[str, Path]:
    """Returns the names of the libraries that auditwheel copied, with the original files."""
    tree = folder / "tree"
    loaded = loaded_libraries(
        [tree / "bin/groundray", tree / "bin/groundray-golden", *tree.rglob("_core.c*.so")],
        folder / "slim",
    )
    loaded |= {file.resolve().name: file for file in loaded.values()}
    names = (file.name for file in (content / "groundray.libs").iterdir())
    originals = (re.sub(r"-[0-9a-f]{8}(?=\.)", "", name) for name in names)
    return {name: loaded[name] for name in originals}


def add_license_files(info: Path) -> None:
    """Lists the files of licenses/libraries in the metadata."""
    metadata = info / "METADATA"
    head, gap, rest = metadata.read_text().partition("\n\n")
    for file in sorted((info / "licenses/libraries").iterdir()):
        head += f"\nLicense-File: libraries/{file.name}"
    metadata.write_text(head + gap + rest)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheel", type=Path)
    parser.add_argument(
        "folder", type=Path, help="with tree, slim and the sources of its libraries"
    )
    parser.add_argument("output", type=Path)
    parser.add_argument("--platform", required=True)
    given = parser.parse_args()
    for wheel in (given.wheel, with_stable_abi(given.wheel, given.folder)):
        content = unpacked(repaired(wheel, given.folder, given.platform), given.folder / "unpacked")
        info = next(content.glob("*.dist-info"))
        libraries = included_libraries(content, given.folder)
        add_licences(info / "licenses/libraries", libraries, given.folder)
        add_license_files(info)
        add_geodata(content / "groundray", given.folder / "slim")
        run(sys.executable, "-m", "wheel", "pack", content, "--dest-dir", given.output)
    for wheel in sorted(given.output.glob("*.whl")):
        size = wheel.stat().st_size
        print(f"dev wheel: {wheel}: {size / 2**20:.1f} MiB")
        if size > MOST_BYTES:
            sys.exit(f"{wheel} is larger than {MOST_BYTES >> 20} MiB")


if __name__ == "__main__":
    main()
