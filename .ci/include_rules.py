"""Checks the direction of includes, and that libraries are included and files opened in one place.

    include_rules.py

FOLDERS lists, for each folder of a library, the folders whose headers it may include besides its
own; an entry that nothing uses is an error. LIBRARIES lists where the headers of other libraries
may be included, CALLS and PYTHON_CALLS where files may be opened, and INEXACT the functions whose
bits differ between C libraries. IN_PASSES lists what passes, which run on devices, may include.
Public headers include only the standard library, GLM and {fmt}; PRIVATE lists the headers that may
include more. Run at the root of the tree.
"""

import re
import sys
from pathlib import Path

ROOTS = ("core", "terrain", "sensors", "reconstruction", "apps")
INCLUDE = re.compile(r'^ *# *include *(["<])([^">]+)[">]', re.MULTILINE)

FOLDERS: dict[str, str] = {
    "apps/scene": "apps/scene/calibration apps/scene/readers",
    "apps/scene/calibration": "apps/scene",
    "apps/scene/readers": "apps/scene apps/scene/calibration apps/scene/sampling",
    "apps/scene/sampling": "apps/scene",
    "core/appearance": "core core/geometry core/image",
    "core/geometry": "core",
    "core/image": "core core/io",
    "core/io": "core core/geometry",
    "core/model": "core core/appearance core/geometry core/image core/io",
    "core/tracing": "core core/appearance core/geometry core/image core/model core/tracing/passes",
    "core/tracing/passes": "core/geometry core/tracing",
    "reconstruction/dem/fill": "reconstruction reconstruction/dem reconstruction/dem/thin_plate "
    "reconstruction/mesh/holes reconstruction/mesh/scan",
    "reconstruction/dem/fusion": "reconstruction reconstruction/dem",
    "reconstruction/dem/ground": "reconstruction",
    "reconstruction/dem/smooth": "reconstruction",
    "reconstruction/mesh/accuracy": "reconstruction/mesh",
    "reconstruction/mesh/holes": "reconstruction reconstruction/mesh",
    "reconstruction/mesh/merge": "reconstruction reconstruction/mesh reconstruction/mesh/scan",
    "reconstruction/mesh/scan": "reconstruction reconstruction/mesh",
    "reconstruction/mesh/simplify": "reconstruction reconstruction/mesh "
    "reconstruction/mesh/accuracy",
    "reconstruction/pipeline": "reconstruction reconstruction/dem reconstruction/dem/fill "
    "reconstruction/dem/fusion reconstruction/dem/ground reconstruction/dem/smooth "
    "reconstruction/mesh reconstruction/mesh/holes reconstruction/mesh/merge "
    "reconstruction/mesh/scan reconstruction/mesh/simplify reconstruction/stereo",
    "reconstruction/stereo": "reconstruction/dem",
    "sensors/camera": "sensors/camera/lens sensors/sky",
    "sensors/lidar": "sensors/lidar/beam sensors/lidar/pattern sensors/lidar/receiver sensors/sky",
    "sensors/lidar/beam": "sensors/lidar sensors/lidar/pattern",
    "sensors/lidar/receiver": "sensors/sky",
    "terrain": "terrain/dem terrain/erosion terrain/lod terrain/lod/passes terrain/relief "
    "terrain/trail",
    "terrain/lod": "terrain/dem terrain/lod/passes",
    "terrain/lod/passes": "terrain/lod",
    "terrain/relief": "terrain/dem terrain/lod terrain/lod/passes terrain/trail",
    "terrain/scatter": "terrain terrain/dem terrain/lod",
    "terrain/textures": "terrain/lod",
    "terrain/trail": "terrain/dem",
    "terrain/traversability": "terrain terrain/lod",
    "terrain/water": "terrain terrain/lod",
}

