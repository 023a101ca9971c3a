"""Label sets, and the export of labels in their numbers."""

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from export_runs import ROOT, export, fails, run_folder, scans
from groundray.export.label_sets import find_set, set_names

FACTS = (
    Path(os.environ.get("GROUNDRAY_SHARED_DATA", ROOT / "../shared/data")).parent
    / "facts/labels.yaml"
)
CLASSES = {10: "vehicle", 40: "ground", 70: "rock", 72: "grass"}


def files_of_sets():
    return {
        file.stem: yaml.safe_load(file.read_text())
        for file in sorted((ROOT / "data/labels").glob("*.yaml"))
    }


@pytest.mark.parametrize("name", sorted(files_of_sets()))
def test_a_set_is_consistent(name):
    said = files_of_sets()[name]
    numbers = [each["id"] for each in said["labels"]]
    assert len(set(numbers)) == len(numbers)
    assert len({each["name"] for each in said["labels"]}) == len(numbers)
    for each in said["labels"]:
        assert len(each["colour"]) == 3
        assert all(0 <= value <= 255 for value in each["colour"])
    assert set(said["of"].values()) | {said["nothing"]} <= set(numbers)
    assert set(said["nearest"]) <= set(said["of"])
    header = (ROOT / "apps/scene/readers/class_reader.cpp").read_text()
    known = re.search(r"classes_of_surfaces\{(.*?)\};", header, re.DOTALL)
    assert set(said["of"]) <= set(re.findall(r'"(\w+)"', known[1]))


@pytest.mark.skipif(not FACTS.is_file(), reason=f"{FACTS} with the figures of the sets is missing")
@pytest.mark.parametrize("name", sorted(files_of_sets()))
def test_a_set_agrees_with_its_sources(name):
    ours, theirs = files_of_sets()[name], yaml.safe_load(FACTS.read_text())["label_sets"][name]
    expected = [(each["id"], each["name"], each["color"]) for each in theirs["labels"]]
    found = [(each["id"], each["name"], each["colour"]) for each in ours["labels"]]
    assert found == [each for each in expected if each[0] >= 0]
    assert ours.get("licence") == theirs["licence"]
    for source in theirs["source"]:
        assert source in ours["sources"]


def test_the_page_states_the_numbers_of_the_files():
    rows = [
        [cell.strip(" `") for cell in line.strip("|").split("|")]
        for line in (ROOT / "docs/reference/labels.md").read_text().splitlines()
        if line.startswith("| ")
    ]
    names = rows[0][1:]
    sets = files_of_sets()
    assert names == sorted(sets)
    table = {row[0]: row[1:] for row in rows[1:] if len(row) == len(rows[0])}
    for i, name in enumerate(names):
        said = sets[name]
        assert table["nothing hit"][i] == str(said["nothing"])
        for ours, cells in table.items():
            if ours == "nothing hit":
                continue
            star = "*" if ours in said["nearest"] else ""
            number = said["of"].get(ours)
            assert cells[i] == ("" if number is None else f"{number}{star}")


def channels(camera, frame):
    import OpenEXR

    file = run_folder() / f"camera/{camera}/{frame:06}.exr"
    with OpenEXR.File(str(file), separate_channels=True) as exr:
        return {name: each.pixels for name, each in exr.channels().items()}


def png(file):
    import cv2

    return cv2.imread(str(file), cv2.IMREAD_UNCHANGED)


