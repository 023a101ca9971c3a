"""`groundray list` and `groundray info` of presets, materials and assets."""

import json
import math
import re
import shutil
import subprocess

import numpy as np
import pytest
import yaml
from dataset_runs import PROGRAM, ROOT, groundray

PRESETS = sorted((ROOT / "data/sensors").glob("*.yaml"))
MATERIALS = sorted((ROOT / "data/materials").glob("*.yaml"))


def shown(*arguments):
    result = groundray(*arguments)
    assert result.returncode == 0, result.stderr
    assert not result.stderr
    return result.stdout


def listed(*arguments):
    entries = json.loads(shown("list", *arguments, "--json"))
    return {entry["name"]: entry for entry in entries}


def kinds_of_assets():
    """Returns the table of kinds on the page about assets: name, size and other parameters."""
    page = (ROOT / "docs/reference/assets.md").read_text()
    kinds = []
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 6 and re.fullmatch(r"[\d.]+", cells[2]):
            kinds.append((cells[0].strip("`"), cells[1], float(cells[2]), cells[3]))
    return kinds


def test_lists_all_presets_materials_and_assets():
    names = [re.match(r"  (\S+)  ", line) for line in shown("list").splitlines()]
    found = [name[1] for name in names if name]
    kinds = [kind for kind, *_ in kinds_of_assets()]
    files = [path.stem for path in PRESETS + MATERIALS]
    assert len(kinds) == 32
    assert sorted(found) == sorted(files + kinds)


def test_each_kind_is_listed_alone():
    assert set(listed("presets")) == {path.stem for path in PRESETS}
    assert set(listed("lidars")) | set(listed("cameras")) == set(listed("presets"))
    assert {entry["kind"] for entry in listed("lidars").values()} == {"lidar"}
    assert {entry["kind"] for entry in listed("cameras").values()} == {"camera"}
    assert set(listed("materials")) == {path.stem for path in MATERIALS}
    assert set(listed("assets")) == {kind for kind, *_ in kinds_of_assets()}


@pytest.mark.parametrize("path", PRESETS, ids=lambda path: path.stem)
def test_figures_of_presets_are_those_of_their_files(path):
    preset = yaml.safe_load(path.read_text())
    entry = listed("presets")[path.stem]
    assert entry["model"] == preset["model"]
    if "groundray_camera" in preset:
        assert entry["kind"] == "camera"
        assert entry["size_px"] == preset["size_px"]
        assert [entry["lens"]] == list(preset["lens"])
        assert entry["rate_hz"] == preset["rate_hz"]
        return
    assert entry["kind"] == "lidar"
    columns = preset["beam_columns"]
    beams = np.array(preset["beams"], dtype=float)
    rings = beams[:, columns.index("ring")] if "ring" in columns else np.arange(len(beams))
    elevations = beams[:, columns.index("elevation_deg")]
    assert entry["channels"] == len(set(rings))
    assert entry["rate_hz"] == pytest.approx(preset["rotation"]["rate_hz"])
    assert entry["elevation_deg"] == pytest.approx([elevations.min(), elevations.max()], abs=1e-6)
    gate = preset.get("range_gate_m", {})
    assert entry["range_m"] == [gate.get("near", 0), gate.get("far")]


def test_view_of_a_pinhole_is_that_of_its_edges():
    pinhole = yaml.safe_load((ROOT / "data/sensors/automotive_2mp3.yaml").read_text())
    focal = pinhole["lens"]["pinhole"]["focal_px"]
    centre = pinhole["lens"]["pinhole"]["centre_px"]
    expected = []
    for size, f, c in zip(pinhole["size_px"], focal, centre, strict=True):
        expected.append(math.degrees(math.atan(c / f) + math.atan((size - 1 - c) / f)))
    # The other coordinate is the image's middle, not the principal point: within a pixel of it.
    found = listed("presets")["automotive_2mp3"]["view_deg"]
    assert found == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("path", MATERIALS, ids=lambda path: path.stem)
def test_reflectances_of_matt_materials_are_those_of_their_spectra(path):
    material = yaml.safe_load(path.read_text())
    found = listed("materials")[path.stem]["reflectance_by_nm"]
    if "spectrum" not in material or "coat" in material:
        assert path.stem in ("aluminium", "iron", "puddle", "retro_reflector", "water", "wet_soil")
        return
    spectrum = material["spectrum"]
    wavelengths = spectrum["wavelengths_nm"]
    for nm in (532, 905, 1550):
        expected = np.interp(nm, wavelengths, spectrum["reflectances"])
        assert found[str(nm)] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("kind", kinds_of_assets(), ids=lambda kind: kind[0])