# What libraries as a whole may include, and each folder of apps/.
SEES = {
    "core": "",
    "terrain": "core",
    "sensors": "core terrain",
    "reconstruction": "core terrain",
    "apps": "core",
    "apps/scene": "core terrain sensors",
    "apps/scan": "core apps/scene",
    "apps/dataset": "core sensors reconstruction apps apps/scan apps/scene",
    "apps/golden": "core terrain reconstruction apps apps/dataset apps/scan apps/scene",
    "apps/groundray": "core terrain sensors reconstruction apps apps/dataset apps/scan apps/scene",
    "apps/python": "core terrain sensors reconstruction apps/dataset apps/golden apps/scene",
    "apps/view": "core terrain sensors reconstruction apps apps/dataset apps/scan apps/scene",
}

LIBRARIES = {
    r"assimp/": r"core/model/assimp_import\.cpp",
    r"embree": r"core/tracing/embree_adapter\.h",
    r"((gdal|ogr|cpl)_|tiffio\.h)": r"terrain/dem/(gdal_raster\.h|(band_file|dem_file|dem_io"
    r"|dem_warp|drape_io|gdal_raster|layers_io|local_files|raster_input|tiled_tiff|vrt_check)\.cpp)",
    r"opencv2/": r"(sensors/camera/picture|reconstruction/dem/fill/inpaint_fill"
    r"|reconstruction/stereo/semi_global)\.cpp",
    r"(CGAL|Eigen)/": r"reconstruction/(.*\.cpp|mesh/surface_cgal\.h)",
    r"OpenMesh/": r"reconstruction/mesh/(surface_mesh\.h|simplify/edge_collapse\.h)",
    r"sleef": r"core/math\.cpp",
    r"openssl/": r"apps/dataset/file_sum\.cpp",
    r"yaml-cpp/": r"apps/scene/yaml_(reader|writer)\.cpp",
    r"(vtk|EGL/)": r"apps/view/.*",
    r"Q[A-Z]": r"apps/view/window/.*",
    r"(nanobind/|Python\.h)": r"apps/python/.*",
}

# Files are opened by core/io/open_file.h: regular ones alone, and not through links to be written.
CALLS = {
    r"\bf(re)?open\(|\bcreat\(|\bopenat\(|std::(basic_)?filebuf": r"core/io/open_file\.cpp",
    r"std::[io]?fstream( \w+)?[({]|\.open\([^)]*std::ios": r"core/io/open_file\.(h|cpp)",
    r"GDALDataset::Open|GDALOpen|VSIFOpen": r"terrain/dem/raster_input\.cpp",
    r"CreateCopy\(": r"terrain/dem/layers_io\.cpp",
    r"\bO_CREAT\b|\bopen\((?![^;]*\bO_DIRECTORY)[^;]*\bO_[A-Z]+": r"core/io/open_file\.cpp"
    r"|apps/groundray/(result_files|run_controls|run_log)\.cpp|apps/golden/suite/suite\.cpp",
}

_ELEMENTARY = (
    r"(a?(sin|cos|tan)h?|atan2|exp[2m]?1?|log(2|10|1p)?|pow|cbrt|hypot|erfc?|[lt]gamma)[fl]?\b"
)
INEXACT = re.compile(
    rf"\bstd::({_ELEMENTARY}|(polar|arg)\b|\w+_distribution\b)|(?<![\w.:>])::{_ELEMENTARY}\("
    rf"|\bglm::({_ELEMENTARY}|(angle|angleAxis|axis|eulerAngles|perspective|rotate|slerp)\b)"
    r"|(?<![\w.:>])(pow|hypot|cbrt|log1p|expm1|exp2)\("
)

# The Python package reads files by file_content.py; exports write into a folder that they made.
PYTHON_CALLS = {
    r"\b(?<!\.)open\(|\.read_(text|bytes)\(|np\.(load|fromfile|memmap|loadtxt|genfromtxt)\(": (
        "file_content.py"
    ),
    r"\bshutil\.copy|\bcopyfile(obj)?\(|\bZipFile\(|\bTarFile\(": "",
    r"\.open\(": (
        "cluster/shard.py export/las.py export/mcap_file.py export/images.py file_content.py"
    ),
}

# The passes also run on devices, for which only these headers exist.
PASSES = ("core/tracing/passes", "terrain/lod/passes")
IN_PASSES = re.compile(
    r"core/geometry/(cell|grid_frame)\.h|core/tracing/(ground_facet|leaf|passes/\w+)\.h"
    r"|terrain/lod/(lattice|passes/\w+)\.h"
)

