"""Rays from Python: their order and what they are cast together with change no result."""

import groundray
import numpy as np
import pytest
import small_scene

MIDDLE_M = np.array([50.0, 40.0])  # of small_scene's ground


@pytest.fixture(scope="module")
def grounds(tmp_path_factory):
    """The ground alone, with every ray decided in double; and a scene with an object on it."""
    folder = tmp_path_factory.mktemp("rays")
    terrain = small_scene.write(folder)
    return {"terrain": terrain, "scene": groundray.load_scene(folder / "scene.yaml")}


def heads_rays(ground, middle_m, count, *, in_turn):
    """Rays of a head of 32 rings: ring by ring, or all rings in turn."""
    turn = np.linspace(0, 2 * np.pi, count // 32, endpoint=False)
    up = np.radians(np.linspace(-30, 10, 32))
    turn, up = (a.ravel() for a in np.meshgrid(turn, up, indexing="ij" if in_turn else "xy"))
    directions = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], -1)
    start = [*middle_m, ground.heights_at([middle_m])[0] + 2]
    return np.tile(start, (len(directions), 1)), directions


def random_rays(ground, middle_m, count, random):
    """Rays from around and above the ground towards all sides, of lengths from 1e-120 to 1e120."""
    origins = np.c_[middle_m + random.uniform(-55, 55, (count, 2)), random.uniform(-3, 30, count)]
    return origins, random.normal(size=(count, 3)) * 10 ** random.uniform(-120, 120, (count, 1))


def rays_from_ground(ground, middle_m, count, random):
    """Rays that begin on the ground, many of them flat, several side by side."""
    places = np.repeat(middle_m + random.uniform(-35, 35, (count // 16, 2)), 16, axis=0)
    origins = np.c_[places, ground.heights_at(places)]
    origins[::3, 2] += 1e-6
    directions = np.repeat(random.normal(size=(count // 16, 3)), 16, axis=0)
    return origins, (directions + random.normal(0, 0.03, directions.shape)) * [1, 1, 0.2]


def rays_of(kind, ground, middle_m, count):
    random = np.random.default_rng(7)
    if kind == "by ring":
        return heads_rays(ground, middle_m, count, in_turn=False)
    if kind == "rings in turn":
        return heads_rays(ground, middle_m, count, in_turn=True)
    if kind == "random":
        return random_rays(ground, middle_m, count, random)
    if kind == "from the ground":
        return rays_from_ground(ground, middle_m, count, random)
    parts = [
        heads_rays(ground, middle_m, count // 2, in_turn=True),
        random_rays(ground, middle_m, count // 4, random),
        rays_from_ground(ground, middle_m, count // 4, random),
    ]
    order = random.permutation(sum(len(part[0]) for part in parts))
    return tuple(np.concatenate(arrays)[order] for arrays in zip(*parts, strict=True))


@pytest.mark.parametrize("of", ["terrain", "scene"])
@pytest.mark.parametrize("kind", ["by ring", "rings in turn", "random", "from the ground", "mixed"])
def test_each_ray_is_cast_as_if_it_were_alone(grounds, of, kind):
    ground = grounds[of]
    # D's origin is the south-western sample in `terrain`, and the middle in `scene`.
    middle_m = MIDDLE_M if of == "terrain" else np.zeros(2)
    origins, directions = rays_of(kind, ground, middle_m, 20_000)  # more than are sorted together
    together = ground.cast_rays(origins, directions, error_bound=True)
    assert 0.2 < np.isfinite(together["range_true_m"]).mean() < 1
    # A scene's detail depends on where all its rays start; one flat DEM of this size is whole.
    for row in range(0, len(origins), 17):
        alone = ground.cast_rays(origins[[row]], directions[[row]], error_bound=True)
        for name in together:
            assert together[name][row].tobytes() == alone[name][0].tobytes(), (row, name)


def test_incidence_is_the_angle_between_ray_and_normal(grounds):
    origins, directions = rays_of("random", grounds["terrain"], MIDDLE_M, 20_000)
    rays = grounds["terrain"].cast_rays(origins, directions)
    hit = np.isfinite(rays["range_true_m"])
    normals = np.stack([rays["nx"], rays["ny"], rays["nz"]], -1)[hit].astype(float)
    along = directions[hit] / np.abs(directions[hit]).max(1, keepdims=True)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    sine = np.linalg.norm(np.cross(along, normals), axis=1)
    expected = np.arctan2(sine, np.abs((along * normals).sum(1))).astype(np.float32)
    angles = rays["incidence_rad"]
    assert np.isnan(angles[~hit]).all()
    assert expected.min() < 0.2 < 1.5 < expected.max()
    # `along` may differ from the ray's direction by a few units of its last place.
    assert np.abs(angles[hit] - expected).max() <= np.spacing(np.float32(1.5))
    assert (angles[hit] == expected).mean() > 0.9999


@pytest.mark.parametrize("kind", ["rings in turn", "random", "from the ground"])
def test_fast_tracing_of_terrain_hits_the_same_except_at_silhouettes(grounds, kind):
    origins, directions = rays_of(kind, grounds["terrain"], MIDDLE_M, 20_000)
    exact = grounds["terrain"].cast_rays(origins, directions)
    fast = grounds["terrain"].cast_rays(origins, directions, tracing="fast")
    differ = np.zeros(len(origins), bool)
    for name in exact:
        same = (exact[name] == fast[name]) | (np.isnan(exact[name]) & np.isnan(fast[name]))
        differ |= ~same
    assert differ.sum() <= 1  # 5e-6 of the rays, and one by chance
    with pytest.raises(groundray.Error, match=r"tracing = 'quick' must be one of exact, fast"):
        grounds["terrain"].cast_rays(origins, directions, tracing="quick")


def test_the_first_invalid_ray_of_many_is_named():
    terrain = groundray.Terrain(np.zeros((4, 4)))
    origins, directions = np.ones((50_000, 3)), np.tile([0.0, 0.0, -1.0], (50_000, 1))
    directions[20_001] = 0
    directions[40_000, 1] = np.inf
    origins[20_002, 2] = np.nan
    with pytest.raises(groundray.Error, match=r"ray 20001: .* the direction not zero"):
        terrain.cast_rays(origins, directions)
    origins[:] = 1e308  # large, but valid
    directions[:] = 1e308
    assert np.isinf(terrain.cast_rays(origins, directions)["range_true_m"]).all()
