"""Mistakes in commands and their inputs: datasets, DEMs, meshes, scans and options."""

import os
import shutil

import pytest
from dataset_runs import as_cut_off
from user_mistakes import GENERATE, Mistake, check, in_file, make_workshop, run, truncate

SCAN = "run/lidar/top/000000.ply"
CLOUD = """\
ply
format ascii 1.0
element vertex {}
property float x
property float y
property float z
end_header
"""


def unfinish(folder, run="run"):
    """Makes a dataset that of a run killed before its first frame was complete."""
    whole = (folder / run).rename(folder / "whole")
    as_cut_off(whole, folder / run, 0)
    shutil.rmtree(whole)


def make_other_shard(folder):
    scene = (folder / "scene.yaml").read_text().replace("seed: 7", "seed: 8")
    (folder / "other.yaml").write_text(scene)
    made = run("groundray", "generate", "other.yaml", "-o", "other", "--shard", "2/2", cwd=folder)
    assert made.returncode == 0, made.stderr


USAGE = [
    Mistake(
        "no command", "groundray terrain", ("a command is missing", "mesh, certify, fill"), code=2
    ),
    Mistake(
        "help as a command",
        "groundray help",
        ("there is no command 'help'; the commands are generate, verify", "--help"),
        code=2,
    ),
    Mistake(
        "a misspelled command",
        "groundray generat scene.yaml -o out",
        ("there is no command 'generat'; did you mean 'generate'?",),
        code=2,
    ),
    Mistake(
        "a command of terrain left out",
        "groundray terrain hills.tif",
        ("there is no command 'hills.tif'; the commands are mesh, certify, fill",),
        code=2,
    ),
    Mistake(
        "a misspelled option",
        "groundray generate scene.yaml --outptu out",
        ("there is no option --outptu; did you mean '--output'?",),
        code=2,
    ),
    Mistake(
        "an option of another command",
        "groundray verify run --seed 3",
        ("there is no option --seed",),
        code=2,
    ),
    Mistake("no output", "groundray generate scene.yaml", ("--output is required",), code=2),
    Mistake(
        "an output without a name",
        "groundray generate scene.yaml -o",
        ("--output needs a value",),
        code=2,
    ),
    Mistake(
        "a scene as its log",
        GENERATE + " --log-json scene.yaml",
        ("scene.yaml: it is not a log", "--log-json"),
    ),
    Mistake(
        "a dataset's scan as a result",
        f"groundray reconstruct mesh run -o out.ply --report {SCAN}",
        (f"{SCAN}: it is a file of the dataset", "choose another name"),
    ),
    Mistake(
        "a report into a dataset",
        "groundray-golden compare hills.tif hills.tif -o run",
        ("run: it is a dataset; choose another folder with -o",),
    ),
    Mistake(
        "an address as a DEM",
        "groundray info https://example.com/dem.tif",
        ("it is an address, but must be a file: download it first",),
    ),
    Mistake(
        "two scenes",
        "groundray generate scene.yaml eye.yaml -o out",
        ("'eye.yaml' is one argument too many",),
        code=2,
    ),
    Mistake(
        "a negative seed",
        GENERATE + " --seed -1",
        ("--seed: '-1' must be a whole number from 0 to 2^64 - 1",),
        code=2,
    ),
    Mistake(
        "a fractional seed",
        GENERATE + " --seed 1.5",
        ("--seed: '1.5' must be a whole number",),
        code=2,
    ),
    Mistake(
        "a shard beyond the last",
        GENERATE + " --shard 3/2",
        ("--shard: '3/2' must be one of 1/N to N/N, such as 2/8",),
        code=2,
    ),
    Mistake("a shard counted from 0", GENERATE + " --shard 0/2", ("--shard: '0/2'", "1/N"), code=2),
    Mistake(
        "swapped scene and output",
        "groundray generate -o scene.yaml out",
        ("out: there is no such file",),
    ),
    Mistake(
        "a negative tolerance",
        "groundray terrain mesh hills.tif -o out.ply --max-error-m -1",
        ("--max-error-m: '-1' must be a number, 0 or more",),
        code=2,
    ),
    Mistake(
        "a tolerance that is not a number",
        "groundray terrain mesh hills.tif -o out.ply --max-error-m nan",
        ("--max-error-m: 'nan' must be a number, 0 or more",),
        code=2,
    ),
    Mistake(
        "a tolerance with a unit",
        "groundray terrain mesh hills.tif -o out.ply --max-error-m 1m",
        ("--max-error-m: '1m' must be a number",),
        code=2,
    ),
    Mistake(
        "an angle without a viewpoint",
        "groundray terrain mesh hills.tif -o out.ply --max-error-m 1 --angle-mrad 3",
        ("--angle-mrad requires --viewpoint",),
        code=2,
    ),
    Mistake(
        "an unknown method",
        "groundray terrain fill hills.tif -o out.tif --method krig",
        ("--method: 'krig' must be tension, cgal, gdal, telea or ns",),
        code=2,
    ),
    Mistake(
        "no stop criterion",
        "groundray reconstruct simplify ramp.obj -o out.ply",
        ("Exactly 1 option from [--max-vertical-error-m", "is required"),
        code=2,
    ),
    Mistake(
        "two stop criteria",
        "groundray reconstruct simplify ramp.obj -o out.ply --triangles 1 --knee",
        ("Exactly 1 option from [--max-vertical-error-m", "2 were given"),
        code=2,
    ),
    Mistake(
        "cells of no size",
        "groundray reconstruct dem run -o out.tif --cell-m 0",
        ("--cell-m: '0' must be a number above 0",),
        code=2,
    ),
    Mistake(
        "no cell size",
        "groundray reconstruct dem run -o out.tif",
        ("the resolution of the DEM is missing: give --cell-m, or --like another DEM",),
    ),
    Mistake(
        "frames in words",
        "groundray reconstruct mesh run -o out.ply --frames all",
        ("--frames: 'all' must be A:B:STEP, such as 0:10, 5: or ::2",),
    ),
    Mistake(
        "one scan to compare",
        "groundray-golden compare hills.tif -o out",
        ("OTHER is required",),
        code=2,
    ),
    Mistake(
        "no rays",
        "groundray-golden passes hills.tif -o out --rays 0",
        ("--rays: Value 0 not in range 1 to 100000000",),
        code=2,
    ),
    Mistake(
        "a block that is no power of two",
        "groundray-golden passes hills.tif -o out --block-cells 7",
        ("block_cells = 7 must be a power of two from 2 to 64",),
    ),
    Mistake(
        "a DEM without triangles",
        "groundray-golden passes thin.asc -o out",
        ("thin.asc: no three heights of any cell form a triangle",),
        files={
            "thin.asc": "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
            "NODATA_value -1\n5 -1 -1\n-1 -1 -1\n-1 -1 5\n"
        },
    ),
]

