"""Sweeps of groundray-cluster: each dataset is that of its scene file, and faults name the key."""

import shutil

import pytest
import yaml
from cluster_runs import arguments, cluster, single_run
from dataset_runs import PROGRAM, files, groundray
from groundray.cluster.sweep import read_sweep

TABLE = """\
scene: scene.yaml
shards: 2
vary:
  seed: [7, 8]
  lidars.front.mount.translation_m: [[1, 0, 1], [1, 0, 1.5]]
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with a copy of the scene."""
    source = single_run()[0].parent
    for name in ("scene.yaml", "camera.yaml"):
        shutil.copy(source / name, tmp_path / name)
    return tmp_path


def table(folder, text):
    (folder / "params.yaml").write_text(text)
    return folder / "params.yaml"


def test_a_sweep_makes_a_dataset_for_each_row_that_is_reproducible_alone(folder, capsys):
    store = folder / "store"
    given = [
        "sweep",
        table(folder, TABLE.replace("[7, 8]", "[8]")),
        "--store",
        f"{store.as_uri()}/",
    ]
    given += ["--groundray", PROGRAM, "--workers", 2]
    assert cluster(*given) == 0
    out = capsys.readouterr().out
    url = store.as_uri()
    assert f"{url}/0002: seed=8 lidars.front.mount.translation_m=[1, 0, 1.5]\n" in out
    assert {each.name for each in store.iterdir()} == {"0001", "0002"}
    for name in ("0001", "0002"):
        shutil.copy(store / name / "scene.yaml", folder / f"scene.{name}.yaml")
        alone = groundray("generate", folder / f"scene.{name}.yaml", "-o", folder / name)
        assert alone.returncode == 0, alone.stderr
        assert files(store / name / "dataset") == files(folder / name)
        assert cluster("verify", f"{url}/{name}") == 0
    first, second = (files(store / name / "dataset") for name in ("0001", "0002"))
    assert first["lidar/front/000000.ply"] != second["lidar/front/000000.ply"]
    assert first["lidar/top/000000.ply"] == second["lidar/top/000000.ply"]
    before = files(store)
    assert cluster(*given) == 0
    assert files(store) == before
    assert cluster(*arguments(folder / "scene.yaml", f"{url}/0001", shards=2)) == 1
    assert "it has a run of scene.0001.yaml with scene_sha256" in capsys.readouterr().err


WORLDS = """\
worlds:
  count: 50
  vary: {lidars.front.mount.pitch_deg: {normal: [0, 2]}}
"""


def test_worlds_are_runs_of_a_sweep_that_equal_those_of_generate(folder, capsys):
    scene = folder / "scene.yaml"
    scene.write_text(scene.read_text() + WORLDS)
    store = folder / "store"
    given = ["sweep", table(folder, "scene: scene.yaml\nshards: 2\nworlds: [30, 32]\n")]
    given += ["--store", store.as_uri(), "--groundray", PROGRAM, "--workers", 2]
    assert cluster(*given) == 0
    assert f"{store.as_uri()}/000031: world=31\n" in capsys.readouterr().out
    assert {each.name for each in store.iterdir()} == {"000030", "000031"}
    for world in (30, 31):
        alone = groundray("generate", scene, "--world", world, "-o", folder / f"{world}")
        assert alone.returncode == 0, alone.stderr
        assert files(store / f"{world:06}/dataset") == files(folder / f"{world}")


@pytest.mark.parametrize(
    ("worlds", "message"),
    [
        ("51", "worlds = 51 must be worlds of "),
        ("[7, 7]", "which has 50, from 0 on"),
        ("many", "worlds = many must be the number of worlds, or [from, to]"),
        ("3\nruns: [{}]", "it must have either vary, runs or worlds"),
    ],
)
def test_worlds_that_a_scene_does_not_have_are_named(folder, capsys, worlds, message):
    scene = folder / "scene.yaml"
    scene.write_text(scene.read_text() + WORLDS)
    text = f"scene: scene.yaml\nshards: 1\nworlds: {worlds}\n"
    assert cluster("sweep", table(folder, text), "--store", "file:///tmp/none") == 1
    assert message in capsys.readouterr().err


