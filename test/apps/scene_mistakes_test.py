"""Mistakes in scene files, and in the files that they name."""

import re
import shutil
import subprocess

import pytest
from user_mistakes import GENERATE, Mistake, check, in_file, in_scene, make_workshop, truncate

DRIVE = """\
  drive:
    waypoints_m: [[429420, 5150660], [429430, 5150670], [429440, 5150672]]
    speed_m_s: 8
    height_m: 0.5
"""
WAYPOINTS = "[[429420, 5150660], [429430, 5150670], [429440, 5150672]]"
EXTENT = "the DEM covers 429402.8 to 429465.8 east and 5150641.9 to 5150704.9 north"
SUN = "{azimuth_deg: 130, elevation_deg: 40}"
ROCK = "asset: rock, size_m: 1"
TOP = "  - {name: top, file: head.yaml, mount: {translation_m: [0, 0, 1.5]}}\n"


def in_path(name, text, *says):
    """Returns a mistake in a recorded trajectory, or in its name."""
    edit = ("scene.yaml", DRIVE, "  trajectory: walk.tum\n")
    return Mistake(name, GENERATE, says, (edit,), {"walk.tum": text})


def in_lidar(name, before, after, *says):
    says = ("scene.yaml:16:23: key 'file': the lidar cannot be read", *says)
    return Mistake(name, GENERATE, says, (("head.yaml", before, after),))


def in_camera(name, before, after, *says):
    return Mistake(name, GENERATE, ("scene.yaml:", *says), (("eye.yaml", before, after),))


def gdal(program, *options, out="hills.tif"):
    """Returns a change of the DEM by one of GDAL's programs."""

    def change(folder):
        command = [program, "-q", *options, folder / "hills.tif", folder / "changed.tif"]
        subprocess.run(command, check=True, timeout=60)
        (folder / "changed.tif").rename(folder / out)

    return change


def rotate(folder):
    made = folder / "turned.vrt"
    command = ["gdal_translate", "-q", "-of", "VRT", folder / "hills.tif", made]
    subprocess.run(command, check=True, timeout=60)
    turned = "<GeoTransform>429402, 1, 0.3, 5150705, 0.3, -1</GeoTransform>"
    made.write_text(re.sub("<GeoTransform>.*</GeoTransform>", turned, made.read_text()))


def copy(source, name):
    return lambda folder: shutil.copy(folder / source, folder / name)