IN_HEADERS = re.compile(r"glm/.*|fmt/.*|experimental/simd|[a-z0-9_]+")
PRIVATE = (
    "apps/scan/word_option.h",
    "core/io/json_fault.h",
    "core/model/gltf_json.h",
    "core/tracing/embree_adapter.h",
    "reconstruction/mesh/simplify/edge_collapse.h",
    "reconstruction/mesh/surface_cgal.h",
    "reconstruction/mesh/surface_mesh.h",
    "terrain/dem/gdal_raster.h",
)
INSTALLED = ("dataset", "scan", "scene")  # folders of apps/


def library_of(folder: str) -> str:
    parts = folder.split("/")
    return "/".join(parts[:2]) if parts[0] == "apps" else parts[0]


def may_include(folder: str, other: str, used: set[tuple[str, str]]) -> bool:
    """Returns true if sources of `folder` may include headers of `other`."""
    if folder == other:
        return True
    library = library_of(folder)
    if library != library_of(other):
        return library_of(other) in SEES[library].split()
    if library.startswith("apps/") and library != "apps/scene":
        return True
    used.add((folder, other))
    return other in FOLDERS.get(folder, "").split()


def faults_of(path: Path, used: set[tuple[str, str]]) -> list[str]:
    faults = []
    text = path.read_text()
    for include in INCLUDE.finditer(text):
        mark, name = include.groups()
        line = text.count("\n", 0, include.start()) + 1
        where = f"{path}:{line}: #include {include[0].split(' ', 1)[1]}"
        if mark == '"':
            other = str(Path(name).parent)
            if other.split("/")[0] in ROOTS and not may_include(str(path.parent), other, used):
                faults.append(f"{where}: {path.parent} may not include {other}")
            if str(path.parent) in PASSES and not IN_PASSES.fullmatch(name):
                faults.append(f"{where}: passes include the headers of IN_PASSES alone")
            continue
        for pattern, places in LIBRARIES.items():
            if re.match(pattern, name) and not re.fullmatch(places, str(path)):
                faults.append(f"{where}: only {places} may include it")
        installed = path.parts[0] != "apps" or path.parts[1] in INSTALLED
        public = path.suffix == ".h" and installed and str(path) not in PRIVATE
        if public and not IN_HEADERS.fullmatch(name):
            faults.append(f"{where}: a header of a library includes std, GLM and {{fmt}} alone")
    for pattern, places in CALLS.items():
        for call in re.finditer(pattern, text):
            if not re.fullmatch(places, str(path)):
                line = text.count("\n", 0, call.start()) + 1
                faults.append(f"{path}:{line}: {call[0]}: open files by core/io/open_file.h")
    for call in INEXACT.finditer(text) if path.name not in ("math.h", "math.cpp") else ():
        line = text.count("\n", 0, call.start()) + 1
        faults.append(
            f"{path}:{line}: {call[0]}: use core/math.h, whose bits are the same everywhere"
        )
    return faults


def faults_of_python(path: Path, package: Path) -> list[str]:
    text, name = path.read_text(), str(path.relative_to(package))
    return [
        f"{path}:{text.count(chr(10), 0, call.start()) + 1}: {call[0]}: "
        "read files by file_content.py"
        for pattern, places in PYTHON_CALLS.items()
        for call in re.finditer(pattern, text)
        if name not in places.split()
    ]


def main() -> int:
    used: set[tuple[str, str]] = set()
    faults = []
    for root in ROOTS:
        for path in sorted([*Path(root).rglob("*.h"), *Path(root).rglob("*.cpp")]):
            faults += faults_of(path, used)
    package = Path("apps/python/groundray")
    for path in sorted(package.rglob("*.py")):
        faults += faults_of_python(path, package)
    for folder, others in FOLDERS.items():
        faults += [
            f"{__file__}: FOLDERS: {folder} no longer includes {other}: delete it there"
            for other in others.split()
            if (folder, other) not in used
        ]
    print(*faults, sep="\n", end="\n" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
