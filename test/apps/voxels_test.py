"""Voxels of scans: triangles are clipped by NumPy, files read as semantic-kitti-api reads them."""

import subprocess

import numpy as np
import pytest
import scipy.linalg
import scipy.ndimage
import yaml
from dataset_runs import files, groundray
from plyfile import PlyData
from scipy.spatial.transform import Rotation

SIZE, LOW, SIDE = (256, 256, 32), np.array([0, -25.6, -2]), 0.2
# A block of 3 m x 2 m x 1.5 m, turned; a sheet of half a voxel.
CRATE = """\
v -1.5 -1 0
v 1.5 -1 0
v 1.5 1 0
v -1.5 1 0
v -1.5 -1 1.5
v 1.5 -1 1.5
v 1.5 1 1.5
v -1.5 1 1.5
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
f 5 6 7 8
f 4 3 2 1
"""
SCENE = """\
groundray: 1
seed: 3
duration_s: 0.5
terrain: {dem: dem.tif, label: 1}
classes: {1: ground, 5: rock, 9: vehicle}
platform:
  drive: {waypoints_m: [[500050, 4000050], [500090, 4000055]], speed_m_s: 8, height_m: 0.5}
objects:
  - {name: crate, label: 5, model: crate.obj, at_m: [500064, 4000055], yaw_deg: 33, pitch_deg: 8}
  - name: mover
    label: 9
    model: crate.obj
    drive:
      waypoints_m: [[500075, 4000045], [500075, 4000065]]
      speed_m_s: 6
      height_m: 0.1
lidars:
  - name: top
    preset: velodyne_vlp16
    mount: {translation_m: [0.3, 0, 1.2], pitch_deg: 2, yaw_deg: 4}
"""


def unpack(compressed):
    """Returns the flags of packed bytes, as SemanticKITTI's SSCDataset does."""
    flags = np.zeros(compressed.size * 8, dtype=np.uint8)
    for bit in range(8):
        flags[bit::8] = compressed >> (7 - bit) & 1
    return flags


def read_voxels(stem):
    found = {"label": np.fromfile(f"{stem}.label", dtype=np.uint16)}
    for name in ("bin", "invalid", "occluded", "seen"):
        found[name] = unpack(np.fromfile(f"{stem}.{name}", dtype=np.uint8))
    return {name: values.reshape(SIZE) for name, values in found.items()}