MODEL = "model: Two beams\n"
MUCH_NOISE = "range_noise_sigma_m: 1e300\nangular_jitter_mrad: 5000\n"
NAMES = [
    in_scene(
        "a preset without a name",
        "file: head.yaml",
        'preset: ""',
        "scene.yaml:16:25: key 'preset': is empty, but must be a text",
    ),
    in_scene(
        "a preset's name as a file",
        "file: head.yaml",
        "file: velodyne_vlp16",
        "key 'file': there is no such file, but a preset of this name",
        "write 'preset: velodyne_vlp16'",
    ),
    in_scene(
        "a device as a lidar's file",
        "file: head.yaml",
        "file: /dev/zero",
        "the lidar cannot be read",
        "/dev/zero: it is a pipe or device, but must be a file",
    ),
    in_scene(
        "a sensor's name of 300 letters",
        "name: top",
        "name: " + "t" * 300,
        "key 'name': has 300 characters, but is used in file names: use at most 100",
    ),
    in_scene(
        "a NUL in a name",
        "dem: hills.tif",
        'dem: "hills\\0.tif"',
        "scene.yaml:5:8: key 'dem': 'hills\\x00.tif' has a NUL character",
    ),
    in_scene(
        "a mesh as a DEM",
        "dem: hills.tif",
        "dem: ramp.obj",
        "ramp.obj: it is no raster, but a mesh or points by its name",
        "`groundray reconstruct dem` makes a raster of scans",
    ),
    Mistake(
        "noise beyond all numbers",
        GENERATE,
        (
            "scene.yaml:16:5: key 'lidars': 'top' is invalid",
            "range noise of 1e+300 m must be from 0 to 1000 m",
            "angular jitter of 5 rad must be from 0 to 1 rad",
        ),
        (("head.yaml", MODEL, MODEL + MUCH_NOISE),),
    ),
]
SYNTAX = [
    Mistake(
        "a DEM as a scene",
        "groundray generate hills.tif -o out",
        ("hills.tif: not YAML", "raster", "`groundray info hills.tif`", "terrain.dem"),
    ),
    Mistake(
        "a folder as a scene",
        "groundray generate mine -o out",
        ("mine: it is a folder, but must be a file",),
    ),
    Mistake(
        "a misspelled scene",
        "groundray generate scenes.yaml -o out",
        ("scenes.yaml: there is no such file", "did you mean 'scene.yaml'?"),
    ),
    Mistake(
        "a scene in a folder that does not exist",
        "groundray generate scene/trail.yaml -o out",
        ("scene/trail.yaml: there is no such file", "nor the folder scene"),
    ),
    Mistake(
        "a lidar's file as a scene",
        "groundray generate head.yaml -o out",
        ("head.yaml:1:18", "this is no scene, but a lidar", "'lidars'"),
    ),
    Mistake(
        "a dataset's record as a scene",
        "groundray generate run/dataset.yaml -o out",
        ("run/dataset.yaml:1:20", "this is no scene", "give its folder"),
    ),
    in_file(
        "an empty scene",
        "void.yaml",
        "",
        "groundray generate void.yaml -o out",
        "void.yaml:1:1: the file is empty",
    ),
    in_file(
        "a scene of nothing",
        "void.yaml",
        "{}",
        "groundray generate void.yaml -o out",
        *(f"key '{key}': missing" for key in ("groundray", "seed", "terrain", "platform")),
        "at least one lidar or camera",
    ),
    in_file(
        "binary data as a scene",
        "scan.yaml",
        b"\x00\x01\x02\x03",
        "groundray generate scan.yaml -o out",
        "scan.yaml: not YAML: it contains binary data",
    ),
    in_file(
        "a scene in UTF-16",
        "wide.yaml",
        "groundray: 1\n".encode("utf-16"),
        "groundray generate wide.yaml -o out",
        "wide.yaml: not YAML: it contains binary data; save text as UTF-8",
    ),
    in_scene(
        "a list's name in the singular",
        "lidars:\n",
        "lidar:\n",
        "key 'lidar': unknown; did you mean 'lidars'?",
    ),
    in_scene(
        "one lidar instead of a list",
        "lidars:\n  - {name: top",
        "lidars:\n  {name: top",
        "key 'lidars': is a map, but must be a list",
    ),
    in_scene(
        "a tab",
        "  dem: hills.tif",
        "\tdem: hills.tif",
        "scene.yaml:5:1: tabs are not allowed in indentation: use spaces",
    ),
    in_scene(
        "a missing colon",
        "seed: 7",
        "seed 7",
        "scene.yaml:2:1: ':' is missing after 'seed'",
    ),
    in_scene(
        "a missing colon of a map",
        "terrain:\n",
        "terrain\n",
        "scene.yaml:4:1: ':' is missing after 'terrain'",
    ),
    in_scene(
        "a missing space after a colon",
        "seed: 7",
        "seed:7",
        "scene.yaml:2:1: a space after ':' is missing after 'seed'",
    ),
    in_scene(
        "a colon inside a value",
        "dem: hills.tif",
        "dem: C: hills.tif",
        "scene.yaml:5:9",
        "a value that contains ': ' must be in quotes",
    ),
    in_scene(
        "a key indented too much",
        "  material: dry_soil",
        "   material: dry_soil",
        "scene.yaml:6:4: 'material' is indented more than line 5",
        "align the two",
    ),
    in_scene(
        "a key indented too little",
        "    speed_m_s: 8",
        "   speed_m_s: 8",
        "scene.yaml:11:4",
        "is it indented as the lines above",
    ),
    in_scene(
        "a brace that is not closed",
        "{lidar: top}",
        "{lidar: top",
        "scene.yaml:21:14: this '{' is not closed with '}'",
    ),
    in_scene(
        "a bracket that is not closed",
        "[429440, 5150672]]",
        "[429440, 5150672]",
        "scene.yaml:10:18: this '[' is not closed with ']'",
    ),
    in_scene(
        "a bracket too many",
        "[429440, 5150672]]",
        "[429440, 5150672]]]",
        "scene.yaml:10:75: a closing bracket too many, or a quote that is missing",
    ),
    in_scene(
        "a quote that is not closed",
        "dem: hills.tif",
        'dem: "hills.tif',
        "scene.yaml:5:8: this quote is not closed",
    ),
    in_scene(
        "a list item among keys",
        "    height_m: 0.5",
        "    height_m: 0.5\n    - 3",
        "scene.yaml:13:5",
        "is it indented as the lines above",
    ),
    in_scene(
        "an alias",
        "duration_s: 0.3",
        "duration_s: *length",
        "scene.yaml:3:13: aliases (*name) are not allowed here: write the value out",
    ),
    in_scene(
        "an alias of an anchor",
        "seed: 7\nduration_s: 0.3",
        "seed: &same 1\nduration_s: *same",
        "scene.yaml:3:13: aliases (*name) are not allowed here: write the value out",
    ),
    in_scene(
        "a merge key",
        "    height_m: 0.5",
        "    height_m: 0.5\n    <<: *base",
        "scene.yaml:13:9: aliases (*name) are not allowed here",
    ),
    in_scene(
        "two documents",
        "seed: 7",
        "---\nseed: 7",
        "scene.yaml:3:1: a second document begins here",
    ),
    in_scene(
        "a repeated key",
        "seed: 7",
        "seed: 7\nseed: 8",
        "scene.yaml:3:1: key 'seed': repeated; first given in line 2",
    ),
]