@pytest.mark.parametrize(("name", "word"), [("rellis_3d", "rellis"), ("semantic_kitti", "sem")])
def test_images_and_points_have_the_numbers_of_the_set(tmp_path, capsys, name, word):
    out = tmp_path / "out"
    assert export("labels", out, "--labels", word) == 0
    said = files_of_sets()[name]
    assert "has no class of its own for" in capsys.readouterr().out  # rock, at least
    number = {label: said["of"][what] for label, what in CLASSES.items()} | {0: said["nothing"]}
    colours = {each["id"]: each["colour"] for each in said["labels"]}
    record = json.loads((out / "left/panoptic.json").read_text())
    assert {each["id"]: each["name"] for each in record["categories"]} == {
        each["id"]: each["name"] for each in said["labels"]
    }
    for camera in ("left", "eye"):
        record = json.loads((out / camera / "panoptic.json").read_text())
        for image, annotation in zip(record["images"], record["annotations"], strict=True):
            layers = channels(camera, image["id"])
            expected = np.vectorize(number.get)(layers["Label"])
            label = png(out / camera / f"{image['id']:06}_label.png")
            assert label.dtype == (np.uint16 if name == "semantic_kitti" else np.uint8)
            assert (label == expected).all()
            colour = png(out / camera / f"{image['id']:06}_colour.png")[..., ::-1]
            assert (
                colour == np.array([colours[n] for n in expected.flat]).reshape(colour.shape)
            ).all()
            coded = png(out / camera / annotation["file_name"])[..., ::-1].astype(int)
            ids = coded[..., 0] + 256 * coded[..., 1] + 65536 * coded[..., 2]
            told = {each["id"]: each for each in annotation["segments_info"]}
            assert set(np.unique(ids)) == set(told)
            for segment, each in told.items():
                mask = ids == segment
                assert each["area"] == mask.sum()
                assert set(expected[mask]) == {each["category_id"]}
                assert set(layers["Instance"][mask]) == {each["instance_id"]}
                rows, columns = np.nonzero(mask)
                left, top, width, height = each["bbox"]
                assert (left, top) == (columns.min(), rows.min())
                assert (left + width, top + height) == (columns.max() + 1, rows.max() + 1)
            pairs = {(each["category_id"], each["instance_id"]) for each in told.values()}
            assert len(pairs) == len(told)
    lines = (out / "top/instances.txt").read_text().splitlines()[1:]  # there are many tufts
    renumbered = {}
    for line in lines:
        theirs, short, instance = map(int, line.split())
        renumbered[theirs, short] = instance
    for i, (_, rows) in enumerate(scans("top")):
        values = np.fromfile(out / f"top/{i:06}.label", dtype="<u4")
        assert (values & 0xFFFF == np.vectorize(number.get)(rows["label"])).all()
        for value, instance in zip(values, rows["instance"], strict=True):
            short = int(value) >> 16
            assert (renumbered[int(value) & 0xFFFF, short] if short else 0) == instance


def test_a_set_maps_the_classes_of_semantic_kitti_and_las(tmp_path):
    import laspy

    assert export("semantic-kitti", tmp_path / "a", "--labels", "goose", "--lidar", "bare-16") == 0
    rows = next(scans("bare-16"))[1]
    expected = np.vectorize({10: 12, 40: 31, 70: 40, 72: 50}.get)(rows["label"])
    values = np.fromfile(tmp_path / "a/sequences/00/labels/000000.label", dtype="<u4")
    assert (values & 0xFFFF == expected).all()
    assert export("las", tmp_path / "b", "--labels", "goose", "--lidar", "bare-16") == 0
    las = laspy.read(tmp_path / "b/bare-16/000000.las")
    assert (np.asarray(las.classification) == expected).all()


def test_names_may_be_shortened_if_they_stay_unique():
    assert find_set("rellis").file.stem == "rellis_3d"
    assert find_set("goose").file.stem == "goose"  # which begins another name, too
    assert set(set_names()) == set(files_of_sets())


@pytest.fixture
def run(tmp_path):
    import shutil

    return shutil.copytree(run_folder(), tmp_path / "run")


def restated(run, classes):
    file = run / "dataset.yaml"
    text = file.read_text()
    line = re.search(r"(?m)^classes: .*\n", text)
    assert line
    file.write_text(text.replace(line[0], classes, 1))


@pytest.mark.parametrize(
    ("classes", "options", "message"),
    [
        (None, ["--labels", "relis"], "is no set of labels, nor a file ending in .yaml; did you"),
        (None, ["--labels", "wild"], "begins several sets; "),
        (None, [], "--to labels needs --labels with the name of a set"),
        (None, ["--labels", "map.yaml"], "--to labels needs --labels with the name of a set"),
        ("", ["--labels", "rugd"], "it states no classes, which the set RUGD needs"),
        ("classes: {10: animal}\n", ["--labels", "rugd"], "has no number for the class animal"),
        (
            "classes: {10: vehicle}\n",
            ["--labels", "rugd"],
            "it has no number for the label 40",
        ),
        ("classes: [1]\n", ["--labels", "rugd"], "classes must be a map of labels to classes"),
    ],
)
def test_what_cannot_be_mapped_has_one_message(run, capsys, classes, options, message):
    if classes is not None:
        restated(run, classes)
    assert message in fails(capsys, run, "labels", *options)