def test_rows_are_the_product_of_the_varied_values(folder):
    sweep = read_sweep(table(folder, TABLE))
    assert (sweep.shards, sweep.scene) == (2, folder / "scene.yaml")
    scenes = [yaml.safe_load(run.scene) for run in sweep.runs]
    heights = [[1, 0, 1], [1, 0, 1.5]]
    expected = [(seed, height) for seed in (7, 8) for height in heights]
    found = [(each["seed"], each["lidars"][1]["mount"]["translation_m"]) for each in scenes]
    assert found == expected
    whole = yaml.safe_load((folder / "scene.yaml").read_text())
    assert scenes[0] == whole  # the first row has the scene's own values
    assert whole != scenes[1]


def test_rows_may_be_listed_and_add_keys(folder):
    rows = "[{sky.sun.elevation_deg: 1.5e1}, {seed: 1, weather: {rain_mm_h: 1e0}}]"
    text = f"scene: scene.yaml\nshards: 1\nruns: {rows}\n"
    runs = read_sweep(table(folder, text)).runs
    assert [run.name for run in runs] == ["0001", "0002"]
    assert b"elevation_deg: 1.5e1" in runs[0].scene  # numbers keep their spelling
    assert b"rain_mm_h: 1e0" in runs[1].scene
    assert runs[1].parameters == "seed=1 weather={rain_mm_h: 1e0}"


def test_what_an_alias_shares_changes_only_where_it_is_named(folder):
    (folder / "scene.yaml").write_text("a: &both {x: 1, y: 2}\nb: *both\n")
    text = "scene: scene.yaml\nshards: 1\nvary: {b.x: [5]}\n"
    (run,) = read_sweep(table(folder, text)).runs
    assert yaml.safe_load(run.scene) == {"a": {"x": 1, "y": 2}, "b": {"x": 5, "y": 2}}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("scene: scene.yaml\n", "params.yaml: shards is missing"),
        ("scene: scene.yaml\nshards: 0\nruns: [{}]\n", "shards = 0 must be a whole number from 1"),
        ("scene: scene.yaml\nshards: 1\n", "it must have either vary, runs or worlds"),
        ("scene: scene.yaml\nshards: 1\nvary: {seed: 3}\n", "vary.seed must be a list"),
        ("scene: scene.yaml\nshards: 1\nruns: [3]\n", r"runs[0] must be a map"),
        ("scene: scene.yaml\nshards: 1\nruns: [{sky.moon.x: 3}]\n", "has no moon"),
        ("scene: scene.yaml\nshards: 1\nvary: {lidars.rear.name: [a]}\n", "has no rear"),
        (
            "scene: none.yaml\nshards: 1\nruns: [{}]\n",
            "none.yaml: cannot read it: No such file or directory; name a YAML file",
        ),
        ("scene: scene.yaml\nshard: 1\n", "unknown key shard; it may have scene, shards, vary"),
        ("scene: [\n", "params.yaml: while parsing"),
    ],
)
def test_faults_of_the_table_name_file_and_key(folder, capsys, text, message):
    assert cluster("sweep", table(folder, text), "--store", "file:///tmp/none") == 1
    assert message in capsys.readouterr().err


def test_a_foreign_file_in_the_place_of_a_scene_is_kept(folder, capsys):
    (folder / "scene.0001.yaml").write_text("mine")
    store = (folder / "store").as_uri()
    assert cluster("sweep", table(folder, TABLE), "--store", store) == 1
    assert "scene.0001.yaml: another file of this name exists" in capsys.readouterr().err
    assert (folder / "scene.0001.yaml").read_text() == "mine"