VALUES = [
    in_scene(
        "a quoted whole number",
        "seed: 7",
        'seed: "7"',
        "scene.yaml:2:7: key 'seed'",
        "it is quoted; write 7 without quotes",
    ),
    in_scene(
        "a quoted number",
        "speed_m_s: 8",
        "speed_m_s: '8'",
        "scene.yaml:11:16: key 'speed_m_s'",
        "it is quoted; write 8 without quotes",
    ),
    in_scene(
        "a unit",
        "speed_m_s: 8",
        "speed_m_s: 8 m/s",
        "scene.yaml:11:16: key 'speed_m_s': is '8 m/s', but must be a number",
        "without quotes or unit",
    ),
    in_scene(
        "a decimal comma",
        "duration_s: 0.3",
        "duration_s: 0,3",
        "scene.yaml:3:13: key 'duration_s'",
        "write 0.3, with a decimal point",
    ),
    in_scene(
        "a negative seed",
        "seed: 7",
        "seed: -7",
        "scene.yaml:2:7: key 'seed': is '-7', but must be a whole number from 0",
    ),
    in_scene(
        "a fractional seed",
        "seed: 7",
        "seed: 7.5",
        "scene.yaml:2:7: key 'seed': is '7.5', but must be a whole number",
    ),
    in_scene(
        "a truth value",
        "seed: 7",
        "seed: true",
        "scene.yaml:2:7: key 'seed': is 'true', but must be a whole number",
    ),
    in_scene(
        "an empty value",
        "seed: 7",
        "seed:",
        "scene.yaml:2:1: key 'seed': is empty, but must be a whole number",
    ),
    in_scene(
        "a negative duration",
        "duration_s: 0.3",
        "duration_s: -0.3",
        "scene.yaml:3:13: key 'duration_s': is -0.3, but must be > 0 and at most 1e5",
    ),
    in_scene(
        "a duration of nothing",
        "duration_s: 0.3",
        "duration_s: 0",
        "scene.yaml:3:13: key 'duration_s': is 0, but must be > 0",
    ),
    in_scene(
        "a duration that is not a number",
        "duration_s: 0.3",
        "duration_s: .nan",
        "scene.yaml:3:13: key 'duration_s': is '.nan', but must be a finite number",
    ),
    in_scene(
        "a duration in milliseconds",
        "duration_s: 0.3",
        "duration_s: 300000000",
        "scene.yaml:3:13: key 'duration_s'",
        "at most 1e5",
    ),
    in_scene(
        "a duration shorter than a sweep",
        "duration_s: 0.3",
        "duration_s: 0.05",
        "scene.yaml:16:5: lidar 'top'",
        "shorter than one sweep at 10 Hz; lengthen duration_s",
    ),
    in_scene(
        "an unknown key without a near name",
        "seed: 7",
        "seed: 7\nfrobnicate: 3",
        "scene.yaml:3:1: key 'frobnicate': unknown; the keys here are",
        "terrain, tracing, weather",
    ),
    in_scene(
        "a key without its unit",
        "duration_s: 0.3",
        "duration: 0.3",
        "scene.yaml:3:1: key 'duration': unknown; did you mean 'duration_s'?",
    ),
    in_scene(
        "a key of another program",
        "pitch_deg: 5",
        "rpy_deg: [0, 5, 0]",
        "scene.yaml:20:41: key 'rpy_deg': unknown; the keys here are pitch_deg, roll_deg",
    ),
    in_scene(
        "a missing key",
        "seed: 7\n",
        "",
        "scene.yaml:1:1: key 'seed': missing",
    ),
    in_scene(
        "a newer format",
        "groundray: 1",
        "groundray: 2",
        "scene.yaml:1:12: key 'groundray': is 2, but",
        "only format 1",
    ),
    in_scene(
        "a text in place of a map",
        "terrain:\n  dem: hills.tif\n  material: dry_soil",
        "terrain: hills.tif",
        "scene.yaml:4:10: key 'terrain': is 'hills.tif', but must be a map",
    ),
    in_scene(
        "a list in place of a map",
        "  dem: hills.tif\n  material: dry_soil",
        "  - dem: hills.tif\n  - material: dry_soil",
        "scene.yaml:5:3: key 'terrain': is a list of 2, but must be a map",
    ),
    in_scene(
        "a text in place of a list",
        "[0, 0, 1.5]",
        "0 0 1.5",
        "scene.yaml:16:57: key 'translation_m': is '0 0 1.5', but must be a list of 3 numbers",
    ),
    in_scene(
        "a list that is too short",
        "[0, 0, 1.5]",
        "[0, 1.5]",
        "scene.yaml:16:57: key 'translation_m': is a list of 2, but must be a list of 3",
    ),
    in_scene(
        "an unknown choice",
        "seed: 7",
        "seed: 7\ntracing: fats",
        "scene.yaml:3:10: key 'tracing': is 'fats', but must be one of fast, exact",
        "did you mean 'fast'?",
    ),
    in_scene(
        "no sensors",
        TOP + "cameras:",
        "  []\nunused:",
        "scene.yaml:",
        "'lidars': is an empty list, but a scene needs at least one lidar or camera",
    ),
    in_scene(
        "a platform below ground",
        "height_m: 0.5",
        "height_m: -0.5",
        "scene.yaml:12:15: key 'height_m': is -0.5, but must be >= 0",
    ),
    in_scene(
        "a negative range",
        "file: head.yaml, ",
        "file: head.yaml, range_gate_m: [-1, 50], ",
        "scene.yaml:16:49: key 'range_gate_m': is -1, but must be >= 0",
    ),
    in_scene(
        "a name that is taken",
        "name: eye",
        "name: top",
        "scene.yaml:18:5: key 'name': 'top' is taken by an earlier lidar: names must differ",
    ),
    in_scene(
        "a name that is no file name",
        "name: eye",
        "name: left/eye",
        "scene.yaml:18:11: key 'name': is 'left/eye'",
        "only letters, digits, '_' and '-'",
    ),
    in_scene(
        "a misspelled trigger",
        "{lidar: top}",
        "{lidar: tops}",
        "scene.yaml:21:22: key 'lidar': is 'tops', but the scene has the lidars top",
        "did you mean 'top'?",
    ),
    in_scene(
        "a sun without azimuth",
        SUN,
        "{elevation_deg: 40}",
        "scene.yaml:7:26: key 'azimuth_deg': missing",
    ),
    in_scene(
        "a sun above the zenith",
        "elevation_deg: 40",
        "elevation_deg: 140",
        "scene.yaml:7:",
        "elevation",
        "90",
    ),
    in_scene(
        "a time of another form",
        SUN,
        "{utc: 2026-06-21 10:30, latitude_deg: 46.5, longitude_deg: -93.9}",
        "scene.yaml:7:32: key 'utc': is '2026-06-21 10:30'",
        "like 2026-06-21T10:30:00Z",
    ),
    in_scene(
        "no sky",
        f"sky: {{analytic: {{}}, sun: {SUN}}}\n",
        "",
        "scene.yaml:1:1: key 'sky': missing, but the camera 'eye' measures light",
        "products: [truth]",
    ),
    in_scene(
        "no material",
        "  material: dry_soil\n",
        "",
        "key 'terrain': must have a material",
        "for example material: dry_soil",
    ),
    in_scene(
        "a misspelled material",
        "dry_soil",
        "dry_sol",
        "scene.yaml:6:13: key 'material': 'dry_sol' is not in",
        "did you mean 'dry_soil'?",
    ),
    in_scene(
        "an unknown asset",
        ROCK,
        "asset: person_cilinder",
        "scene.yaml:14:35: key 'asset': there is no asset 'person_cilinder'",
        "did you mean 'person_cylinder'?",
    ),
    in_scene(
        "an asset of several kinds",
        ROCK,
        "asset: tree",
        "scene.yaml:14:35: key 'asset': there is no asset 'tree'",
        "did you mean 'conifer' or 'broadleaf_tree'?",
    ),
    in_scene(
        "a rock of no size",
        ROCK,
        "asset: rock, size_m: 0",
        "scene.yaml:14:49: key 'size_m': is 0, but must be > 0",
    ),
    in_scene(
        "a part of a preset's name",
        "file: head.yaml",
        "preset: vlp16",
        "scene.yaml:16:25: key 'preset': 'vlp16' is not in",
        "did you mean 'velodyne_vlp16'?",
    ),
    in_scene(
        "a camera's preset for a lidar",
        "file: head.yaml",
        "preset: fisheye_190",
        "scene.yaml:16:25: key 'preset'",
        "this is a camera, not a lidar: name it under 'cameras'",
    ),
    in_scene(
        "neither preset nor file",
        "file: head.yaml, ",
        "",
        "scene.yaml:16:5: key 'lidars': must have exactly one of 'preset' and 'file'",
    ),
]

