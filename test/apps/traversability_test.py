"""Layers of ground for a vehicle, read by other software and computed anew."""

import json
import subprocess

import cv2
import numpy as np
import pytest
import yaml
from dataset_runs import ROOT, SCENE, command, files, groundray

PRAIRIE = ROOT / "data/terrain/prairie_1m.tif"
FLOATS = ["elevation", "slope", "roughness", "step", "clearance"]
LAYERS = [*FLOATS, "belly_contact", "verdict"]
VEHICLE = {
    "length": 1.5,
    "width": 1,
    "wheelbase": 1,
    "track": 1,
    "clearance": 0.2,
    "wheel-radius": 0.25,
}
CELL = 0.125


def options(**changes):
    sizes = VEHICLE | changes
    return [part for name, size in sizes.items() for part in (f"--{name}-m", size) if size]


def layers(source, out, *more, cell=CELL, **changes):
    return groundray(
        *("traversability", source, "-o", out, "--cell-m", cell), *options(**changes), *more
    )


def read(folder):
    return {name: cv2.imread(str(folder / f"{name}.tif"), cv2.IMREAD_UNCHANGED) for name in LAYERS}


def info(path):
    return json.loads(subprocess.check_output(["gdalinfo", "-json", path]))


def write_dem(path, heights):
    """Writes heights of samples CELL apart, the south-western one at (500000, 4000000)."""
    rows, columns = heights.shape
    west, south = 500000 - CELL / 2, 4000000 - CELL / 2
    raw = path.with_suffix(".raw")
    raw.write_bytes(heights.astype("<f4").tobytes())
    raw.with_suffix(".vrt").write_text(f"""\
<VRTDataset rasterXSize="{columns}" rasterYSize="{rows}">
  <SRS>EPSG:32631</SRS>
  <GeoTransform>{west}, {CELL}, 0, {south + rows * CELL}, 0, {-CELL}</GeoTransform>
  <VRTRasterBand dataType="Float32" band="1" subClass="VRTRawRasterBand">
    <SourceFilename relativeToVRT="1">{raw.name}</SourceFilename>
    <ImageOffset>0</ImageOffset><PixelOffset>4</PixelOffset><LineOffset>{4 * columns}</LineOffset>
    <ByteOrder>LSB</ByteOrder>
  </VRTRasterBand>
</VRTDataset>""")
    subprocess.run(["gdal_translate", "-q", raw.with_suffix(".vrt"), path], check=True)
    return path


@pytest.fixture
def hills(tmp_path):
    rng = np.random.default_rng(4)
    y, x = np.mgrid[0:61, 0:70] * CELL
    return write_dem(
        tmp_path / "hills.tif", 0.4 * np.sin(x) + 0.2 * y + rng.normal(0, 0.02, x.shape)
    )


def test_layers_are_georeferenced_as_the_dem(hills, tmp_path):
    result = layers(hills, tmp_path / "out", "--max-slope-deg", 20, "--max-step-m", 0.2)
    assert result.returncode == 0, result.stderr
    dem = info(hills)
    for name in LAYERS:
        of = info(tmp_path / f"out/{name}.tif")
        (band,) = of["bands"]
        assert of["size"] == dem["size"]
        assert of["geoTransform"] == pytest.approx(dem["geoTransform"], abs=1e-9)
        assert 'ID["EPSG",32631]' in of["coordinateSystem"]["wkt"]
        assert band["type"] == ("Float32" if name in FLOATS else "Byte")
        assert band["noDataValue"] == ("NaN" if name in FLOATS else 255)
        assert band["description"] == name
        assert band.get("unit", "") == {"slope": "deg"}.get(name, "m" if name in FLOATS else "")
    np.testing.assert_array_equal(
        read(tmp_path / "out")["elevation"], cv2.imread(str(hills), cv2.IMREAD_UNCHANGED)
    )


