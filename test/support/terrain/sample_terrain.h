#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/geometry/mesh.h"
#include "core/random.h"
#include "core/tracing/ray.h"

namespace groundray::testing {

/// A fractal landscape of (2^k + 1)^2 samples by midpoint displacement, centred on D's origin, with
/// rows from north to south.
/// @param relief_m  approximate difference between its highest and lowest point.
/// @see Fournier, Fussell, Carpenter, Computer rendering of stochastic models (1982).
HeightGrid fractal(int samples, double step_m, double relief_m, Seed seed);

/// The grid with round holes of up to `radius` samples and with single missing samples.
HeightGrid with_holes(const HeightGrid& grid, int count, int radius, Seed seed);

/// The same heights, each missing independently with probability `share`.
HeightGrid with_missing_samples(const HeightGrid& grid, double share, Seed seed);

/// Two triangles for each cell of a grid without holes, counter-clockwise from above and split as
/// in docs/theory/surface.md: between the second corner of a row and the first of the next.
TriangleMesh mesh_of(const HeightGrid& grid);

/// Random rays that start up to 300 m above the surface, a few outside the grid, in all directions,
/// most of them downwards.
std::vector<Ray> random_rays(const HeightGrid& grid, std::size_t count, Seed seed);

/// Size of a proof: `full` under `./dev prove`, otherwise `reduced`.
std::size_t proof_size(std::size_t reduced, std::size_t full);

}  // namespace groundray::testing
