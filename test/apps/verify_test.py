"""Checksums of datasets, compared with Python's, and the command that verifies them."""

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
    """Returns the lines that report faults; these or the final message must contain all words."""
    result = groundray("verify", dataset)
    assert result.returncode == 1, result.stdout
    said = result.stdout + result.stderr
    assert f"\ngroundray: {dataset}" in f"\n{said}" or (
        "groundray: 1 of 1 datasets is damaged or incomplete" in result.stderr
    )
    for word in words:
        assert word in said, said
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


def test_an_intact_dataset_passes(whole, tmp_path):
    count = len(files(whole))
    shutil.copytree(whole, tmp_path / "copy")
    result = groundray("verify", whole, tmp_path / "copy")
    assert result.returncode == 0, result.stderr
    assert result.stdout.count(f": {count} files of ") == 2
    assert result.stdout.count("all unchanged") == 2


def test_any_flipped_bit_is_detected(whole, tmp_path):
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
def test_truncated_extended_and_missing_files_are_detected(whole, tmp_path, path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    data = (whole / path).read_bytes()
    (copy / path).write_bytes(data[:-1])
    assert (
        len(faulty(copy, f"{path}: has {len(data) - 1} bytes instead of {len(data)}: truncated"))
        == 2
    )
    (copy / path).write_bytes(data + b"\n")
    assert len(faulty(copy, f"{path}: has {len(data) + 1} bytes", "data was appended")) == 2
    (copy / path).unlink()
    assert len(faulty(copy, f"{path}: missing")) == 2
    (copy / path).mkdir()
    faulty(copy, f"{path}: not a regular file")


def test_unexpected_files_are_detected_in_any_folder(whole, tmp_path):
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
    assert "2 of 3 datasets are damaged or incomplete" in result.stderr
    assert result.stdout.count(": missing") == 3
    assert f"{whole}: {len(files(whole))} files" in result.stdout
    assert f"{tmp_path / 'nothing'}: there is no such file or folder" in result.stdout


def test_a_truncated_record_is_detected(whole, tmp_path):
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


@pytest.mark.parametrize("path", ["x0", "calibration/../x"])
def test_a_listed_file_that_no_run_has_is_detected(whole, tmp_path, path):
    """Even if the record's own checksum fits."""
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    above, _ = (whole / "dataset.yaml").read_text().rsplit("sha256_above", 1)
    above += f'  - {{path: "{path}", bytes: 1, sha256: "{"0" * 64}"}}\n'
    own = hashlib.sha256(above.encode()).hexdigest()
    (copy / "dataset.yaml").write_text(f'{above}sha256_above: "{own}"\n')
    faulty(copy, "dataset.yaml")


def test_an_incomplete_run_is_reported(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    (copy / "dataset.journal").write_text("")
    words = "unfinished: 0 of 9 frames are complete"
    faulty(
        copy, "dataset.journal: a run was interrupted", "--resume", f"groundray: {copy}: {words}"
    )


@pytest.mark.parametrize(
    ("key", "before"), [("kind", "kind: lidar"), ("name", 'name: "front"'), ("name", 'name: "eye"')]
)
@pytest.mark.parametrize("place", ["../x", "/tmp", "a/../../x", "top/../../x"])
def test_a_sensor_name_that_leads_out_of_the_dataset_is_a_fault(
    whole, tmp_path, key, before, place
):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    rewrite(copy, (before, f'{key}: "{place}"'))
    faulty(copy, f"{copy}/dataset.yaml:", f"key '{key}'", place)


def test_a_changed_line_hides_no_other_frame(whole, tmp_path):
    """Faults of later frames are reported too."""
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    (copy / "camera/eye/000002.exr").unlink()
    rewrite(copy, ('  - {sensor: "top", frame: 1', '  + {sensor: "top", frame: 1'))
    said = faulty(
        copy,
        "000002.exr: missing",
        ": changed since it was written",
        "000001.ply: of an unfinished frame",
    )
    assert "incomplete: 8 of 9 frames" in "".join(said)
    assert not any("frame" in line and "000002" in line for line in said)


def test_any_number_of_frames_is_counted_in_constant_time(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    rewrite(copy, ("frames: 3}", "frames: 4294967295}"), ("frames:\n", 'shard: "2/3"\nframes:\n'))
    begin = time.monotonic()
    faulty(copy, "incomplete: 2 of 1431655767 frames")  # the others are not the shard's
    assert "2 of 1431655767" in groundray("info", copy).stdout
    assert time.monotonic() - begin < 5


def test_linked_folders_are_verified(whole, tmp_path):
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


def test_an_unreadable_file_is_a_fault_and_all_others_are_reported(whole, tmp_path):
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
    assert "2 of 3 datasets are damaged or incomplete" in result.stderr
    for words in (
        "poses/top.tum: missing",
        "lidar/top/000001.ply: unreadable: Too many",
        "camera/eye/000000.exr: unreadable: Too many",
        "dataset.journal: ",
        f"{loop}/dataset.yaml: it cannot be read: Too many",
        f"{whole}: {len(files(whole))} files",
    ):
        assert words in result.stdout, result.stdout


def test_leftovers_of_an_interrupted_merge_are_reported(whole, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(whole, copy)
    text = (copy / "dataset.yaml").read_text()
    text = re.sub(r"state: done.*", "state: pending}", text)
    (copy / "dataset.yaml").write_text(text)
    rewrite(copy)
    said = faulty(copy, "incomplete: 0 of 9 frames", "`groundray merge --resume`")
    frames = [p for p in files(whole) if p.startswith(("lidar/", "camera/"))]
    for path in frames:
        assert any(f"{path}: of an unfinished frame" in line for line in said), path
    assert len(said) == len(frames) + 2


def test_info_reads_a_folder_without_a_dataset_as_a_raster(tmp_path):
    result = groundray("info", tmp_path)
    assert result.returncode == 1
    assert "dataset.yaml" not in result.stderr
    assert str(tmp_path) in result.stderr


def test_info_describes_a_dataset(whole):
    said = groundray("info", whole).stdout
    for words in (
        "9 of 9 frames are complete",
        "seed      7",
        "lidar     front: Velodyne",
        "3 of 3",
    ):
        assert words in said