def slow_layers(heights):
    """Slope, roughness and step of each sample with its windows inside, by NumPy's own fit."""
    radius = np.hypot(VEHICLE["length"], VEHICLE["width"]) / 2
    reach = int(radius / CELL)
    y, x = np.mgrid[reach : -reach - 1 : -1, -reach : reach + 1] * CELL
    plane, step = np.hypot(x, y) <= radius, np.hypot(x, y) <= VEHICLE["wheel-radius"]
    design = np.stack([np.ones(plane.sum()), x[plane], y[plane]], axis=1)
    found = {name: np.full(heights.shape, np.nan) for name in ("slope", "roughness", "step")}
    for row in range(reach, heights.shape[0] - reach):
        for column in range(reach, heights.shape[1] - reach):
            window = heights[row - reach :, column - reach :][: 2 * reach + 1, : 2 * reach + 1]
            fit, squares, *_ = np.linalg.lstsq(design, window[plane], rcond=None)
            found["slope"][row, column] = np.degrees(np.arctan(np.hypot(*fit[1:])))
            found["roughness"][row, column] = np.sqrt(squares[0] / plane.sum())
            found["step"][row, column] = np.ptp(window[step])
    return found


def test_layers_match_numpy(hills, tmp_path):
    limits = {"slope": 18, "roughness": 0.05, "step": 0.15}
    names = ("--max-slope-deg", "--max-roughness-m", "--max-step-m")
    more = [part for pair in zip(names, limits.values(), strict=True) for part in pair]
    result = layers(hills, tmp_path / "out", *more)
    assert result.returncode == 0, result.stderr
    ours = read(tmp_path / "out")
    theirs = slow_layers(ours["elevation"].astype(float))
    for name, values in theirs.items():
        known = ~np.isnan(values)
        # Of floats, and of sums of 150 products in another order.
        np.testing.assert_allclose(ours[name][known], values[known], rtol=1e-5, atol=1e-6)
    known = ours["verdict"] != 255
    assert known.sum() > 1000
    expected = sum(
        (ours[name] > np.float32(limit)) << bit for bit, (name, limit) in enumerate(limits.items())
    ) + 8 * (ours["clearance"] <= 0)
    np.testing.assert_array_equal(ours["verdict"][known], expected[known])
    contact = ours["belly_contact"]
    np.testing.assert_array_equal(contact == 1, ours["clearance"] <= 0)
    np.testing.assert_array_equal(contact == 255, np.isnan(ours["clearance"]))

    record = yaml.safe_load((tmp_path / "out/traversability.yaml").read_text())
    assert record["samples"] == known.sum()
    assert record["traversable"] == (ours["verdict"] == 0).sum()
    for bit, name in enumerate(("slope", "roughness", "step", "clearance")):
        count = ((ours["verdict"][known] >> bit) & 1).sum()
        assert record["obstacles"][name] == count
    assert record["limits"]["max_slope_deg"] == 18
    assert f"{100 * record['traversable'] / record['samples']:.3f} % traversable" in result.stdout


# A wall of height h across the path, as thin as two cells, lifts the wheels that are on it and else
# comes as near to the underbody as its height.
def test_belly_touches_a_ridge_as_high_as_the_clearance(tmp_path):
    for height, contact in ((0.1875, 0), (0.203125, 1)):
        heights = np.zeros((41, 41))
        heights[20] = height
        out = tmp_path / f"{height}"
        result = layers(write_dem(tmp_path / f"{height}.tif", heights), out)
        assert result.returncode == 0, result.stderr
        ours = read(out)
        assert ours["clearance"][20, 20] == pytest.approx(0.2 - height, abs=1e-6)
        assert ours["belly_contact"][20, 20] == contact
        assert ours["verdict"][20, 20] == 8 * contact


def test_layers_have_the_same_bytes_for_any_number_of_threads(hills, tmp_path):
    for threads in (1, 3):
        result = layers(hills, tmp_path / f"{threads}", "--threads", threads)
        assert result.returncode == 0, result.stderr
    assert files(tmp_path / "1") == files(tmp_path / "3")