OUTPUTS = [
    Mistake(
        "a folder of something else",
        "groundray generate scene.yaml -o mine",
        ("mine: the folder is not empty", "choose a new folder with -o"),
    ),
    Mistake(
        "a file as the folder",
        "groundray generate scene.yaml -o notes.txt",
        ("notes.txt: cannot create this folder: Not a directory", "choose another one with -o"),
    ),
    Mistake(
        "a folder of the same run",
        "groundray generate scene.yaml -o run",
        ("run: the folder already contains a dataset of this run", "add --resume"),
    ),
    Mistake(
        "a folder of another run",
        "groundray generate scene.yaml -o run --resume --seed 8",
        ("run/dataset.yaml: the folder contains a dataset of another scene", "choose a new folder"),
    ),
    Mistake(
        "an output that cannot be written",
        "groundray generate scene.yaml -o /proc/nowhere",
        ("/proc/nowhere: cannot create this folder", "choose another one with -o"),
    ),
    Mistake(
        "a mesh in an unknown format",
        "groundray terrain mesh hills.tif -o out.dae --max-error-m 1",
        ("out.dae: the name of a mesh must end in .ply, .obj, .stl or .glb",),
    ),
    Mistake(
        "a mesh in a folder that does not exist",
        "groundray terrain mesh hills.tif -o no/out.ply --max-error-m 1",
        ("no/out.ply: there is no folder no to write it in",),
    ),
    Mistake(
        "a DEM in place of its input",
        "groundray terrain fill hills.tif -o hills.tif",
        ("hills.tif: it is an input and cannot be overwritten; choose another name",),
    ),
    Mistake(
        "a DEM as a picture",
        "groundray terrain fill hills.tif -o out.png",
        ("out.png: its name must end in .tif",),
    ),
    Mistake(
        "merging into a shard",
        "groundray merge half_1 half_2 -o half_1",
        ("half_1: it is one of the shards; choose a new folder with -o",),
    ),
    Mistake(
        "merging into a folder of something else",
        "groundray merge half_1 half_2 -o mine",
        ("mine: the folder is not empty; choose a new one with -o",),
    ),
    Mistake(
        "a screenshot in another format",
        "groundray-view ramp.obj --screenshot out.jpg",
        ("out.jpg: its name must end in .png",),
    ),
    Mistake(
        "a screenshot with one size",
        "groundray-view ramp.obj --screenshot out.png --size 1280",
        ("--size 1280: it must be WIDTHxHEIGHT in pixels, such as 1280x720",),
    ),
    Mistake(
        "exporting into a folder of something else",
        "groundray-export run -o mine --to pcd",
        ("mine: the folder is not empty; choose a new one with -o",),
    ),
]

