"""Compares the filling of blank areas of DEMs with other software.

Masks are cut from real and fractal ground: blobs that take 1, 5 and 20 % of it, stripes, and the
shadows of a sensor (by casting rays). Each is filled by groundray, by a thin plate (a separate
sparse solve with SciPy), SciPy's radial basis functions (thin plate spline of 64 neighbours),
GDAL's FillNodata, OpenCV's inpainting by Telea and by Navier-Stokes, and CGAL (meshes triangulated,
refined and faired; it and GDAL's through `groundray terrain fill --method`). Printed are
groundray's RMSE and its ratio to the others'; for shadows twice, without and with the bounds by
lines of sight, and the ratio of both RMSEs (gain). The last columns are the errors in groundray's
stated standard deviations: their root mean square, and the fractions within one and two.

The masks have seeds 0, 1, ...; the constants in groundray's code (forms and numbers of trials,
preference of a form) were chosen on masks of seeds from 1000 on.

Run by `./dev bench fill`; arguments: number of masks of each kind, DEMs.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
import scipy.interpolate
import scipy.ndimage
import scipy.sparse
import scipy.sparse.linalg

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/release/bin/groundray"
SHARED = Path(os.environ.get("GROUNDRAY_SHARED_DATA", ROOT.parent / "shared/data")) / "dem"
KINDS = ("blob 1 %", "blob 5 %", "blob 20 %", "stripes", "shadows")
BOUNDED = "bounded"  # shadows, under bounds by lines of sight
DEMS = {
    "jacksboro": (ROOT / "data/terrain/jacksboro.tif", None),
    "prairie": (ROOT / "data/terrain/prairie_1m.tif", None),
    "big tujunga": (SHARED / "bigtujunga_30m/bigtujunga.tif", 32767),
    "moon": (SHARED / "moon_gld100_8193/moon_gld100_8193.tif", None),
    "fractal": (None, None),
}
HOLE = -99999
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)  # it warns about tags of GeoTIFFs


def noise(size: int, random: np.random.Generator, gain) -> np.ndarray:
    """Returns a random field: white noise with waves of f cycles per cell multiplied by gain(f)."""
    waves = np.fft.fftfreq(size)
    f = np.hypot(*np.meshgrid(waves, waves))
    f[0, 0] = 1
    gains = gain(f)
    gains[0, 0] = 0
    return np.fft.ifft2(np.fft.fft2(random.standard_normal((size, size))) * gains).real


def load(name: str) -> np.ndarray:
    path, nodata = DEMS[name]
    if path is None:
        field = noise(512, np.random.default_rng(5), lambda f: f**-1.8)
        return 20 * field / field.std()
    heights = cv2.imread(str(path), cv2.IMREAD_UNCHANGED).astype(float)
    heights[(heights == nodata) | (np.abs(heights) > 1e5)] = np.nan
    return heights


def cut(dem: np.ndarray, random: np.random.Generator, size: int = 192) -> np.ndarray:
    """Returns a square without holes that is not flat."""
    for _ in range(1000):
        row, column = (int(random.integers(0, n - size + 1)) for n in dem.shape)
        part = dem[row : row + size, column : column + size]
        if np.isfinite(part).all() and (np.diff(part) != 0).mean() > 0.5:
            return part.astype(np.float32).astype(float)
    raise RuntimeError("there is no square without holes")


def horizon(heights: np.ndarray, sensor: np.ndarray) -> np.ndarray:
    """Returns the height of the lowest line of sight that clears the ground before each sample."""
    size = len(heights)
    y, x = np.mgrid[:size, :size].astype(float)
    dx, dy = x - sensor[0], y - sensor[1]
    distance = np.maximum(np.hypot(dx, dy), 1e-9)
    steepest = np.full(heights.shape, -np.inf)
    for step in range(1, int(distance.max())):
        on = step < distance - 0.75
        px, py = sensor[0] + dx[on] * step / distance[on], sensor[1] + dy[on] * step / distance[on]
        i, j = (np.clip(p.astype(int), 0, size - 2) for p in (px, py))
        a, b = px - i, py - j
        near = heights[j, i] * (1 - a) + heights[j, i + 1] * a
        far = heights[j + 1, i] * (1 - a) + heights[j + 1, i + 1] * a
        steepest[on] = np.maximum(steepest[on], (near * (1 - b) + far * b - sensor[2]) / step)
    return sensor[2] + steepest * distance


def shadows(heights: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Returns a mask of samples that a sensor does not see, some 15 %, and their upper bounds."""
    best = None
    relief = np.ptp(heights)
    for _ in range(12):
        x, y = random.uniform(0, len(heights) - 1, 2)
        sensor = np.array([x, y, heights[int(y), int(x)] + relief * random.uniform(0.1, 2)])
        bound = horizon(heights, sensor)
        mask = bound > heights + 1e-6 * relief
        off = abs(np.log((mask.mean() + 1e-4) / 0.15))
        if best is None or off < best[0]:
            best = (off, mask, bound)
    return best[1], best[2]


