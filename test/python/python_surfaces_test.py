"""Images, terrain, rays, reconstruction and comparison from Python."""

import json

import groundray
import numpy as np
import plyfile
import pytest
import small_scene
from groundray._scene import to_yaml


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A dataset made by the program, and the same scene in Python."""
    folder = tmp_path_factory.mktemp("python_surfaces")
    groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M).save(folder / "ground.tif")
    spec = small_scene.spec(folder, camera=True)
    spec["terrain"]["dem"] = "ground.tif"
    (folder / "scene.yaml").write_text(to_yaml(spec))
    small_scene.run("groundray", "generate", folder / "scene.yaml", "-o", folder / "out")
    return folder, groundray.load_scene(folder / "scene.yaml")


# ----- images

EXR_NAMES = {
    "radiance_w_m2_sr": "RGB",
    "standard_error_w_m2_sr": ["StdError.R", "StdError.G", "StdError.B"],
    "samples": ["Samples"],
    "is_valid": ["Valid"],
    "range_m": ["Distance"],
    "depth_m": ["Z"],
    "position_m": ["P.X", "P.Y", "P.Z"],
    "normal": ["N.X", "N.Y", "N.Z"],
    "shading_normal": ["Ns.X", "Ns.Y", "Ns.Z"],
    "albedo": ["Albedo.R", "Albedo.G", "Albedo.B"],
    "incidence_rad": ["Incidence"],
    "velocity_m_s": ["Velocity.X", "Velocity.Y", "Velocity.Z"],
    "label": ["Label"],
    "instance": ["Instance"],
    "material": ["Material"],
    "bound_m": ["Bound"],
    "flow_forward_px": ["FlowForward.u", "FlowForward.v"],
    "flow_forward_is_seen": ["FlowForward.seen"],
    "flow_backward_px": ["FlowBackward.u", "FlowBackward.v"],
    "flow_backward_is_seen": ["FlowBackward.seen"],
}


def exr_channels(path):
    openexr = pytest.importorskip("OpenEXR")
    with openexr.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


@pytest.mark.parametrize("frame", [0, 1])
def test_image_from_python_has_the_same_values_as_generate(made, frame):
    folder, scene = made
    image = scene.camera("eye").expose(frame=frame)
    begin = folder / f"out/camera/eye/{frame:06}"
    file = exr_channels(f"{begin}.exr")
    names = dict(EXR_NAMES, coverage=[f"Coverage.{label}" for label in image.labels])
    asked_for = [name for name in image if name in names]
    assert sorted(each for name in asked_for for each in names[name]) == sorted(file)
    for name in asked_for:
        stored = np.stack([file[each] for each in names[name]], axis=-1)
        ours = image[name].reshape(stored.shape).astype(stored.dtype)
        assert np.array_equal(ours, stored, equal_nan=ours.dtype.kind == "f"), name
    for name, suffix in [("irradiance_w_m2", "irradiance"), ("photons", "photons")]:
        stored = exr_channels(f"{begin}_{suffix}.exr")
        stored = np.stack([stored[each] for each in (["Y"] if len(stored) == 1 else "RGB")], -1)
        assert np.array_equal(image[name].reshape(stored.shape), stored)
    cv2 = pytest.importorskip("cv2")
    raw = cv2.imread(f"{begin}_raw.png", cv2.IMREAD_UNCHANGED)
    assert np.array_equal(image["raw_dn"], raw)
    picture = cv2.imread(f"{begin}.png", cv2.IMREAD_UNCHANGED)[..., ::-1]
    assert np.array_equal(image["picture"], picture)
    assert image["electrons"].shape == (36, 48)


def test_channels_are_read_only_views_of_height_by_width(made):
    camera = made[1].camera("eye")
    image = camera.expose(t_s=camera.times_s[0])
    assert camera.size_px == (48, 36)
    assert image["depth_m"].shape == (36, 48)
    assert image["position_m"].shape == (36, 48, 3)
    assert image["coverage"].shape == (36, 48, len(image.labels))
    for name in image:
        assert not image[name].flags.writeable
        assert np.shares_memory(image[name], image[name])
    with pytest.raises(KeyError, match="there is no channel 'Z'; the camera's products are"):
        image["Z"]
    depth_m = image["depth_m"]
    expected = depth_m.copy()
    del image, camera
    assert np.array_equal(depth_m, expected)


def test_pixel_directions_project_back_to_their_pixels(made):
    camera = made[1].camera("eye")
    directions = camera.directions
    assert directions.shape == (36, 48, 3)
    row, column = np.mgrid[:36, :48]
    # A pinhole: x / z = (u - 23.5) / 40.
    assert np.allclose(directions[..., 0] / directions[..., 2], (column - 23.5) / 40, atol=1e-12)
    assert np.allclose(directions[..., 1] / directions[..., 2], (row - 17.5) / 40, atol=1e-12)
    pixels = camera.project(7 * directions.reshape(-1, 3))
    assert np.allclose(pixels, np.stack([column, row], -1).reshape(-1, 2), atol=1e-9)
    assert np.isnan(camera.project([[0, 0, -1]])).all()


def test_pixels_match_rays_cast_from_their_poses(made):
    _, scene = made
    camera = scene.camera("eye")
    image = camera.expose(frame=0)
    middle_s = image.t_s + 0.001  # of an exposure of 2 ms
    X_DC = camera.pose(middle_s)
    directions = camera.directions.reshape(-1, 3) @ X_DC[:3, :3].T
    origins = np.broadcast_to(X_DC[:3, 3], directions.shape)
    rays = scene.cast_rays(origins, directions, middle_s, error_bound=True)
    assert np.allclose(image["range_m"].ravel(), rays["range_true_m"], rtol=1e-6)
    assert np.array_equal(image["instance"].ravel(), rays["instance"])
    assert {0, 1} <= set(rays["instance"])
    seen = np.isfinite(rays["range_true_m"])
    place = np.stack([rays["world_x_m"], rays["world_y_m"], rays["world_z_m"]], -1)
    assert np.allclose(image["position_m"].reshape(-1, 3)[seen], place[seen], atol=1e-6)
    ground = seen & (rays["instance"] == 0)
    accuracy_m = 1e-9 * rays["range_true_m"][ground] + 1e-9
    assert np.allclose(rays["error_bound_m"][ground], accuracy_m, rtol=1, atol=0)
    assert (rays["error_estimate_m"][ground] == 0).all()
    assert np.isnan(rays["error_estimate_m"][~seen]).all()
    with pytest.raises(
        groundray.Error, match=r"cast_rays: t_s = 7 must be within the scene's time, 0 to 0\.25 s"
    ):
        scene.cast_rays(origins, directions, 7)


# ----- terrain


def surface_m(heights, cell_m, x_m, y_m):
    """Returns heights on the two triangles of each cell by definition; rows run north to south."""
    rows = heights.shape[0]
    column, row = x_m / cell_m, rows - 1 - y_m / cell_m
    c = np.minimum(np.floor(column).astype(int), heights.shape[1] - 2)
    r = np.minimum(np.floor(row).astype(int), rows - 2)
    u, v = column - c, row - r
    z = heights.astype(np.float64)
    nw, ne, sw, se = z[r, c], z[r, c + 1], z[r + 1, c], z[r + 1, c + 1]
    near = nw + u * (ne - nw) + v * (sw - nw)
    far = se + (1 - u) * (sw - se) + (1 - v) * (ne - se)
    return np.where(u + v > 1, far, near)


def test_heights_and_vertical_rays_match_the_two_triangles_of_each_cell():
    heights = small_scene.heights_m()
    terrain = groundray.Terrain(heights, small_scene.CELL_M)
    places = np.random.default_rng(5).uniform([0, 0], [99.5, 79.5], (20_000, 2))
    expected = surface_m(heights, small_scene.CELL_M, places[:, 0], places[:, 1])
    assert np.abs(terrain.heights_at(places) - expected).max() < 1e-12
    rays = terrain.cast_rays(np.c_[places, np.full(len(places), 50.0)], [[0, 0, -3]] * len(places))
    assert np.abs(rays["range_true_m"] - (50 - expected)).max() < 1e-7  # 1e-9 of range, and a float
    assert np.abs(rays["world_z_m"] - expected).max() < 1e-7
    assert np.isnan(terrain.heights_at([[-1, 0], [0, 80]])).all()


def test_rays_hit_a_slope_on_its_plane():
    # z = x / 2: a ray from (10, 20, 30) along (1, 0, -1) meets it at x = 10 + t, 30 - t = x / 2.
    heights = np.tile(np.arange(100) / 2, (50, 1))
    rays = groundray.Terrain(heights).cast_rays(
        [[10, 20, 30], [10, 20, 30]], [[2, 0, -2], [0, 0, 1]]
    )
    t = 50 / 3
    assert rays["range_true_m"][0] == pytest.approx(t * np.sqrt(2), abs=1e-7)
    assert rays["world_x_m"][0] == pytest.approx(10 + t, abs=1e-7)
    assert rays["nz"][0] == pytest.approx(2 / np.sqrt(5), abs=1e-6)
    # The angle between (-1, 0, 1) and the normal (-1, 0, 2).
    assert rays["incidence_rad"][0] == pytest.approx(np.arccos(3 / np.sqrt(10)), abs=1e-6)
    assert rays["range_true_m"][1] == np.inf
    assert np.isnan(rays["world_x_m"][1])


def test_invalid_rays_are_reported():
    terrain = groundray.Terrain(np.zeros((4, 4)))
    with pytest.raises(groundray.Error, match=r"ray 1: .* must be finite"):
        terrain.cast_rays([[1, 1, 1], [np.nan, 1, 1]], [[0, 0, -1]] * 2)
    with pytest.raises(groundray.Error, match=r"ray 0: .* the direction not zero"):
        terrain.cast_rays([[1, 1, 1]], [[0, 0, 0]])
    with pytest.raises(groundray.Error, match=r"2 origins but 1 directions"):
        terrain.cast_rays([[1, 1, 1]] * 2, [[0, 0, -1]])
    with pytest.raises(
        TypeError, match=r"origins_m must be .* of shape \(n, 3\), but is shape \(1, 2\)"
    ):
        terrain.cast_rays([[1, 1]], [[0, 0]])
    assert len(terrain.cast_rays(np.zeros((0, 3)), np.zeros((0, 3)))) == 0


@pytest.mark.parametrize("fewest", [False, True])
@pytest.mark.parametrize("max_error_m", [0.05, 0.5])
def test_terrain_mesh_keeps_its_error_bound(max_error_m, fewest):
    heights = small_scene.heights_m()
    terrain = groundray.Terrain(heights, small_scene.CELL_M)
    mesh = terrain.mesh(max_error_m, fewest=fewest)
    if fewest:
        assert len(mesh.triangles) < len(terrain.mesh(max_error_m).triangles)
    corners = mesh.vertices_m[mesh.triangles]
    weights = np.random.default_rng(9).dirichlet([1, 1, 1], len(corners))
    places = np.einsum("nk,nkd->nd", weights, corners)
    off_m = places[:, 2] - surface_m(heights, small_scene.CELL_M, places[:, 0], places[:, 1])
    assert 0 < np.abs(off_m).max() <= max_error_m + 1e-9
    assert len(mesh.triangles) < 2 * heights.size


def test_terrain_round_trips_through_its_file(tmp_path):
    heights = small_scene.heights_m()
    heights[3, 4] = np.nan
    terrain = groundray.Terrain(heights, 0.5, (500_000.25, 4_600_000.5))
    assert terrain.origin_w_m == [500_000, 4_600_000, 0]
    terrain.save(tmp_path / "ground.tif")
    back = groundray.load_terrain(tmp_path / "ground.tif")
    assert np.array_equal(back.heights_m, heights, equal_nan=True)
    first_w_m = np.add(back.first_sample_m, back.origin_w_m[:2])
    assert np.allclose(first_w_m, [500_000.25, 4_600_000.5 + 0.5 * 159], atol=1e-9)
    assert np.shares_memory(back.heights_m, back.heights_m)
    with pytest.raises(groundray.Error, match="cell_m = 0 must be positive"):
        groundray.Terrain(heights, 0)
    with pytest.raises(groundray.Error, match=r"absent\.tif"):
        groundray.load_terrain(tmp_path / "absent.tif")
    with pytest.raises(TypeError, match="heights_m"):
        groundray.Terrain(np.zeros(5))


# ----- meshes and reconstruction


def test_reconstruction_from_python_matches_the_program(made, tmp_path):
    folder, scene = made
    scans = [scene.lidar("roof").scan(frame=frame) for frame in range(2)]
    mesh, counts = groundray.reconstruct_mesh(scans)
    small_scene.run(
        "groundray", "reconstruct", "mesh", folder / "out", "--sensor", "roof", "-o",
        tmp_path / "m.ply",
    )  # fmt: skip
    faces = plyfile.PlyData.read(tmp_path / "m.ply")["face"]["vertex_indices"]
    file = groundray.load_mesh(tmp_path / "m.ply")
    assert len(faces) > 1000
    assert np.array_equal(mesh.vertices_m, file.vertices_m)
    assert np.array_equal(mesh.triangles, np.stack(faces))
    assert np.array_equal(mesh.sd_m, file.sd_m)
    assert np.array_equal(mesh.labels, file.labels)
    assert mesh.origin_w_m == file.origin_w_m
    assert counts["moved"] > 0


def test_simplified_mesh_from_python_matches_the_program(tmp_path):
    terrain = groundray.Terrain(small_scene.heights_m(60, 80), small_scene.CELL_M)
    mesh = terrain.mesh(0)
    mesh.save(tmp_path / "m.ply")
    small_scene.run(
        "groundray", "reconstruct", "simplify", tmp_path / "m.ply", "--max-vertical-error-m", "0.1",
        "-o", tmp_path / "s.ply",
    )  # fmt: skip
    small, figures = groundray.simplify(mesh, max_vertical_error_m=0.1)
    file = groundray.load_mesh(tmp_path / "s.ply")
    assert len(small.triangles) < len(mesh.triangles) / 2
    assert np.array_equal(small.vertices_m, file.vertices_m)
    assert np.array_equal(small.triangles, file.triangles)
    assert figures["halted_by"] == "bound"
    assert 0.05 < figures["vertical_largest_m"] <= 0.1 + 1e-9


def test_dem_from_python_matches_the_program(made, tmp_path):
    folder, scene = made
    scans = [scene.lidar("roof").scan(frame=frame) for frame in range(2)]
    dem = groundray.fuse_dem(scans, cell_m=1, position_sd_m=0.01)
    small_scene.run(
        "groundray", "reconstruct", "dem", folder / "out", "--sensor", "roof", "--cell-m", "1",
        "--position-sd-m", "0.01", "--no-stereo", "--no-fill", "--sight", "none", "-o",
        tmp_path / "d.tif",
    )  # fmt: skip
    file = groundray.load_terrain(tmp_path / "d.tif")
    assert np.isfinite(dem.elevation_m).sum() > 300
    assert np.array_equal(dem.elevation_m, file.heights_m, equal_nan=True)
    assert dem.step_m == file.step_m
    assert dem.counts["points"] == sum(map(len, scans))
    assert ((dem.source == 1) == np.isfinite(dem.elevation_m)).all()


def test_fused_points_of_a_plane_lie_on_it():
    random = np.random.default_rng(4)
    x, y = random.uniform(0, 20, (2, 20_000))
    z = 0.2 * x - 0.1 * y + random.normal(0, 0.02, x.shape)
    origins = np.broadcast_to([10, 10, 200], (len(x), 3))
    dem = groundray.fuse_points(
        np.c_[x, y, z], origins, np.full(len(x), 0.02), cell_m=1, area_m=(0, 0, 20, 20)
    )
    assert dem.elevation_m.shape == (20, 20)
    row, column = np.mgrid[:20, :20]
    at = dem.first_sample_m + np.stack([column, row], -1) * dem.step_m
    off_sds = (dem.elevation_m - (0.2 * at[..., 0] - 0.1 * at[..., 1])) / np.sqrt(dem.variance_m2)
    assert np.sqrt(np.mean(off_sds**2)) < 1.3
    assert np.abs(off_sds).max() < 5
    with pytest.raises(groundray.Error, match="these numbers must be equal"):
        groundray.fuse_points(np.c_[x, y, z], origins[:5], np.full(len(x), 0.02), cell_m=1)


def test_planes_are_smoothed_and_filled_exactly():
    row, column = np.mgrid[:40, :50]
    plane = (0.3 * column - 0.2 * row).astype(np.float32)
    smooth = groundray.smooth_dem(plane, np.full(plane.shape, 0.01), cell_m=1)
    assert np.abs(smooth - plane).max() < 1e-4
    holed = plane.copy()
    holed[10:20, 15:30] = np.nan
    filled = groundray.fill_dem(holed, cell_m=1)
    assert filled["filled"] == 150
    assert filled["holes"] == 1
    assert np.abs(filled["heights_m"] - plane).max() < 1e-4
    with pytest.raises(
        groundray.Error, match="reach = 'all' must be one of enclosed, hull, everywhere"
    ):
        groundray.fill_dem(holed, cell_m=1, reach="all")


def test_meshes_are_built_from_arrays_and_validated(tmp_path):
    vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    mesh = groundray.Mesh(vertices, [[0, 1, 2], [0, 2, 3]], labels=[1, 2, 3, 4])
    assert mesh.sd_m is None
    assert list(mesh.labels) == [1, 2, 3, 4]
    assert not mesh.vertices_m.flags.writeable
    for name in ("m.ply", "m.obj", "m.glb", "m.stl"):
        mesh.save(tmp_path / name)
        back = groundray.load_mesh(tmp_path / name)
        assert sorted(map(tuple, back.vertices_m)) == sorted(map(tuple, np.array(vertices, float)))
    with pytest.raises(groundray.Error, match="triangle 0 names vertex -1"):
        groundray.Mesh(vertices, [[0, 1, -1]])
    with pytest.raises(groundray.Error, match="4 vertices, but 1 values of sd_m"):
        groundray.Mesh(vertices, [[0, 1, 2]], sd_m=[1])
    with pytest.raises(groundray.Error, match="labels of vertex 1"):
        groundray.Mesh(vertices, [[0, 1, 2]], labels=[0, 1.5, 0, 0])
    with pytest.raises(groundray.Error, match="mesh"):
        groundray.Mesh([[0, 0, np.nan]] * 3, [[0, 1, 2]])
    with pytest.raises(groundray.Error, match="give one of max_vertical_error_m"):
        groundray.simplify(mesh)


def test_invalid_scans_are_reported():
    with pytest.raises(groundray.Error, match="reconstruct_mesh: scan 0 of scans is None"):
        groundray.reconstruct_mesh([None])
    with pytest.raises(groundray.Error, match="fuse_dem: scans is empty"):
        groundray.fuse_dem([], cell_m=1)
    with pytest.raises(groundray.Error, match=r"point 1, -0\.1 m, must be 0 or more"):
        groundray.fuse_points([[0, 0, 0]] * 2, [[0, 0, 1]] * 2, [0.1, -0.1], cell_m=1)


# ----- comparison


def reported(tmp_path, *arguments):
    small_scene.run("groundray-golden", "compare", *arguments, "-o", tmp_path / "reported")
    section = json.loads((tmp_path / "reported/report.json").read_text())["sections"][0]
    return {measure["name"]: measure["value"] for measure in section["measures"]}


def test_comparison_from_python_matches_the_program(made, tmp_path):
    folder, scene = made
    files = [folder / f"out/lidar/roof/{frame:06}.ply" for frame in range(2)]
    in_memory = groundray.compare(*(scene.lidar("roof").scan(frame=frame) for frame in range(2)))
    of_files = groundray.compare(*files)
    assert in_memory["figures"] == of_files["figures"] == reported(tmp_path, *files)
    assert of_files["units"].keys() == of_files["figures"].keys()
    terrain = groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)
    coarse, fine = terrain.mesh(0.5), terrain.mesh(0.05)
    coarse.save(tmp_path / "coarse.ply")
    fine.save(tmp_path / "fine.ply")
    figures = groundray.compare(fine, coarse, within_m=[0.1])["figures"]
    assert figures["precision within 0.1 m"] > 10
    assert figures == reported(
        tmp_path, tmp_path / "fine.ply", tmp_path / "coarse.ply", "--within-m", "0.1"
    )
    shifted = groundray.Terrain(small_scene.heights_m() + np.float32(0.25), small_scene.CELL_M)
    of_dems = groundray.compare(terrain, shifted)["figures"]
    assert any(abs(value - 0.25) < 1e-5 for value in of_dems.values())
    part = groundray.compare(fine, coarse, area_m=[2, 2, 6, 6], heights_m=[-99, 99])
    assert part["figures"]["reference: area"] < figures["reference: area"]
    assert set(part["main"]) <= part["figures"].keys()
    assert part["headline"]
    assert part["figures"] == reported(
        *(tmp_path, tmp_path / "fine.ply", tmp_path / "coarse.ply"),
        *("--area", "2", "2", "6", "6", "--heights-m", "-99", "99"),
    )
    near = groundray.compare(terrain, shifted, ignore_beyond_m=0.3)["figures"]
    assert near["left out, farther than 0.3 m from the other surface"] == 0
    with pytest.raises(groundray.Error, match="no sample that both have is left"):
        groundray.compare(terrain, shifted, ignore_beyond_m=0.2)
    with pytest.raises(groundray.Error, match="must be W S E N"):
        groundray.compare(files[0], files[1], area_m=[1, 0, 0, 1])
    with pytest.raises(groundray.Error, match="compare: pixels requires images"):
        groundray.compare(files[0], files[1], pixels=[0, 0, 1, 1])
    with pytest.raises(groundray.Error, match="of the same kind"):
        groundray.compare(files[0], folder / "ground.tif")
    with pytest.raises(TypeError):
        groundray.compare(terrain, fine)