# The ramp of an embankment, 1 : 2, is steeper than the prairie, of which the DEM alone has none.
def test_ground_of_a_scene_has_its_trails(tmp_path):
    trail = """
  relief: {cell_m: 0.1}
  trails:
    - name: dam
      waypoints_m: [[429440, 5150640], [429440, 5150700]]
      width_m: 6
      raised_m: 2
      most_bank_m: 20"""
    terrain = f"terrain:\n  dem: {PRAIRIE}\n  material: dry_soil{trail}\n"
    scene = SCENE.replace(next(x for x in SCENE.splitlines() if x.startswith("terrain")), terrain)
    command(tmp_path, scene=scene)  # writes the files
    for source, out in ((tmp_path / "scene.yaml", "scene"), (PRAIRIE, "dem")):
        result = layers(source, tmp_path / out, cell=0.25, length=3, width=2, wheelbase=2)
        assert result.returncode == 0, result.stderr
    west, step, _, north, *_ = info(tmp_path / "dem/slope.tif")["geoTransform"]
    row = int((north - 5150670) / step)
    columns = slice(int((429430 - west) / step), int((429450 - west) / step))
    with_dam, without = (read(tmp_path / out) for out in ("scene", "dem"))
    raised = (with_dam["elevation"] - without["elevation"])[row, columns]
    assert raised.max() > 1
    assert with_dam["slope"][row, columns].max() > 20 > without["slope"][row, columns].max()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"track": 0}, "--track-m is required"),
        ({"track": -1}, "--track-m: '-1' must be a number above 0"),
        ({"wheel-radius": 0.1}, "wheel_radius_m = 0.1 is less than a cell, 0.125 m"),
        ({"length": 100}, "are its sizes in metres?"),
    ],
)
def test_mistakes_in_the_vehicle_are_reported(hills, tmp_path, more, words):
    result = layers(hills, tmp_path / "out", **more)
    assert result.returncode in (1, 2)
    assert words in result.stderr
    assert not [path for path in tmp_path.iterdir() if "out" in path.name]


def test_mistakes_in_files_of_traversability_are_reported(hills, tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full/file").touch()
    for arguments, words in (
        ((hills, tmp_path / "full"), "exists and is not an empty folder; choose another name"),
        ((hills, tmp_path / "no/folder"), "cannot be made"),
        ((tmp_path / "none.tif", tmp_path / "out"), "none.tif"),
        ((hills, tmp_path / "out", "--world", 1), "--world applies only to scenes"),
        ((hills, tmp_path / "out", "--memory-mb", 0), "--memory-mb"),
    ):
        result = layers(*arguments)
        assert result.returncode in (1, 2)
        assert words in result.stderr
    assert not (tmp_path / "out").exists()
    assert sorted(p.name for p in (tmp_path / "full").iterdir()) == ["file"]


def test_worlds_of_a_scene_are_those_that_sample_prints(tmp_path):
    varied = "  relief: {cell_m: 0.5, fractal: {rms_m: 0.1, shortest_m: 2, longest_m: 8}}\n"
    line = next(x for x in SCENE.splitlines() if x.startswith("terrain"))
    scene = SCENE.replace(line, f"terrain:\n  dem: {PRAIRIE}\n  material: dry_soil\n{varied}")
    worlds = "worlds: {count: 5, vary: {terrain.relief.fractal.rms_m: {uniform: [0.05, 0.5]}}}\n"
    command(tmp_path, scene=scene + worlds)  # writes the files
    sampled = groundray(
        *("sample", tmp_path / "scene.yaml", "--index", 3, "-o", tmp_path / "3.yaml")
    )
    assert sampled.returncode == 0, sampled.stderr
    large = {"length": 3, "width": 2, "wheelbase": 2, "wheel-radius": 1}
    for source, out, more in (
        ("3.yaml", "own", ()),
        ("scene.yaml", "3", ("--world", 3)),
        ("scene.yaml", "4", ("--world", 4)),
    ):
        result = layers(tmp_path / source, tmp_path / out, *more, cell=1, **large)
        assert result.returncode == 0, result.stderr
    assert files(tmp_path / "3") == files(tmp_path / "own")
    assert files(tmp_path / "3")["elevation.tif"] != files(tmp_path / "4")["elevation.tif"]
