"""Checksums of datasets, held against Python's, and the command that checks them."""

import hashlib
import random
import re
import shutil
import time

import pytest
import yaml
from dataset_runs import files, groundray, make_whole, rewrite


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return make_whole(tmp_path_factory.mktemp("whole"))


def sum_of(data):
    return {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}


def faulty(dataset, *words):
    """Returns the lines that tell of its faults, all these words among them."""
    result = groundray("verify", dataset)
    assert result.returncode == 1, result.stdout
    assert result.stderr.splitlines()[-1].startswith("groundray: 1 of 1 datasets is at fault")
    for word in words:
        assert word in result.stdout, result.stdout
    return result.stdout.splitlines()


def test_every_file_is_listed_with_its_size_and_sha_256(whole):
    there = files(whole)
    text = there.pop("dataset.yaml")
    record = yaml.safe_load(text)
    above, last = text.rsplit(b"sha256_above", 1)
    assert record["sha256_above"] == hashlib.sha256(above).hexdigest()
    assert last.count(b"\n") == 1
    listed = {f["path"]: {k: f[k] for k in ("bytes", "sha256")} for f in record["files"]}
    kinds = {s["name"]: s["kind"] for s in record["sensors"]}
    for frame in record["frames"]:
        stem = f"{kinds[frame['sensor']]}/{frame['sensor']}/{frame['frame']:06}"
        listed |= {stem + suffix: file for suffix, file in frame["files"].items()}
    assert listed == {path: sum_of(data) for path, data in there.items()}


def test_a_sound_dataset_passes(whole, tmp_path):
    count = len(files(whole))
    shutil.copytree(whole, tmp_path / "copy")
    result = groundray("verify", whole, tmp_path / "copy")
    assert result.returncode == 0, result.stderr
    assert result.stdout.count(f": {count} files of ") == 2
    assert result.stdout.count("all as they were written") == 2