def enclosed(mask: np.ndarray) -> np.ndarray:
    """Returns the mask without parts that touch the edge."""
    labels, _ = scipy.ndimage.label(mask, np.ones((3, 3)))
    edge = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    return mask & ~np.isin(labels, edge[edge > 0])


def make_mask(kind: str, heights: np.ndarray, random: np.random.Generator):
    """Returns the mask of hidden samples, and their bounds or None."""
    size = len(heights)
    if kind == "shadows":
        mask, bound = shadows(heights, random)
        mask = enclosed(mask)
        return mask, np.where(mask, bound, np.nan)
    if kind == "stripes":
        y, x = np.mgrid[:size, :size]
        angle, period = random.uniform(0, np.pi), random.uniform(25, 60)
        across = x * np.cos(angle) + y * np.sin(angle) + random.uniform(0, period)
        mask = across % period < random.uniform(0.08, 0.2) * period
        mask[[0, -1]] = mask[:, [0, -1]] = False
        return mask, None
    share = float(kind.split()[1]) / 100
    width = {0.01: 5, 0.05: 8, 0.2: 9}[share]
    field = noise(size, random, lambda f: np.exp(-2 * (np.pi * f * width) ** 2))
    return enclosed(field > np.quantile(field, 1 - share)), None


def write_grid(path: Path, heights: np.ndarray, cell_m: float = 1) -> None:
    """Writes an ESRI ASCII grid; NaN becomes a hole."""
    rows, columns = heights.shape
    head = f"ncols {columns}\nnrows {rows}\nxllcorner 0\nyllcorner 0\ncellsize {cell_m}\n"
    with path.open("w") as file:
        file.write(f"{head}NODATA_value {HOLE}\n")
        np.savetxt(file, np.where(np.isnan(heights), HOLE, heights), fmt="%.9g")


def read_tiff(path: Path) -> np.ndarray:
    heights = cv2.imread(str(path), cv2.IMREAD_UNCHANGED).astype(float)
    return np.where(heights == HOLE, np.nan, heights)


def by_groundray(
    heights: np.ndarray, mask: np.ndarray, *options: object, bound=None, cell_m: float = 1
):
    """Returns heights, and their standard deviations for groundray's own method."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_grid(folder / "in.asc", np.where(mask, np.nan, heights), cell_m)
        words = ["--largest-share", 1, "--farthest-m", 1e6, *options]
        if "--method" not in words:
            words += ["--sd-out", folder / "sd.tif"]
        if bound is not None:
            write_grid(folder / "bound.asc", bound, cell_m)
            words += ["--bound", folder / "bound.asc"]
        line = [PROGRAM, "terrain", "fill", folder / "in.asc", "-o", folder / "out.tif", *words]
        run = subprocess.run([str(word) for word in line], capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        sd = read_tiff(folder / "sd.tif") if (folder / "sd.tif").exists() else None
        return read_tiff(folder / "out.tif"), sd


def thin_plate(heights: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Minimises the sum of squared second differences, with mixed ones counted twice."""
    rows, columns = heights.shape
    number = np.arange(heights.size).reshape(heights.shape)
    energy = 0
    for stencil, weight in (
        ({(0, 0): 1, (0, 1): -2, (0, 2): 1}, 1),
        ({(0, 0): 1, (1, 0): -2, (2, 0): 1}, 1),
        ({(0, 0): 1, (0, 1): -1, (1, 0): -1, (1, 1): 1}, 2),
    ):
        high = rows - max(r for r, _ in stencil)
        wide = columns - max(c for _, c in stencil)
        terms = scipy.sparse.csr_matrix((high * wide, heights.size))
        for (r, c), factor in stencil.items():
            places = number[r : r + high, c : c + wide].ravel()
            entry = (np.full(places.size, float(factor)), (np.arange(places.size), places))
            terms = terms + scipy.sparse.csr_matrix(entry, shape=terms.shape)
        energy = energy + weight * (terms.T @ terms)
    base = heights[~mask].mean()
    inside = mask.ravel()
    system = energy.tocsr()[inside]
    right = -(system @ np.where(mask, 0, heights - base).ravel())
    filled = heights.copy()
    filled[mask] = base + scipy.sparse.linalg.spsolve(system[:, inside].tocsc(), right)
    return filled


def radial_basis(heights: np.ndarray, mask: np.ndarray) -> np.ndarray:
    rim = scipy.ndimage.binary_dilation(mask, iterations=6) & ~mask
    base = heights[rim].mean()
    filled = heights.copy()
    for neighbours in (64, 128, 512):  # until they are not collinear
        try:
            spline = scipy.interpolate.RBFInterpolator(
                np.argwhere(rim).astype(float), heights[rim] - base, neighbors=neighbours
            )
            filled[mask] = base + spline(np.argwhere(mask).astype(float))
            return filled
        except np.linalg.LinAlgError:
            pass
    raise RuntimeError("no spline of 512 neighbours")


def inpaint(heights: np.ndarray, mask: np.ndarray, method: int) -> np.ndarray:
    """Uses Python's OpenCV, which is newer than the system's and treats edges better. Heights are
    scaled as in groundray: Telea's method adds up to two grey levels."""
    known = heights[~mask]
    middle, scale = (known.min() + known.max()) / 2, 1e5 / np.ptp(known)
    grey = np.where(mask, 0, (heights - middle) * scale).astype(np.float32)
    return middle + cv2.inpaint(grey, mask.astype(np.uint8), 3, method).astype(float) / scale