PLACES = [
    in_scene(
        "waypoints in degrees",
        WAYPOINTS,
        "[[-93.9192, 46.5041], [-93.91919, 46.50411], [-93.9191, 46.5042]]",
        "scene.yaml:10:18: key 'waypoints_m': waypoint 1, (-93.9192, 46.5041), is outside the DEM",
        EXTENT,
        "looks like longitude and latitude in degrees",
    ),
    in_scene(
        "waypoints of latitude and longitude",
        WAYPOINTS,
        "[[46.5041, -93.9192], [46.50411, -93.91919]]",
        "scene.yaml:10:18: key 'waypoints_m'",
        "looks like longitude and latitude in degrees",
    ),
    in_scene(
        "northing before easting",
        WAYPOINTS,
        "[[5150660, 429420], [5150670, 429430], [5150672, 429440]]",
        "scene.yaml:10:18: key 'waypoints_m': waypoint 1, (5150660, 429420), is outside the DEM",
        EXTENT,
        "are easting and northing swapped?",
    ),
    in_scene(
        "a path that leaves the DEM",
        "[429440, 5150672]]\n    speed_m_s: 8",
        "[429640, 5150672]]\n    speed_m_s: 200",
        "scene.yaml:10:18: key 'waypoints_m'",
        "would stand outside the DEM at (429466.",
        "in W; move the waypoints",
        "waypoint 3, (429640, 5150672), is outside the DEM",
        EXTENT,
    ),
    in_scene(
        "one waypoint",
        WAYPOINTS,
        "[[429420, 5150660]]",
        "scene.yaml:10:18: key 'waypoints_m': has 1 points, but a drive needs at least two",
    ),
    in_scene(
        "a waypoint twice",
        "[429430, 5150670], ",
        "[429420, 5150660], ",
        "scene.yaml:10:18: key 'waypoints_m'",
        "is it a duplicate?",
    ),
    in_scene(
        "a path that is too short",
        "speed_m_s: 8",
        "speed_m_s: 800",
        "scene.yaml:10:18: key 'waypoints_m'",
        "24.466 m long, but 0.3 s at 800 m/s cover 240.000 m",
        "reduce the duration or the speed, or add waypoints",
    ),
    in_scene(
        "a sensor below ground",
        "[0, 0, 1.5]",
        "[0, 0, -1.5]",
        "scene.yaml:16:5: lidar 'top'",
        "below the ground",
        "raise its mount",
    ),
    in_scene(
        "a rock off the DEM",
        "[429436, 5150680]",
        "[429936, 5150680]",
        "scene.yaml:14:5: object 'rock': there is no ground at (429936, 5150680) m in W",
        EXTENT,
    ),
    in_scene(
        "a rock with swapped coordinates",
        "[429436, 5150680]",
        "[5150680, 429436]",
        "scene.yaml:14:5: object 'rock'",
        "are easting and northing swapped?",
    ),
    in_path(
        "a trajectory in degrees",
        "0 -93.9 46.5 420 0 0 0 1\n0.4 -93.9 46.5 420 0 0 0 1\n",
        "scene.yaml:13:5: lidar 'top'",
        "is the trajectory in the DEM's CRS",
        "looks like longitude and latitude in degrees",
    ),
    in_path(
        "a trajectory with swapped coordinates",
        "0 5150660 429420 420 0 0 0 1\n0.4 5150660 429421 420 0 0 0 1\n",
        "scene.yaml:13:5: lidar 'top'",
        "are easting and northing swapped?",
    ),
    in_path(
        "a trajectory of other heights",
        "0 429420 5150660 20 0 0 0 1\n0.4 429421 5150660 20 0 0 0 1\n",
        "scene.yaml:13:5: lidar 'top'",
        "below the ground",
        "share a vertical datum",
    ),
    in_path(
        "a trajectory that is too short",
        "0 429420 5150660 420 0 0 0 1\n0.1 429421 5150660 420 0 0 0 1\n",
        "scene.yaml:9:15: key 'trajectory'",
        "walk.tum: the trajectory lasts 0.100 s but the scene's duration_s is 0.3 s",
    ),
    in_path(
        "unsorted times",
        "0 429420 5150660 420 0 0 0 1\n0.4 429420 5150660 420 0 0 0 1\n"
        "0.2 429420 5150660 420 0 0 0 1\n",
        "scene.yaml:9:15: key 'trajectory'",
        "walk.tum:3: t = 0.2",
        "times must increase",
    ),
    in_path(
        "a quaternion that begins with w",
        "0 429420 5150660 420 0.9 0 0 0\n",
        "scene.yaml:9:15: key 'trajectory'",
        "walk.tum:1: the quaternion",
        "it must be 1: is qw the last of the four?",
    ),
    in_path(
        "a trajectory of seven columns",
        "0 429420 5150660 420 0 0 0\n",
        "walk.tum:1: the line has 7 values; it must have 8: t x y z qx qy qz qw",
    ),
    in_path(
        "a trajectory with commas",
        "0,429420,5150660,420,0,0,0,1\n",
        "walk.tum:1:",
        "separated by spaces instead of commas",
    ),
    in_path(
        "a trajectory with titles",
        "time x y z qx qy qz qw\n0 429420 5150660 420 0 0 0 1\n",
        'walk.tum:1: t = "time" must be a number',
        "a line of titles must begin with #",
    ),
    in_path(
        "a trajectory in nanoseconds",
        "1600000000000000000 429420 5150660 420 0 0 0 1\n",
        "walk.tum:1:",
        "is it in nanoseconds?",
    ),
    in_path(
        "a trajectory with a position that is not a number",
        "0 nan 5150660 420 0 0 0 1\n",
        'walk.tum:1: x = "nan" must be a finite number',
    ),
    in_path(
        "an empty trajectory",
        "",
        "scene.yaml:9:15: key 'trajectory'",
        "walk.tum: it contains no pose",
    ),
    in_scene(
        "a misspelled trajectory",
        DRIVE,
        "  trajectory: wlak.tum\n",
        "scene.yaml:9:15: key 'trajectory': wlak.tum: there is no such file",
        "did you mean 'walk.tum'?",
    ),
    in_scene(
        "a trajectory and a drive",
        "  drive:\n",
        "  trajectory: walk.tum\n  drive:\n",
        "key 'platform': must have exactly one of 'trajectory' and 'drive'",
    ),
]