INPUTS = [
    Mistake(
        "a misspelled DEM",
        "groundray info hils.tif",
        ("hils.tif: there is no such file", "did you mean 'hills.tif'?"),
    ),
    Mistake(
        "info about a text",
        "groundray info notes.txt",
        ("notes.txt: it cannot be opened as a raster", "in none of the formats GTiff"),
    ),
    Mistake(
        "a GeoTIFF of four bytes",
        "groundray info cut.tif",
        ("cut.tif: it cannot be opened as a raster: Cannot read TIFF header",),
        files={"cut.tif": b"II*\0"},
    ),
    Mistake(
        "info about a folder",
        "groundray info mine",
        ("mine: it is neither the folder of a dataset nor a raster",),
    ),
    Mistake(
        "info about a faulty camera",
        "groundray info eye.yaml",
        ("eye.yaml:3:11: key 'size_px'", "must be > 0"),
        (("eye.yaml", "size_px: [24, 18]", "size_px: [-24, 18]"),),
    ),
    Mistake(
        "info about a misspelled preset",
        "groundray info velodyne_vlp61",
        ("there is no such file, preset, material or asset", "did you mean 'velodyne_vlp16'"),
    ),
    Mistake(
        "verifying a file",
        "groundray verify notes.txt",
        ("notes.txt: a file, but a dataset is a folder", "`groundray generate`"),
    ),
    Mistake(
        "verifying another folder",
        "groundray verify mine",
        ("mine: the folder contains no dataset.yaml", "`groundray generate`"),
    ),
    Mistake(
        "verifying a misspelled folder",
        "groundray verify rum",
        ("rum: there is no such file or folder", "did you mean 'run'?"),
    ),
    Mistake(
        "verifying an unfinished run",
        "groundray verify run",
        ("run: unfinished: 0 of 6 frames are complete", "--resume"),
        prepare=unfinish,
    ),
    Mistake(
        "verifying a damaged run",
        "groundray verify run",
        ("1 of 1 datasets is damaged or incomplete", "`groundray generate --resume`"),
        prepare=truncate(SCAN, 100),
    ),
    Mistake(
        "a dataset of a newer format",
        "groundray verify run",
        ("run/dataset.yaml:1:20: key 'groundray_dataset': is 99", "only format 1"),
        (("run/dataset.yaml", "groundray_dataset: 1", "groundray_dataset: 99"),),
    ),
    Mistake(
        "a shard too few",
        "groundray merge half_1 -o out",
        ("shard 2/2 is missing; create it with `groundray generate --shard`, or add its folder",),
    ),
    Mistake(
        "a shard twice",
        "groundray merge half_1 half_1 -o out",
        ("half_1: shard 1/2 is given twice",),
    ),
    Mistake(
        "a dataset among shards",
        "groundray merge half_1 run -o out",
        ("run: the dataset is complete, not a shard",),
    ),
    Mistake(
        "a shard of another run",
        "groundray merge half_1 other -o out",
        ("other: it belongs to another run than half_1: 'seed: 8' instead of 'seed: 7'",),
        prepare=make_other_shard,
    ),
    Mistake(
        "a misspelled shard",
        "groundray merge half_1 half2 -o out",
        ("half2: there is no such file or folder", "did you mean 'half_2'?"),
    ),
    Mistake(
        "an unfinished shard",
        "groundray merge half_1 half_2 -o out",
        ("half_2: shard 2/2 is not complete; continue it with `groundray generate --resume`",),
        prepare=lambda folder: unfinish(folder, "half_2"),
    ),
    Mistake(
        "certifying a misspelled DEM",
        "groundray terrain certify hill.tif",
        ("hill.tif: there is no such file", "did you mean 'hills.tif'?"),
    ),
    Mistake(
        "swapped DEM and mesh",
        "groundray terrain mesh out.ply -o hills.tif --max-error-m 1",
        ("out.ply: there is no such file",),
    ),
    Mistake(
        "bounds that are missing",
        "groundray terrain fill hills.tif -o out.tif --bound bounds.tif",
        ("bounds.tif: there is no such file", "the .tif files there: hills.tif"),
    ),
    Mistake(
        "a misspelled dataset",
        "groundray reconstruct mesh runn -o out.ply",
        ("runn: there is no such file or folder", "did you mean 'run'?"),
    ),
    Mistake(
        "a folder without a dataset",
        "groundray reconstruct mesh mine -o out.ply",
        ("mine: the folder contains no dataset.yaml", "or the scans themselves"),
    ),
    Mistake(
        "an unknown lidar",
        "groundray reconstruct mesh run -o out.ply --sensor roof",
        ("run: it has no lidar 'roof'; it has: top",),
    ),
    Mistake(
        "frames after the last",
        "groundray reconstruct mesh run -o out.ply --frames 7:9",
        ("run: there is no scan among the requested frames",),
    ),
    Mistake(
        "a text as a scan",
        "groundray reconstruct mesh notes.txt -o out.ply",
        ('notes.txt: the extension ".txt" is not one of the supported point files: .ply',),
    ),
    Mistake(
        "a scan that was cut short",
        f"groundray reconstruct mesh {SCAN} -o out.ply --range-sd-m 0.01",
        ("000000.ply: the element vertex has", "is the file truncated?"),
        prepare=truncate(SCAN, 900),
    ),
    Mistake(
        "an empty NPZ",
        "groundray reconstruct mesh empty.npz -o out.ply",
        ("empty.npz",),
        files={"empty.npz": ""},
    ),
    Mistake(
        "a journal in whose place is a pipe",
        "groundray info run",
        ("run/dataset.journal: it is a pipe or device, but must be a file",),
        prepare=lambda folder: os.mkfifo(folder / "run/dataset.journal"),
    ),
    in_file(
        "a cloud without points",
        "none.ply",
        CLOUD.format(0),
        "groundray reconstruct mesh none.ply -o out.ply --range-sd-m 0.01",
        "none.ply: no scan has a return",
    ),
    in_file(
        "a DEM of a cloud without points",
        "none.ply",
        CLOUD.format(1) + "nan nan nan\n",
        "groundray reconstruct dem none.ply -o out.tif --cell-m 1 --range-sd-m 0.01",
        "none.ply: no scan has a return and no stereo pair has a match",
    ),
    Mistake(
        "frames in the wrong order",
        "groundray reconstruct mesh run -o out.ply --frames 2:1",
        ("--frames: '2:1' has no frame", "A must be less than B"),
    ),
    in_file(
        "an STL that was cut short",
        "cut.stl",
        "solid\n",
        "groundray reconstruct simplify cut.stl -o out.ply --triangles 1",
        "cut.stl: its STL cannot be read: File is too small; was the file cut short?",
    ),
    in_file(
        "a glTF of another version",
        "new.gltf",
        '{"asset": {"version": "9.0"}}',
        "groundray reconstruct simplify new.gltf -o out.ply --triangles 1",
        'new.gltf: asset.version = "9.0", but only glTF 2 is read',
    ),
    in_file(
        "a glTF with a matrix of one number",
        "matrix.gltf",
        '{"asset": {"version": "2.0"}, "nodes": [{"matrix": [1]}]}',
        "groundray reconstruct simplify matrix.gltf -o out.ply --triangles 1",
        "matrix.gltf: nodes[0]: matrix must be 16 finite numbers",
    ),
    in_file(
        "a glTF of other values",
        "odd.gltf",
        '{"asset": {"version": "2.0"}, "scenes": "all"}',
        "groundray reconstruct simplify odd.gltf -o out.ply --triangles 1",
        "odd.gltf: scenes must be a list, but its type is string",
    ),
    Mistake(
        "a glTF file of other bytes",
        "groundray reconstruct simplify noise.glb -o out.ply --triangles 1",
        "noise.glb: it is not valid glTF: its JSON is invalid at byte 1",
        files={"noise.glb": b"\x935K noise"},
    ),
    Mistake(
        "a glTF file that names a view it does not have",
        "groundray reconstruct simplify views.gltf -o out.ply --triangles 1",
        "views.gltf: accessors[0]: there is no bufferViews[0]",
        files={
            "views.gltf": '{"asset": {"version": "2.0"}, "accessors": [{"bufferView": 0,'
            ' "componentType": 5126, "type": "VEC3", "count": 4}]}'
        },
    ),
    Mistake(
        "a DEM as a mesh",
        "groundray reconstruct simplify hills.tif -o out.ply --triangles 1",
        ("hills.tif: the name of a mesh must end in .ply, .obj, .stl, .gltf or .glb",),
    ),
    Mistake(
        "a scan as a mesh",
        f"groundray reconstruct simplify {SCAN} -o out.ply --triangles 1",
        ("000000.ply", "is it a mesh?"),
    ),
    Mistake(
        "cells that are too small",
        "groundray reconstruct dem run -o out.tif --cell-m 1e-5",
        ("samples", "choose larger cells, a smaller area, or tiles"),
    ),
    Mistake(
        "a raster as points",
        "groundray reconstruct dem hills.tif -o out.tif --cell-m 1",
        ('hills.tif: the extension ".tif" is not one of the supported point files',),
    ),
    Mistake(
        "a DEM against a mesh",
        "groundray-golden compare hills.tif ramp.obj -o out",
        ("hills.tif seems to be a DEM and ramp.obj a mesh", "--as"),
    ),
    Mistake(
        "files of no known kind",
        "groundray-golden compare notes.txt notes.txt -o out",
        ("notes.txt: the name does not show the kind of file; give it with --as",),
    ),
    Mistake(
        "a misspelled DEM to compare",
        "groundray-golden compare hills.tif hils.tif -o out",
        ("hils.tif: there is no such file", "did you mean 'hills.tif'?"),
    ),
    Mistake(
        "a case that does not exist",
        "groundray-golden run --filter nosuchcase -o out",
        ("contains no case with 'nosuchcase' in its name",),
    ),
    Mistake(
        "accepting a case that does not exist",
        "groundray-golden accept lidar_nosuch",
        ("lidar_nosuch: there is no such file or folder",),
    ),
    Mistake(
        "judging arrays that are missing",
        "groundray-golden conform mine run -o out",
        ("mine/manifest.json: there is no such file", "docs/guide/gpu.md"),
    ),
    Mistake(
        "showing a misspelled folder",
        "groundray-view rum --screenshot out.png",
        ("rum: there is no such file or folder", "did you mean 'run'?"),
    ),
    Mistake(
        "showing a text",
        "groundray-view notes.txt --screenshot out.png",
        ("notes.txt: it cannot be shown: it is not a scene (.yaml), a dataset's folder",),
    ),
    Mistake(
        "an unknown colour",
        "groundray-view ramp.obj --screenshot out.png --colour-by range",
        ("--colour-by range: no layer has that column; there are ramp.obj=height",),
    ),
    Mistake(
        "a viewpoint in the plane",
        "groundray-view ramp.obj --screenshot out.png --look-from 1,2",
        ("--look-from 1,2: it must be X,Y,Z in metres",),
    ),
    Mistake(
        "an unknown layer",
        "groundray-view ramp.obj --screenshot out.png --hide rocks",
        ("--hide rocks: no layer has that name; there are ramp.obj",),
    ),
    Mistake(
        "exporting to an unknown format",
        "groundray-export run -o out --to rosbag",
        ("argument --to: invalid choice: 'rosbag'", "mcap"),
        code=2,
    ),
    Mistake(
        "exporting a misspelled folder",
        "groundray-export rum -o out --to pcd",
        ("rum: there is no such folder", "did you mean 'run'?"),
    ),
    Mistake(
        "exporting a scan",
        f"groundray-export {SCAN} -o out --to pcd",
        ("000000.ply: it is a file", "the folder that groundray generate wrote"),
    ),
    Mistake(
        "exporting an unknown lidar",
        "groundray-export run -o out --to pcd --lidar roof",
        ("run: it has no lidar roof; it has: top",),
    ),
    Mistake(
        "exporting an unknown column",
        "groundray-export run -o out --to pcd --columns x,y,z,rnge",
        ("it has no column rnge; it has x, y, z, intensity",),
    ),
    Mistake(
        "exporting an unfinished run",
        "groundray-export run -o out --to pcd",
        ("run: 6 of its frames are pending; finish it with groundray generate",),
        prepare=unfinish,
    ),
    Mistake(
        "exporting a scan that was cut short",
        "groundray-export run -o out --to pcd",
        ("000000.ply: it has 900 bytes, but its header requires", "generate it again"),
        prepare=truncate(SCAN, 900),
    ),
    Mistake(
        "exporting a dataset of a newer format",
        "groundray-export run -o out --to pcd",
        ("run/dataset.yaml: groundray_dataset = 99 must be 1: use a newer groundray",),
        (("run/dataset.yaml", "groundray_dataset: 1", "groundray_dataset: 99"),),
    ),
]
MISTAKES = [*USAGE, *OUTPUTS, *INPUTS]


