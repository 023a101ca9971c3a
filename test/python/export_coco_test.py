"""COCO annotations, read by pycocotools."""

import json
import shutil
from contextlib import redirect_stdout
from io import StringIO

import numpy as np
import pytest
from detection_runs import boxed_folder, boxes_of, instances_of
from export_runs import export, fails, names_in, run_folder

coco = pytest.importorskip("pycocotools.coco", reason="pip install -r test/requirements.txt")
from pycocotools import mask as masks  # noqa: E402
from pycocotools.cocoeval import COCOeval  # noqa: E402

NAMES = {4: "rock", 6: "tree", 10: "vehicle", 11: "person", 40: "ground"}


def quietly(work, *arguments):
    with redirect_stdout(StringIO()):
        return work(*arguments)


def read(out):
    return quietly(coco.COCO, str(out / "annotations/instances.json"))


@pytest.fixture(scope="module", params=["polygon", "rle"])
def exported(request, tmp_path_factory):
    out = tmp_path_factory.mktemp("coco") / "out"
    assert export("coco", out, "--segmentation", request.param, source=boxed_folder()) == 0
    return out


def images_of(data):
    """Yields each image with its annotations."""
    for image in data.loadImgs(data.getImgIds()):
        yield image, data.loadAnns(data.getAnnIds(imgIds=image["id"]))


def test_masks_and_rectangles_are_those_of_the_instances(exported):
    data = read(exported)
    assert len(data.imgs) == 24
    seen = set()
    for image, annotations in images_of(data):
        instances = instances_of(image["camera"], image["frame"])
        assert (image["height"], image["width"]) == instances.shape
        numbers = np.unique(instances[instances > 0]).tolist()
        assert [each["instance_id"] for each in annotations] == numbers
        for each in annotations:
            expected = instances == each["instance_id"]
            np.testing.assert_array_equal(data.annToMask(each), expected)
            assert each["area"] == np.count_nonzero(expected)
            assert not each["iscrowd"]
            rows, columns = np.nonzero(expected)
            left, top, width, height = each["bbox"]
            assert (left, top) == (columns.min(), rows.min())
            assert (left + width, top + height) == (columns.max() + 1, rows.max() + 1)
            # The same rectangle, computed by pycocotools from the mask.
            np.testing.assert_array_equal(masks.toBbox(data.annToRLE(each)), each["bbox"])
            seen.add(data.cats[each["category_id"]]["name"])
    assert seen == {"rock", "tree", "vehicle", "person"}


def test_categories_and_visibility_are_those_of_the_boxes(exported):
    data = read(exported)
    assert {each["id"]: each["name"] for each in data.dataset["categories"]} == NAMES
    hidden = 0
    for image, annotations in images_of(data):
        boxes = boxes_of(image["camera"], image["frame"])
        for each, box in zip(annotations, boxes, strict=True):
            assert each["category_id"] == box["label"]
            left, top, width, height = each["amodal_bbox"]
            assert (left, top) == (box["alone_u_min"], box["alone_v_min"])
            assert (left + width, top + height) == (box["alone_u_max"] + 1, box["alone_v_max"] + 1)
            assert each["amodal_area"] == box["alone"]
            assert each["visible_share"] == box["visible_share"]
            assert each["truncated_share"] == box["truncated_share"]
            hidden += each["visible_share"] < 0.7
    assert hidden > 10


def test_pictures_have_the_listed_names(exported):
    data = read(exported)
    for image, _ in images_of(data):
        recorded = boxed_folder() / f"camera/{image['camera']}/{image['frame']:06}.png"
        assert (exported / "images" / image["file_name"]).read_bytes() == recorded.read_bytes()
    assert names_in(exported / "images") == ["left", "right"]


def scores(truth, found):
    """Returns average precision and recall by COCO's own rules."""
    rating = COCOeval(truth, found, "segm")
    for step in (rating.evaluate, rating.accumulate, rating.summarize):
        quietly(step)
    return rating.stats[0], rating.stats[8]


