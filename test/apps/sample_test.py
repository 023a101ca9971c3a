"""Worlds that are drawn from the distributions of a scene file."""

import csv
import io
import os
import random
import sys

import pytest
import yaml
from dataset_runs import ROOT, SCENE, command, files, generate, groundray

IS_FULL = os.environ.get("GROUNDRAY_PROOF") == "full"
COUNT = 10000
VARIED = (
    SCENE.replace("terrain: {dem", "weather: {group_index: 1.0003}\nterrain: {dem")
    + f"""\
worlds:
  count: {COUNT}
  vary:
    sky.sun.elevation_deg: {{uniform: [8, 65]}}
    weather.visibility_m: {{log_uniform: [500, 20000]}}
    lidars.top.mount.pitch_deg: {{normal: [5, 0.3]}}
    objects.rock: {{present: 0.5}}
    objects.rock.variant: {{whole: [0, 9]}}
    ground:
      table: {{columns: [terrain.material, duration_s], rows: [[dry_soil, 0.2], [gravel, 0.3]]}}
"""
)
KEYS = [
    *("sky.sun.elevation_deg", "weather.visibility_m", "lidars.top.mount.pitch_deg"),
    *("objects.rock", "objects.rock.variant", "terrain.material", "duration_s"),
]


@pytest.fixture
def folder(tmp_path):
    command(tmp_path, scene=VARIED)  # writes the files
    return tmp_path


def sample(folder, *more):
    python = {"GROUNDRAY_PYTHON": sys.executable, "PYTHONPATH": str(ROOT / "build/release/python")}
    return groundray("sample", folder / "scene.yaml", *more, env={**os.environ, **python})


def make(folder, *more, out):
    result = generate(folder, *more, scene=VARIED, out=out)
    assert result.returncode == 0, result.stderr
    return folder / out


def test_worlds_are_the_same_in_shards_and_from_their_own_scene_files(folder):
    chosen = random.Random(32).sample(range(COUNT), 20 if IS_FULL else 2)
    for world in chosen:
        whole = make(folder, "--world", world, out=f"{world}")
        shards = [
            make(folder, "--world", world, "--shard", f"{k}/3", out=f"{world}_{k}")
            for k in (3, 1, 2)
        ]
        assert groundray("merge", *shards, "-o", folder / f"{world}_joined").returncode == 0
        assert files(folder / f"{world}_joined") == files(whole)
        text = sample(folder, "--index", world).stdout
        printed = folder / f"scene.{world}.yaml"
        printed.write_text(text)
        alone = groundray("generate", printed, "-o", folder / f"{world}_alone")
        assert alone.returncode == 0, alone.stderr
        assert files(folder / f"{world}_alone") == files(whole)
        record = yaml.safe_load((whole / "dataset.yaml").read_text())
        assert record["world"] == world
        assert list(record["drawn"]) == KEYS
        assert record["scene"] == text
        assert yaml.safe_load(text)["world"] == {"number": world, "drawn": record["drawn"]}


def test_the_table_has_the_values_of_the_scenes(folder):
    table = list(csv.DictReader(io.StringIO(sample(folder, "--count", 50).stdout)))
    assert [row["world"] for row in table] == [str(world) for world in range(50)]
    assert list(table[0]) == ["world", "seed", *KEYS]
    for world, row in list(enumerate(table))[::10]:
        scene = yaml.safe_load(sample(folder, "--index", world).stdout)
        assert scene["seed"] == int(row["seed"])
        assert scene["sky"]["sun"]["elevation_deg"] == float(row["sky.sun.elevation_deg"])
        assert scene["weather"]["visibility_m"] == float(row["weather.visibility_m"])
        assert scene["lidars"][0]["mount"]["pitch_deg"] == float(row["lidars.top.mount.pitch_deg"])
        assert scene["terrain"]["material"] == row["terrain.material"]
        assert scene["duration_s"] == float(row["duration_s"])
        assert [each["name"] for each in scene["objects"]] == (
            ["rock"] if row["objects.rock"] == "true" else []
        )
        assert "worlds" not in scene
    assert {row["objects.rock"] for row in table} == {"true", "false"}
    written = sample(folder, "--count", 50, "-o", folder / "table.csv")
    assert written.returncode == 0, written.stderr
    assert (folder / "table.csv").read_text() == sample(folder, "--count", 50).stdout


def test_the_table_as_parquet_has_types_and_equal_values(folder):
    parquet = pytest.importorskip("pyarrow.parquet")
    out = folder / "table.parquet"
    result = sample(folder, "-o", out)
    assert result.returncode == 0, result.stderr
    table = parquet.read_table(out)
    assert table.num_rows == COUNT
    rows = list(csv.DictReader(io.StringIO(sample(folder).stdout)))
    types = dict(zip(table.column_names, map(str, table.schema.types), strict=True))
    assert types["seed"] == "uint64"
    assert types["objects.rock"] == "bool"
    assert types["objects.rock.variant"] == "int64"
    assert types["terrain.material"] == "string"
    for name, kind in (("weather.visibility_m", float), ("seed", int), ("terrain.material", str)):
        assert table.column(name).to_pylist() == [kind(row[name]) for row in rows]
    first = out.read_bytes()
    assert sample(folder, "-o", out).returncode == 0
    assert out.read_bytes() == first


def test_check_finds_worlds_that_break_a_rule(folder):
    assert sample(folder, "--count", 20, "--check").returncode == 0
    scene = folder / "scene.yaml"
    scene.write_text(VARIED.replace("{log_uniform: [500,", "{uniform: [-500,"))
    result = sample(folder, "--check", "--count", 300)
    assert result.returncode == 1
    line = 1 + VARIED[: VARIED.index("weather.visibility_m")].count("\n")
    assert f"scene.yaml:{line}:27: key 'visibility_m': is -" in result.stderr
    assert ", but must be > 0" in result.stderr
    assert "which `groundray sample --index" in result.stderr
    assert sample(folder, "--count", 300).returncode == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["sample", "--index", COUNT], f"count': is {COUNT}, so that the worlds are 0 to 9999"),
        (["sample", "--count", COUNT + 1], f"--count {COUNT + 1}: the scene has {COUNT} worlds"),
        (["generate", "-o", "out", "--world", COUNT], f"there is no world {COUNT}"),
        (["sample", "-o", "table.txt"], "table.txt"),
        (["sample", "--index", 3, "-o", "world.csv"], "world.csv"),
    ],
)
def test_wrong_numbers_and_names_have_one_message(folder, words, message):
    command_word, *more = words
    result = groundray(command_word, folder / "scene.yaml", *more, cwd=folder)
    assert result.returncode == 1
    assert message in result.stderr
    assert sorted(each.name for each in folder.iterdir()) == ["camera.yaml", "scene.yaml"]


def test_a_world_excludes_a_seed_and_needs_the_block(folder):
    result = groundray(
        *("generate", folder / "scene.yaml", "-o", folder / "out", "--world", 3, "--seed", 4)
    )
    assert result.returncode == 2
    assert "--seed" in result.stderr
    (folder / "scene.yaml").write_text(SCENE)
    for result in (
        generate(folder, "--world", 3),
        sample(folder),
    ):
        assert result.returncode == 1
        assert "it has no block `worlds`" in result.stderr


def test_a_scene_with_worlds_is_generated_as_written_with_a_note(folder):
    result = generate(folder, scene=VARIED)
    assert result.returncode == 0, result.stderr
    assert f"chooses one of its {COUNT} worlds" in result.stderr
    record = yaml.safe_load((folder / "out/dataset.yaml").read_text())
    assert record["seed"] == 7
    assert "world" not in record