def test_any_flipped_bit_is_found(whole, tmp_path):
    """One bit of each file, and of 22 bytes of the record, one after the other."""
    draw = random.Random(5)
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    for path, data in files(whole).items():
        flipped = bytearray(data)
        flipped[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
        (copy / path).write_bytes(flipped)
        said = faulty(copy)
        assert any(path in line for line in said), (path, said)
        (copy / path).write_bytes(data)
    record = (whole / "dataset.yaml").read_bytes()
    for place in [*draw.sample(range(len(record)), 20), len(record) - 1, len(record) - 10]:
        flipped = bytearray(record)
        flipped[place] ^= 1 << draw.randrange(8)
        (copy / "dataset.yaml").write_bytes(flipped)
        faulty(copy, "dataset.yaml")
    (copy / "dataset.yaml").write_bytes(record)
    assert groundray("verify", copy).returncode == 0


@pytest.mark.parametrize(
    "path", ["lidar/front/000001_no_returns.ply", "camera/eye/000000.exr", "poses/top.tum"]
)
def test_a_file_that_is_cut_short_longer_or_gone_is_found(whole, tmp_path, path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    data = (whole / path).read_bytes()
    (copy / path).write_bytes(data[:-1])
    assert len(faulty(copy, f"{path}: of {len(data) - 1} bytes instead of {len(data)}: cut")) == 2
    (copy / path).write_bytes(data + b"\n")
    assert len(faulty(copy, f"{path}: of {len(data) + 1} bytes", "something was added")) == 2
    (copy / path).unlink()
    assert len(faulty(copy, f"{path}: missing")) == 2
    (copy / path).mkdir()
    faulty(copy, f"{path}: no file any more")


def test_a_file_more_is_found_wherever_it_is(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    strangers = [
        "notes.txt",
        "lidar/top/000003.ply",
        "lidar/000000.ply",
        "more/deep/file",
        "poses/.x",
    ]
    (copy / "more/deep").mkdir(parents=True)
    for name in strangers:
        (copy / name).write_text("")
    (copy / "link").symlink_to("dataset.yaml")
    said = faulty(copy, *(f"{copy / name}: not a file of the dataset" for name in strangers))
    assert len(said) == len(strangers) + 2
    assert f"{copy}/link: not a file of the dataset" in said


def test_all_faults_are_listed_and_all_datasets_are_checked(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    for name in ("lidar/top/000000.ply", "lidar/top/000002.ply", "calibration/eye.yaml"):
        (copy / name).unlink()
    result = groundray("verify", copy, whole, tmp_path / "nothing")
    assert result.returncode == 1
    assert "2 of 3 datasets are at fault" in result.stderr
    assert result.stdout.count(": missing") == 3
    assert f"{whole}: {len(files(whole))} files" in result.stdout
    assert "holds no dataset.yaml" in result.stdout


def test_a_record_that_was_cut_short_is_found(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    text = (whole / "dataset.yaml").read_bytes()
    for size in (
        0,
        100,
        text.index(b"frames:\n") + 300,
        text.index(b"files:\n") + 20,
        len(text) - 1,
    ):
        (copy / "dataset.yaml").write_bytes(text[:size])
        faulty(copy, "dataset.yaml")


def test_a_run_that_was_cut_off_is_told(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    (copy / "dataset.journal").write_text("")
    faulty(copy, "dataset.journal: a run was cut off", "--resume")


@pytest.mark.parametrize(
    ("key", "before"), [("kind", "kind: lidar"), ("name", 'name: "front"'), ("name", 'name: "eye"')]
)
@pytest.mark.parametrize("place", ["../x", "/tmp", "a/../../x", "top/../../x"])
def test_a_sensor_named_as_a_place_elsewhere_is_a_fault(whole, tmp_path, key, before, place):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    rewrite(copy, (before, f'{key}: "{place}"'))
    faulty(copy, f"{copy}/dataset.yaml:", f"key '{key}'", place)


def test_a_line_that_was_changed_hides_no_frame(whole, tmp_path):
    """Faults of frames after it are told too."""
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    (copy / "camera/eye/000002.exr").unlink()
    rewrite(copy, ('  - {sensor: "top", frame: 1', '  + {sensor: "top", frame: 1'))
    said = faulty(
        copy, "000002.exr: missing", ": not as it was written", "000001.ply: of a frame that is not"
    )
    assert "incomplete: 8 of 9 frames" in "".join(said)
    assert not any("frame" in line and "000002" in line for line in said)


def test_any_number_of_frames_is_reckoned_at_once(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    rewrite(copy, ("frames: 3}", "frames: 4294967295}"), ("frames:\n", 'shard: "2/3"\nframes:\n'))
    begin = time.monotonic()
    faulty(copy, "incomplete: 9 of 1431655767 frames")
    assert "9 of 1431655767" in groundray("info", copy).stdout
    assert time.monotonic() - begin < 5


def test_folders_that_are_links_are_gone_through(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    for name in ("lidar/top", "lidar", "poses"):
        elsewhere = tmp_path / f"elsewhere_{name.replace('/', '_')}"
        (copy / name).rename(elsewhere)
        (copy / name).symlink_to(elsewhere)
    assert groundray("verify", copy).returncode == 0
    (copy / "lidar/top/notes.txt").write_text("")
    (copy / "more").symlink_to(tmp_path)
    assert len(faulty(copy, "lidar/top/notes.txt: not a file", "more: not a file")) == 3


def test_what_cannot_be_read_is_a_fault_and_all_others_are_told(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    (copy / "poses/top.tum").unlink()
    for name in ("lidar/top/000001.ply", "dataset.journal"):
        (copy / name).unlink(missing_ok=True)
        (copy / name).symlink_to((copy / name).name)
    shutil.rmtree(copy / "camera")
    (copy / "camera").symlink_to("camera")
    loop = tmp_path / "loop"
    loop.symlink_to("loop")
    result = groundray("verify", copy, loop, whole)
    assert result.returncode == 1
    assert "2 of 3 datasets are at fault" in result.stderr
    for words in (
        "poses/top.tum: missing",
        "lidar/top/000001.ply: not to be read: Too many",
        "camera/eye/000000.exr: not to be read: Too many",
        "dataset.journal: ",
        f"{loop}: the folder holds no dataset.yaml that can be read (Too many",
        f"{whole}: {len(files(whole))} files",
    ):
        assert words in result.stdout, result.stdout


def test_what_a_merge_left_that_was_cut_off_is_told(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    text = (copy / "dataset.yaml").read_text()
    text = re.sub(r"state: done.*", "state: pending}", text)
    (copy / "dataset.yaml").write_text(text)
    rewrite(copy)
    said = faulty(copy, "incomplete: 0 of 9 frames", "`groundray merge --resume`")
    frames = [p for p in files(whole) if p.startswith(("lidar/", "camera/"))]
    for path in frames:
        assert any(f"{path}: of a frame that is not done" in line for line in said), path
    assert len(said) == len(frames) + 2


def test_info_of_a_folder_that_is_no_dataset_is_that_of_a_raster(tmp_path):
    result = groundray("info", tmp_path)
    assert result.returncode == 1
    assert "dataset.yaml" not in result.stderr
    assert str(tmp_path) in result.stderr


def test_info_tells_what_is_there(whole):
    said = groundray("info", whole).stdout
    for words in ("9 of 9 frames are there", "seed      7", "lidar     front: Velodyne", "3 of 3"):
        assert words in said