def test_cocos_own_rating_accepts_the_truth_and_ignores_crowds(exported, tmp_path):
    options = ["--crowd-below-px", "4", "--segmentation", "rle"]
    assert export("coco", tmp_path / "out", *options, source=boxed_folder()) == 0
    truth, whole = read(tmp_path / "out"), read(exported)
    found = [
        {
            "image_id": each["image_id"],
            "category_id": each["category_id"],
            "segmentation": whole.annToRLE(each),
            "score": 1.0 / each["id"],
        }
        for each in whole.dataset["annotations"]
    ]
    crowds = [each for each in truth.dataset["annotations"] if each["iscrowd"]]
    assert len(crowds) > 10
    # Detections of what is in a crowd are neither right nor wrong. A hundred detections are rated
    # for each image and category, and no image here has more.
    assert scores(truth, quietly(truth.loadRes, found)) == (1, 1)
    for image, annotations in images_of(truth):
        instances = instances_of(image["camera"], image["frame"])
        boxes = boxes_of(image["camera"], image["frame"])
        for each in (each for each in annotations if each["iscrowd"]):
            of_category = (boxes["label"] == each["category_id"]) & (boxes["pixels"] < 4)
            joined = np.isin(instances, boxes["instance"][of_category])
            np.testing.assert_array_equal(truth.annToMask(each), joined)
            assert each["area"] == joined.sum()
        single = {each["instance_id"] for each in annotations if not each["iscrowd"]}
        assert single == set(boxes["instance"][boxes["pixels"] >= 4])


def test_polygons_are_rasterised_to_any_mask():
    """Seeded masks of all densities, holes and corners included; 300 masks."""
    from groundray.export.outlines import polygons

    random = np.random.default_rng(5)
    for _ in range(300):
        height, width = map(int, random.integers(1, 30, 2))
        mask = random.random((height + 3, width + 2)) < random.random()
        mask[:3] = mask[:, :2] = False
        if not mask.any():
            continue
        made = polygons(mask[3:, 2:], left=2, top=3)
        drawn = masks.decode(masks.merge(masks.frPyObjects(made, *map(int, mask.shape))))
        np.testing.assert_array_equal(drawn, mask)
        shoelace = 0.0
        for each in made:
            x, y = np.array(each[::2]), np.array(each[1::2])
            shoelace += (np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2
        assert shoelace == mask.sum()


def test_a_set_of_labels_names_the_categories(tmp_path, capsys):
    options = ["--labels", "rellis", "--camera", "left", "--boxes-of", "vehicle,4"]
    assert export("coco", tmp_path / "out", *options, source=boxed_folder()) == 0
    assert "note: RELLIS-3D has no class of its own for rock" in capsys.readouterr().out
    data = read(tmp_path / "out")
    assert {each["camera"] for each in data.dataset["images"]} == {"left"}
    used = {data.cats[each["category_id"]]["name"] for each in data.dataset["annotations"]}
    assert used == {"vehicle", "rubble"}
    assert data.cats[3]["name"] == "grass"


@pytest.fixture
def run(tmp_path):
    return shutil.copytree(boxed_folder(), tmp_path / "run")


def test_a_dataset_without_boxes_has_one_message(tmp_path, capsys):
    run = shutil.copytree(run_folder(), tmp_path / "run")
    line = fails(capsys, run, "coco")
    assert "it has no image with boxes, which coco needs; add boxes and truth to the prod" in line


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--boxes-of", "tree,cow"], "--boxes-of cow: it is no class or label of an object"),
        (["--boxes-of", "ground"], "has person, rock, tree, vehicle, 4, 6, 10, 11"),
        (["--labels", "map.yaml"], "coco needs the name of a set, such as rellis_3d"),
        (["--camera", "rear"], "it has no camera rear"),
    ],
)
def test_what_cannot_be_chosen_has_one_message(run, capsys, options, message):
    assert message in fails(capsys, run, "coco", *options)


def test_a_camera_without_boxes_is_left_out_with_a_note(run, capsys):
    for file in (run / "camera/right").glob("*_boxes.npy"):
        file.unlink()
    for file in (run / "camera/left").glob("??????.png"):
        file.unlink()
    assert export("coco", run.parent / "out", source=run) == 0
    said = capsys.readouterr().out
    assert "note: camera right has no boxes among its products: it is left out" in said
    assert "note: camera left has no pictures (product picture): no files of them" in said
    record = json.loads((run.parent / "out/annotations/instances.json").read_text())
    assert {each["camera"] for each in record["images"]} == {"left"}


def test_boxes_of_another_run_are_rejected(run, capsys):
    shutil.copy(
        run / "camera/left/000004_boxes.npy",
        run / "camera/left/000001_boxes.npy",
    )
    assert "are both from the same run?" in fails(capsys, run, "coco", "--camera", "left")