def heights():
    rng = np.random.default_rng(8)
    y, x = np.mgrid[100:-1:-4, 0:101:4]
    return (0.05 * x + np.sin(y / 9) + rng.normal(0, 0.3, x.shape)).astype(np.float32), x, y


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A scene on a DEM with cells of 4 m, with its dataset and voxels."""
    folder = tmp_path_factory.mktemp("voxels")
    z, _, _ = heights()
    rows = "\n".join(" ".join(f"{value:.9g}" for value in row) for row in z)
    head = f"ncols 26\nnrows 26\nxllcenter 500000\nyllcenter 4000000\ncellsize 4\n{rows}\n"
    (folder / "dem.asc").write_text(head)
    translate = ["gdal_translate", "-q", "-a_srs", "EPSG:32631", "-ot", "Float32"]
    subprocess.run([*translate, folder / "dem.asc", folder / "dem.tif"], check=True)
    (folder / "crate.obj").write_text(CRATE)
    (folder / "scene.yaml").write_text(SCENE)
    for arguments in (
        ("generate", folder / "scene.yaml", "-o", folder / "run"),
        ("voxels", folder / "scene.yaml", "-o", folder / "own", "--frames", "::3"),
    ):
        result = groundray(*arguments)
        assert result.returncode == 0, result.stderr
    return folder


@pytest.fixture(scope="module")
def voxels(folder):
    stems = [folder / f"own/sequences/00/voxels/{number:06}" for number in (0, 3)]
    return {int(stem.name): read_voxels(stem) for stem in stems}


class Path:
    """Recorded poses of the lidar, and the times of its scans."""

    def __init__(self, run):
        self.record = yaml.safe_load((run / "dataset.yaml").read_text())
        self.rows = np.loadtxt(run / "poses/top.tum")
        frames = [f for f in self.record["frames"] if f["sensor"] == "top"]
        self.stamps = [f["stamp_s"] for f in frames]

    def world_from_lidar(self, time):
        """Returns rotation and position, between rows at constant twist."""
        i = min(np.searchsorted(self.rows[:, 0], time, side="right"), len(self.rows) - 1)
        before, after = (self.pose(row) for row in self.rows[i - 1 : i + 1])
        share = (time - self.rows[i - 1, 0]) / (self.rows[i, 0] - self.rows[i - 1, 0])
        twist = scipy.linalg.logm(np.linalg.solve(before, after)).real
        pose = before @ scipy.linalg.expm(share * twist)
        return pose[:3, :3], pose[:3, 3]

    @staticmethod
    def pose(row):
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_quat(row[4:8]).as_matrix()
        pose[:3, 3] = row[1:4]
        return pose


def ground_triangles(origin):
    z, x, y = heights()
    p = np.stack([x + 500000 - origin[0], y + 4000000 - origin[1], z.astype(float)], axis=-1)
    nw, ne, sw, se = p[:-1, :-1], p[:-1, 1:], p[1:, :-1], p[1:, 1:]
    both = [np.stack([nw, ne, sw], axis=2), np.stack([se, sw, ne], axis=2)]
    return np.concatenate([half.reshape(-1, 3, 3) for half in both])


def crate_triangles(rotation, position):
    vertices = [line.split()[1:] for line in CRATE.splitlines() if line[0] == "v"]
    points = np.array(vertices, dtype=float) @ rotation.T + position
    faces = [
        [int(i) - 1 for i in line.split()[1:]] for line in CRATE.splitlines() if line[0] == "f"
    ]
    return np.array([points[[f[0], f[i], f[i + 1]]] for f in faces for i in (1, 2)])


def clip(polygon, axis, low, high):
    for sign, bound in ((1, low), (-1, -high)):
        depth = sign * polygon[:, axis] - bound
        kept = []
        for i, (p, d) in enumerate(zip(polygon, depth, strict=True)):
            j = (i + 1) % len(polygon)
            if d >= 0:
                kept.append(p)
            if d * depth[j] < 0:
                kept.append(p + (polygon[j] - p) * (d / (d - depth[j])))
        polygon = np.array(kept).reshape(-1, 3)
        if len(polygon) == 0:
            return None
    return polygon


def layers_of(polygon, axis):
    """Yields the polygon's parts between the planes of voxels along an axis."""
    at = (np.array([polygon[:, axis].min(), polygon[:, axis].max()]) - LOW[axis]) / SIDE
    first, last = np.floor(at).astype(int)
    for k in range(max(first, 0), min(last, SIZE[axis] - 1) + 1):
        part = clip(polygon, axis, LOW[axis] + SIDE * k, LOW[axis] + SIDE * (k + 1))
        if part is not None:
            yield k, part


def area(polygon):
    fans = np.cross(polygon[1:-1] - polygon[0], polygon[2:] - polygon[0])
    return np.linalg.norm(fans, axis=1).sum() / 2


def clipped_labels(triangles):
    """Returns the label with the largest area in each voxel."""
    areas = {label: np.zeros(SIZE) for label in triangles}
    for label, of_label in triangles.items():
        for triangle in of_label:
            for i, slab in layers_of(triangle, 0):
                for j, column in layers_of(slab, 1):
                    for k, part in layers_of(column, 2):
                        areas[label][i, j, k] += area(part)
    names = sorted(areas)
    stack = np.stack([areas[name] for name in names])
    return np.where(stack.max(axis=0) > 0, np.array(names)[stack.argmax(axis=0)], 0), stack