def by_method(method: str):
    return lambda heights, mask: by_groundray(heights, mask, "--method", method)[0]


PEERS = {
    "thin plate": thin_plate,
    "SciPy RBF": radial_basis,
    "GDAL": by_method("gdal"),
    "Telea": lambda heights, mask: inpaint(heights, mask, cv2.INPAINT_TELEA),
    "NS": lambda heights, mask: inpaint(heights, mask, cv2.INPAINT_NS),
    "CGAL": by_method("cgal"),
}


def compare(dem: np.ndarray, kind: str, seed: int, peers=PEERS, size: int = 192) -> list[dict]:
    """Returns one result, or two for shadows: without and with bounds. Each has sums of squared
    errors by method, groundray's on the samples that the method fills, and errors in stated sds."""
    random = np.random.default_rng([seed, KINDS.index(kind)])
    heights = cut(dem, random, min(size, *dem.shape))
    mask, bound = make_mask(kind, heights, random)
    if not mask.any():
        return []
    others = {name: fill(heights, mask) for name, fill in peers.items()}
    results = []
    for name, most in ((kind, None), (BOUNDED, bound)):
        if name == BOUNDED and most is None:
            continue
        filled, sd = by_groundray(heights, mask, bound=most)
        squares, own = {}, {}
        for peer, z in others.items():  # meshes skip holes whose boundaries touch themselves
            done = mask & np.isfinite(z)
            squares[peer] = ((z - heights)[done] ** 2).sum()
            own[peer] = ((filled - heights)[done] ** 2).sum()
        results.append(
            {
                "kind": name,
                "squares": squares,
                "own": own,
                "all": ((filled - heights)[mask] ** 2).sum(),
                "sds": np.abs((filled - heights)[mask]) / sd[mask],
                "samples": mask.sum(),
            }
        )
    return results


def summarise(runs: list[dict]) -> dict:
    """Returns groundray's RMSE, its ratio to the others', and its errors in stated sds."""

    def total(key, peer):
        return sum(run[key][peer] for run in runs)

    def share(peer):  # NaN where a method fills nothing
        squares = total("squares", peer)
        return np.sqrt(total("own", peer) / squares) if squares > 0 else np.nan

    sds = np.concatenate([run["sds"] for run in runs])
    return {
        "rmse": np.sqrt(sum(run["all"] for run in runs) / sum(run["samples"] for run in runs)),
        "shares": {p: share(p) for p in runs[0]["squares"]},
        "rms_sds": np.sqrt((sds**2).mean()),
        "cover": [(sds <= k).mean() for k in (1, 2)],
    }


def compare_all(dem: np.ndarray, masks: int, kinds=KINDS) -> dict[str, dict]:
    """Returns summaries by kind and, as "gain", the ratio of RMSEs with and without bounds."""
    found = {}
    for kind in kinds:
        runs = [run for seed in range(masks) for run in compare(dem, kind, seed)]
        for name in dict.fromkeys(run["kind"] for run in runs):
            found[name] = summarise([run for run in runs if run["kind"] == name])
        if BOUNDED in found and kind == "shadows":
            found[BOUNDED]["gain"] = found[BOUNDED]["rmse"] / found[kind]["rmse"]
    return found


def line_of(shares: dict) -> str:
    return "".join(f"{shares[p]:11.3f}" if shares[p] > 0 else f"{'-':>11}" for p in PEERS)


def main() -> None:
    masks = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    shares: dict[str, list[dict]] = {}
    print(f"{masks} masks of each kind; RMSE in m, then its ratio to the others'")
    head = "".join(f"{name:>11}" for name in PEERS)
    print(
        f"{'DEM':12}{'kind':10}{'groundray':>10}{head}{'gain':>7}{'z rms':>7}{'1 sd':>6}{'2 sd':>6}"
    )
    for name in [n for n in DEMS if not sys.argv[2:] or re.search("|".join(sys.argv[2:]), n)]:
        if DEMS[name][0] is not None and not DEMS[name][0].exists():
            print(f"{name:12}does not exist: {DEMS[name][0]}; set GROUNDRAY_SHARED_DATA")
            continue
        for kind, found in compare_all(load(name), masks).items():
            shares.setdefault(kind, []).append(found["shares"])
            gain = f"{found['gain']:7.3f}" if "gain" in found else " " * 7
            errors = f"{found['rms_sds']:7.2f}{found['cover'][0]:6.2f}{found['cover'][1]:6.2f}"
            head = f"{name:12}{kind:10}{found['rmse']:10.4g}"
            print(f"{head}{line_of(found['shares'])}{gain}{errors}", flush=True)
    print("geometric means over DEMs")
    for kind, each in shares.items():
        means = {peer: np.exp(np.mean([np.log(one[peer]) for one in each])) for peer in PEERS}
        print(f"{'all':12}{kind:10}{'':10}{line_of(means)}")


if __name__ == "__main__":
    main()