def test_defaults_of_assets_are_those_of_their_page(kind):
    name, size_is, size_m, others = kind
    line = next(line for line in shown("list", "assets").splitlines() if f"  {name}  " in line)
    assert f"size_m: {size_m:g} ({size_is})" in line
    expected = {"size_m": size_m}
    for key, value in re.findall(r"`(\w+)`[^(]*\(([\d.]+)\)", others):
        expected[key] = float(value)
        assert f"{key}: {float(value):g}" in line
    entry = listed("assets")[name]
    assert {key: entry[key] for key in entry if key not in ("kind", "name")} == expected


def test_info_describes_a_preset_by_its_name_and_by_its_file(tmp_path):
    by_name = shown("info", "velodyne_vlp16")
    for words in ("Velodyne VLP-16 (Puck)", "channels  16", "-15 to 15 deg", "to 100 m", "10 Hz"):
        assert words in by_name
    file = tmp_path / "mine.yaml"
    file.write_text((ROOT / "data/sensors/velodyne_vlp16.yaml").read_text())
    assert shown("info", file).splitlines() == by_name.splitlines()[:-1]
    assert "action_camera.yaml" in shown("info", "action_camera")


def test_info_describes_all_that_have_a_name():
    text = shown("info", "rock")
    assert re.findall(r"^kind +(\w+)$", text, re.MULTILINE) == ["material", "asset"]
    assert "1280 by default" in text


def test_info_prefers_a_file_to_a_preset_of_its_name(tmp_path):
    (tmp_path / "rock").write_text("not a rock")
    result = groundray("info", "rock", cwd=tmp_path)
    assert result.returncode == 1
    assert "cannot be opened as a raster" in result.stderr


def lidars_of(program, name, folder):
    """Returns the lidars that a program lists if it is started in a folder by a name."""
    done = subprocess.run(
        [name, "list", "lidars"],
        executable=program,
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


def test_data_in_the_working_folder_are_not_taken_for_groundrays_own(tmp_path):
    (tmp_path / "data/sensors").mkdir(parents=True)
    (tmp_path / "data/sensors/alien.yaml").write_text("not: groundray's\n")
    lidars = lidars_of(PROGRAM, "groundray", tmp_path)  # a relative name, as a shell gives it
    assert "velodyne_vlp16" in lidars
    assert "alien" not in lidars


def test_data_beside_a_users_folder_bin_are_not_taken_for_groundrays_own(tmp_path):
    for folder in ("project/bin", "project/data/sensors"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "project/data/sensors/alien.yaml").write_text("not: groundray's\n")
    program = tmp_path / "project/bin/groundray"
    shutil.copy(PROGRAM, program)
    lidars = lidars_of(program, str(program), tmp_path)
    assert "velodyne_vlp16" in lidars
    assert "alien" not in lidars


@pytest.mark.parametrize("name", ["groundray", "prefix/bin/groundray", "absolute"])
def test_an_installed_program_finds_its_data_by_whatever_name_it_is_started(name, tmp_path):
    for folder in ("prefix/bin", "prefix/share/groundray/data/sensors"):
        (tmp_path / folder).mkdir(parents=True)
    preset = tmp_path / "prefix/share/groundray/data/sensors/installed.yaml"
    shutil.copy(ROOT / "data/sensors/velodyne_vlp16.yaml", preset)
    program = tmp_path / "prefix/bin/groundray"
    shutil.copy(PROGRAM, program)
    lidars = lidars_of(program, str(program) if name == "absolute" else name, tmp_path)
    assert "installed" in lidars
    assert "velodyne_vlp16" not in lidars


def test_presets_of_another_data_folder_are_listed(tmp_path):
    for folder in ("sensors", "materials"):
        (tmp_path / folder).mkdir()
    text = (ROOT / "data/sensors/velodyne_vlp16.yaml").read_text()
    (tmp_path / "sensors/mine.yaml").write_text(text.replace("Velodyne VLP-16 (Puck)", "Own"))
    result = groundray("list", "presets", env={"GROUNDRAY_DATA": str(tmp_path)})
    assert result.returncode == 0, result.stderr
    assert "mine  Own: 16 channels" in result.stdout
    assert "velodyne" not in result.stdout