@pytest.mark.parametrize("number", [0, 3])
def test_labels_are_those_of_clipped_triangles(folder, voxels, number):
    path = Path(folder / "run")
    origin = path.record["origin_w_m"]
    rotation, position = path.world_from_lidar(path.stamps[number])
    z, _, _ = heights()
    turned = Rotation.from_euler("ZYX", [33, 8, 0], degrees=True).as_matrix()
    at = np.array([500064 - origin[0], 4000055 - origin[1]])
    column, row = (at[0] + origin[0] - 500000) / 4, (100 - (at[1] + origin[1] - 4000000)) / 4
    across, down = column % 1, row % 1
    corner = z[int(row) :, int(column) :].astype(float)
    ground = (
        corner[0, 0] + across * (corner[0, 1] - corner[0, 0]) + down * (corner[1, 0] - corner[0, 0])
        if across + down <= 1
        else corner[1, 1]
        + (1 - across) * (corner[1, 0] - corner[1, 1])
        + (1 - down) * (corner[0, 1] - corner[1, 1])
    )
    triangles = {
        1: ground_triangles(origin),
        5: crate_triangles(turned, [*at, ground]),
    }
    in_lidar = {label: (of - position) @ rotation for label, of in triangles.items()}
    expected, areas = clipped_labels(in_lidar)
    ours = voxels[number]["label"].copy()
    movers = ours == 9
    assert 10 < movers.sum() < 2000
    ours[movers] = expected[movers]
    # The poses are those of a text of 17 digits: what lies within 1e-9 m of a voxel may differ.
    differ = ours != expected
    assert differ.sum() <= 3
    largest = np.sort(areas, axis=0)
    assert (largest[-1] - largest[-2])[differ & (ours > 0) & (expected > 0)].sum() < 1e-6
    assert (expected == 1).sum() > 20_000
    assert (expected == 5).sum() > 200


@pytest.mark.parametrize("number", [0, 3])
def test_scanned_voxels_hold_the_echoes_and_are_occupied(folder, voxels, number):
    path = Path(folder / "run")
    rotation, position = path.world_from_lidar(path.stamps[number])
    scan = PlyData.read(folder / f"run/lidar/top/{number:06}.ply")["vertex"]
    world = np.stack([scan[f"world_{axis}"] for axis in "xyz"], axis=1)
    at = ((world - position) @ rotation - LOW) / SIDE
    inside = np.all((at >= 0) & (at < SIZE), axis=1)
    edge = np.abs(at - np.round(at)).min(axis=1) < 1e-3  # floats of x, y and z
    echoes = np.floor(at[inside & ~edge]).astype(int)
    found = voxels[number]["bin"]
    assert len(echoes) > 3000
    assert (found[tuple(echoes.T)] == 1).all()
    assert found.sum() <= len(np.unique(np.floor(at[inside]), axis=0)) + edge[inside].sum()
    # All but echoes of the mover, which moves on between the stamp and its pulses.
    still = scan["label"][inside & ~edge] != 9
    assert (voxels[number]["label"][tuple(echoes[still].T)] != 0).mean() > 0.9999
    assert (voxels[number]["seen"][tuple(echoes.T)] == 1).mean() > 0.999


def first_occupied(occupied, start, end):
    """Returns whether a line meets an occupied voxel: by dense steps."""
    steps = np.linspace(0, 1, int(np.linalg.norm(end - start) / 0.002))[:, None]
    at = (start + steps * (end - start) - LOW) / SIDE
    inside = np.all((at >= 0) & (at < SIZE), axis=1)
    visited = np.floor(at[inside]).astype(int)
    return bool(occupied[tuple(visited.T)].any())


def test_visibility_is_that_of_lines_to_the_lidar(folder, voxels):
    path = Path(folder / "run")
    rotation, position = path.world_from_lidar(path.stamps[0])
    views = [path.world_from_lidar(stamp)[1] for stamp in path.stamps]
    views = [(view - position) @ rotation for view in views]
    found = voxels[0]
    occupied = found["label"] != 0
    assert (found["occluded"][occupied] == 1).all()
    assert (found["invalid"][occupied] == 0).all()
    assert (found["invalid"] <= found["occluded"]).all()
    assert 0 < found["invalid"].sum() < found["occluded"].sum() - occupied.sum()
    rng = np.random.default_rng(2)
    empty = np.argwhere(~occupied)
    wrong = 0
    for voxel in empty[rng.choice(len(empty), 400, replace=False)]:
        centre = LOW + SIDE * (voxel + 0.5)
        hidden = [first_occupied(occupied, centre, view) for view in views]
        wrong += found["occluded"][tuple(voxel)] != hidden[0]
        wrong += found["invalid"][tuple(voxel)] != all(hidden)
    assert wrong <= 8  # voxels crossed by less than the steps of 2 mm


