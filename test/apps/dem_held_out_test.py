"""Heights by `groundray reconstruct dem` of a real airborne scan, compared with held-out points.

Those who made the scan say which points are ground; the oracles are such points, held out, and
SciPy's triangles of the others.
"""

import numpy as np
from dem_runs import (
    AIRBORNE,
    IS_FULL,
    Raster,
    coromandel,
    done,
    nmad_of,
    points_file,
)
from scipy.interpolate import LinearNDInterpolator
from scipy.ndimage import map_coordinates


def bilinear(raster, band, x, y):
    """Interpolates bilinearly; NaN if one of the four samples is missing."""
    u = (x - raster.west) / raster.cell - 0.5
    v = (raster.north - y) / raster.cell - 0.5
    return map_coordinates(band, [v, u], order=1, mode="constant", cval=np.nan)


def triangulated(points, at):
    """Interpolates heights on SciPy's triangulation, in coordinates near 0."""
    middle = points[:, :2].mean(axis=0)
    return LinearNDInterpolator(points[:, :2] - middle, points[:, 2])(at[:, :2] - middle)


def lowest_of(points, side):
    """Returns the lowest point of each square."""
    square = np.floor((points[:, :2] - points[:, :2].min(axis=0)) / side).astype(int)
    key = square[:, 0] * 100_000 + square[:, 1]
    order = np.lexsort((points[:, 2], key))
    return points[order[np.r_[True, np.diff(key[order]) > 0]]]


def record_held_out(layers, held, name, record_property):
    """The DEM's errors at points that were not shown, and where they are numbers; records those of
    what is measured and of the rest. How precise the points are themselves nobody says, so that
    normalised errors are reported, but not judged."""
    x, y = held[:, 0], held[:, 1]
    error = bilinear(layers, layers["elevation"], x, y) - held[:, 2]
    variance = bilinear(layers, layers["variance"], x, y)
    z = error / np.sqrt(variance)
    for of, is_in in (("measured", ~np.isnan(z)), ("filled in part", np.isnan(z))):
        e = error[is_in & ~np.isnan(error)]
        said = f"{len(e)} points, bias {e.mean():.3f} m, NMAD {nmad_of(e):.3f} m, "
        said += f"95 % {np.quantile(np.abs(e), 0.95):.3f} m, RMSE {np.sqrt(np.mean(e**2)):.3f} m"
        record_property(f"{name}, {of}", said)
    z = z[~np.isnan(z)]
    shares = " ".join(f"{np.mean(np.abs(z) <= sds):.3f} within {sds} sd" for sds in (1, 2))
    record_property(f"{name}, normalised", f"RMS {np.sqrt(np.mean(z**2)):.2f}, {shares}")
    is_near = ~np.isnan(error)
    assert np.mean(is_near) > 0.98  # but for some at the border
    return error, is_near


WHOLE = ("--reach", "hull", "--largest-share", "1", "--farthest-m", "12")


def test_labelled_ground_predicts_held_out_points(tmp_path, record_property):
    """A tenth of the points that those who made a scan call ground, from the others: as near as
    SciPy's triangles of the others are. One hole is most of it, and cells of 0.25 m take longer."""
    points, is_ground = coromandel()
    ground = points[is_ground]
    is_held = np.arange(len(ground)) % 10 == 0
    shown = points_file(tmp_path / "shown.npy", ground[~is_held])
    done(
        *("reconstruct", "dem", shown, *AIRBORNE, *WHOLE, "--outlier-share", "0"),
        *("--cell-m", "0.25" if IS_FULL else "0.3", "-o", tmp_path / "dem.tif"),
    )
    layers, held = Raster(tmp_path / "dem.tif", tmp_path), ground[is_held]
    error, is_near = record_held_out(layers, held, "labelled ground", record_property)
    theirs = triangulated(ground[~is_held], held) - held[:, 2]
    is_both = is_near & ~np.isnan(theirs)
    ours_m, theirs_m = (np.sqrt(np.mean(e[is_both] ** 2)) for e in (error, theirs))
    record_property("margin: RMSE by triangles'", f"{ours_m / theirs_m} {ours_m:.3g} {theirs_m} m")
    assert np.count_nonzero(is_both) > 950
    assert ours_m <= theirs_m


def test_ground_under_bush_is_more_accurate_than_lowest_points(tmp_path, record_property):
    """From all points, labels unseen, the ground that was held out: as near as triangles of the
    lowest points of squares, at whatever side of these is the best afterwards. What hides the
    ground altogether is taken for it by both, so the middle of the errors is judged."""
    points, is_ground = coromandel()
    is_held = np.zeros(len(points), bool)
    is_held[np.flatnonzero(is_ground)[::10]] = True
    shown, held = points[~is_held], points[is_held]
    done(
        *("reconstruct", "dem", points_file(tmp_path / "shown.npy", shown), *AIRBORNE, *WHOLE),
        *("--ground-filter", "air", "--filter-slope", "0.6", "--filter-threshold-m", "0.3"),
        # The filter has left what is no ground out; who is left may stand alone.
        *("--outlier-share", "0", "--cell-m", "0.5", "-o", tmp_path / "dem.tif"),
    )
    layers = Raster(tmp_path / "dem.tif", tmp_path)
    error, is_near = record_held_out(layers, held, "ground under bush", record_property)
    peers = [triangulated(lowest_of(shown, side), held) - held[:, 2] for side in (1, 1.5, 2, 3, 5)]
    is_all = is_near & ~np.isnan(peers).any(axis=0)
    for of, figure in (("NMAD", nmad_of), ("median size", lambda e: np.median(np.abs(e)))):
        ours_m = figure(error[is_all])
        theirs_m = min(figure(peer[is_all]) for peer in peers)
        said = f"{ours_m / theirs_m} {ours_m:.3g} {theirs_m} m"
        record_property(f"margin: {of} by lowest points'", said)
        assert ours_m <= theirs_m, of