FILES = [
    in_scene(
        "a misspelled DEM",
        "hills.tif",
        "hils.tif",
        "scene.yaml:5:8: key 'dem': hils.tif: there is no such file",
        "did you mean 'hills.tif'?",
    ),
    in_scene(
        "a DEM of another name",
        "hills.tif",
        "elevation_2019.tif",
        "scene.yaml:5:8: key 'dem': elevation_2019.tif: there is no such file",
        "the .tif files there: hills.tif",
    ),
    in_scene(
        "a folder as the DEM",
        "hills.tif",
        "mine",
        "scene.yaml:5:8: key 'dem': mine: it cannot be opened as a raster: it is a folder",
    ),
    in_scene(
        "a text as the DEM",
        "hills.tif",
        "notes.txt",
        "scene.yaml:5:8: key 'dem': notes.txt: it cannot be opened as a raster",
        "in none of the formats GTiff",
    ),
    in_scene(
        "a picture as the DEM",
        "hills.tif",
        "photo.png",
        "scene.yaml:5:8: key 'dem': photo.png: not a grid of heights: it has 3 bands",
        "gdal_translate -b 1",
        prepare=copy("run/camera/eye/000000_preview.png", "photo.png"),
    ),
    Mistake(
        "a DEM that was cut short",
        GENERATE,
        ("scene.yaml:5:8: key 'dem': hills.tif", "was the file cut short? Copy it again"),
        prepare=truncate("hills.tif", 5000),
    ),
    Mistake(
        "a DEM in degrees",
        GENERATE,
        ("scene.yaml:5:8: key 'dem'", "is geographic", "set reproject_to to utm", "gdalwarp"),
        prepare=gdal("gdalwarp", "-t_srs", "EPSG:4326"),
    ),
    Mistake(
        "a DEM in feet",
        GENERATE,
        ("scene.yaml:5:8: key 'dem'", "US survey foot", "not the metre", "reproject_to"),
        prepare=gdal("gdalwarp", "-t_srs", "EPSG:2263"),
    ),
    in_scene(
        "a DEM that is rotated",
        "hills.tif",
        "turned.vrt",
        "scene.yaml:5:8: key 'dem': turned.vrt: its geotransform is rotated or sheared",
        "reproject_to",
        prepare=rotate,
    ),
    Mistake(
        "a DEM without heights",
        GENERATE,
        ("scene.yaml:5:8: key 'dem'", "none of its 64 x 64 samples has a height", "nodata"),
        prepare=gdal("gdal_translate", "-a_nodata", "1", "-scale", "0", "1000", "1", "1"),
    ),
    in_scene(
        "a CRS of another form",
        "  material: dry_soil",
        "  material: dry_soil\n  reproject_to: UTM15",
        "scene.yaml:5:8: key 'dem'",
        "reproject_to = 'UTM15' is not a CRS known to GDAL; use utm, a code such as EPSG:32631",
    ),
    in_scene(
        "a misspelled lidar file",
        "head.yaml",
        "haed.yaml",
        "scene.yaml:16:23: key 'file'",
        "haed.yaml: there is no such file",
        "did you mean 'head.yaml'?",
    ),
    in_scene(
        "a camera's file for a lidar",
        "head.yaml",
        "eye.yaml",
        "scene.yaml:16:23: key 'file'",
        "eye.yaml:1:19",
        "this is a camera, not a lidar: name it under 'cameras'",
    ),
    in_scene(
        "a lidar's file for a camera",
        "file: eye.yaml",
        "file: head.yaml",
        "scene.yaml:19:11: key 'file'",
        "head.yaml:1:18",
        "this is a lidar, not a camera: name it under 'lidars'",
    ),
    in_lidar(
        "a wavelength in micrometres",
        "beam_columns",
        "laser: {wavelength_nm: 0.905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}\n"
        "receiver: {aperture_mm: 20, noise: {nep_w_per_sqrt_hz: 1e-12, false_alarm_rate_hz: 50}}\n"
        "beam_columns",
        "head.yaml:6:24: key 'wavelength_nm': is 0.905, but must be from 400 to 2000",
        "0.905 um are 905 nm",
    ),
    in_lidar(
        "a laser without a receiver",
        "beam_columns",
        "laser: {wavelength_nm: 905, pulse_energy_nj: 300, pulse_fwhm_ns: 5}\nbeam_columns",
        "head.yaml:1:1: key 'laser': needs 'receiver' too",
    ),
    in_lidar(
        "a beam with a column too few",
        "[1, -10, 500]",
        "[1, -10]",
        "head.yaml:9:5",
        "beams",
        "3",
    ),
    in_lidar(
        "a range gate with swapped ends",
        "near: 0.5, far: 60",
        "near: 60, far: 0.5",
        "head.yaml:5:15: key 'range_gate_m': near must be less than far: are they swapped?",
    ),
    in_camera(
        "an image without pixels",
        "[24, 18]",
        "[0, 18]",
        "eye.yaml:3:",
        "key 'size_px'",
    ),
    in_camera(
        "an unknown product",
        "[radiance, truth]",
        "[radiance, depht]",
        "eye.yaml:6:",
        "'depht'",
        "truth",
    ),
    in_camera(
        "an unknown lens",
        "{pinhole:",
        "{pinhol:",
        "eye.yaml:4:",
        "'pinhol'",
        "did you mean 'pinhole'?",
    ),
    in_camera(
        "a missing calibration",
        "{pinhole: {focal_px: [20, 20], centre_px: [11.5, 8.5]}}",
        "{calibration: camchain.yaml}",
        "eye.yaml:4:",
        "camchain.yaml: there is no such file",
    ),
    in_scene(
        "a model without faces",
        ROCK,
        "model: notes.obj",
        "scene.yaml:14:5: object 'rock': notes.obj: there is no triangle, as the file has no face",
        prepare=copy("notes.txt", "notes.obj"),
    ),
    in_scene(
        "a misspelled model",
        ROCK,
        "model: rampe.obj",
        "scene.yaml:14:5: object 'rock': rampe.obj: there is no such file",
        "did you mean 'ramp.obj'?",
    ),
    in_scene(
        "a model in a format that is not read",
        ROCK,
        "model: rock.blend",
        "scene.yaml:14:5: object 'rock'",
        ".obj",
        prepare=copy("notes.txt", "rock.blend"),
    ),
    in_scene(
        "a material for a part that the model lacks",
        ROCK,
        "model: ramp.obj, materials: {wheels: metal}, material: rock",
        "scene.yaml:14:5: object 'rock': materials has the surface 'wheels', but the model has",
    ),
    in_scene(
        "a misspelled sky",
        "{analytic: {}, ",
        "{environment: {image: dawn.exr}, ",
        "scene.yaml:7:",
        "key 'image'",
        "dawn.exr",
        "there is no such file",
    ),
    in_scene(
        "a text as an orthophoto",
        "  material: dry_soil",
        "  material: dry_soil\n  orthophoto: notes.txt",
        "notes.txt",
        "cannot be opened as a raster",
    ),
    in_scene(
        "a texture that is missing",
        "  material: dry_soil",
        "  material: dry_soil\n  texture: {albedo: soil.png, size_m: 2}",
        "soil.png",
        "there is no such file",
    ),
]
MISTAKES = [*NAMES, *SYNTAX, *VALUES, *PLACES, *FILES]


@pytest.fixture(scope="module")
def workshop(tmp_path_factory):
    return make_workshop(tmp_path_factory.mktemp("workshop"))


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_a_mistake_in_a_scene_is_explained(mistake, workshop, tmp_path):
    check(mistake, workshop, tmp_path)


def test_each_mistake_is_made_once():
    assert len({mistake.name for mistake in MISTAKES}) == len(MISTAKES)