@pytest.mark.parametrize("number", [0, 3])
def test_voxels_before_echoes_are_seen(folder, voxels, number):
    path = Path(folder / "run")
    rotation, position = path.world_from_lidar(path.stamps[number])
    scan = PlyData.read(folder / f"run/lidar/top/{number:06}.ply")["vertex"]
    scan = scan[scan["range_true"] > 10]
    world = np.stack([scan[f"world_{axis}"] for axis in "xyz"], axis=1)
    times = path.stamps[number] + scan["time"].astype(float)
    lidar = np.stack([np.interp(times, *path.rows[:, [0, i]].T) for i in (1, 2, 3)], axis=1)
    towards = (world - lidar) / np.linalg.norm(world - lidar, axis=1)[:, None]
    count = 0
    for before in (0.3, 1, 2, 5):
        at = ((world - before * towards - position) @ rotation - LOW) / SIDE
        # Beams begin up to 5 cm beside the lidar's origin: 2.5 cm at 5 m of 10 m.
        inside = np.all((at >= 0) & (at < SIZE), axis=1)
        inside &= np.abs(at - np.round(at)).min(axis=1) > 0.125
        assert (voxels[number]["seen"][tuple(np.floor(at[inside]).astype(int).T)] == 1).all()
        count += inside.sum()
    assert count > 1000


def test_no_voxel_below_the_ground_is_seen(voxels):
    for found in voxels.values():
        ground = found["label"] == 1
        lowest = np.where(ground.any(axis=2), ground.argmax(axis=2), 0)
        # The grid leans with the lidar: a vertical line leaves its column within 6.4 m.
        lowest = scipy.ndimage.minimum_filter(lowest, 7, mode="constant", cval=0)
        below = np.arange(SIZE[2]) < lowest[:, :, None]
        assert below.sum() > 10_000
        assert not found["seen"][below].any()
        assert found["seen"].sum() > 30_000


def test_label_sets_map_the_classes(folder, voxels):
    out = folder / "kitti"
    more = ("--labels", "semantic", "--frames", "0", "--views", 0)
    result = groundray("voxels", folder / "scene.yaml", "-o", out, *more)
    assert result.returncode == 0, result.stderr
    mapped = read_voxels(out / "sequences/00/voxels/000000")
    own = voxels[0]["label"]
    expected = np.select([own == 1, own == 5, own == 9], [72, 99, 10], 0)
    np.testing.assert_array_equal(mapped["label"], expected)
    # From one view alone, what is occluded and not occupied is invalid.
    empty = mapped["label"] == 0
    np.testing.assert_array_equal(mapped["invalid"][empty], mapped["occluded"][empty])


def test_voxels_have_the_same_bytes_for_any_number_of_threads(folder):
    more = ("--frames", "::3", "--threads", 1)
    result = groundray("voxels", folder / "scene.yaml", "-o", folder / "one", *more)
    assert result.returncode == 0, result.stderr
    assert files(folder / "own") == files(folder / "one")


@pytest.mark.parametrize(
    ("change", "more", "words"),
    [
        (("label: 1", "label: 0"), (), "label 0 of a surface would be 0 in voxels"),
        (("5: rock, ", ""), ("--labels", "rellis"), "label 5 has no class; add it"),
        (("", ""), ("--labels", "none"), "it is no set of labels; there are cityscapes, goose"),
        (("", ""), ("--labels", "wild"), "it begins several sets; there are wildscenes_2d"),
        (("", ""), ("--lidar", "front"), "the scene has no such lidar; it has top"),
        (("", ""), ("--frames", "9"), "selects none of the 5 scans of lidar 'top'"),
    ],
)
def test_mistakes_in_choices_of_voxels_are_reported(folder, tmp_path, change, more, words):
    scene = folder / f"{tmp_path.name}.yaml"
    scene.write_text(SCENE.replace(*change, 1))
    result = groundray("voxels", scene, "-o", tmp_path / "out", *more)
    assert result.returncode == 1
    assert words in result.stderr
    assert not list(tmp_path.iterdir())