@pytest.fixture(scope="module")
def workshop(tmp_path_factory):
    return make_workshop(tmp_path_factory.mktemp("workshop"))


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_a_mistake_in_a_command_is_explained(mistake, workshop, tmp_path):
    check(mistake, workshop, tmp_path)


def test_each_mistake_is_made_once():
    assert len({mistake.name for mistake in MISTAKES}) == len(MISTAKES)


def test_a_tolerance_above_the_sensor_is_noted(workshop):
    def told(tolerance_m):
        scene = (workshop / "scene.yaml").read_text()
        scene = scene.replace("dem: hills.tif", f"dem: hills.tif\n  tolerance_m: {tolerance_m}")
        (workshop / "coarse.yaml").write_text(scene)
        result = run("groundray", "info", "coarse.yaml", cwd=workshop)
        assert result.returncode == 0, result.stderr
        return [line for line in result.stdout.splitlines() if line.startswith("note")]

    # The lidar is 2 m above the ground, the camera at 1.7 m, both give or take the ground's slope.
    assert told(0.5) == []
    (note,) = told(1.85)
    assert "camera 'eye'" in note
    lidar, camera = told(2.3)
    for note, name in ((lidar, "lidar 'top'"), (camera, "camera 'eye'")):
        assert f"tolerance_m = 2.3 is not less than the height of {name}" in note
        assert "error bounds can be infinite; choose a smaller one" in note
