#pragma once

#include <cstddef>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/fill/dem_fill.h"
#include "reconstruction/dem/fusion/dem_fusion.h"
#include "reconstruction/dem/ground/ground_filter.h"
#include "reconstruction/dem/measured_points.h"
#include "reconstruction/dem/smooth/dem_smooth.h"
#include "reconstruction/pipeline/stages.h"

namespace groundray {

/// Points of lidars, with the origins of their beams.
struct LidarBlock {
  MeasuredPoints points;
  std::vector<glm::dvec3> origins_m;
  double share = 0;  ///< fraction of all blocks that end with this one, for progress
};

/// Returns a source of a single block.
PointSource single_block(MeasuredPoints points);

/// Measurements for a DEM, in blocks: a survey need not fit in memory.
struct DemSources {
  PointSource points;  ///< all points of lidars and stereo pairs
  /// Points of lidars once more, as PointSource; called after the last call of `points`. Empty: no
  /// bounds by lines of sight.
  std::function<bool(LidarBlock& block)> beams;
};

/// Method for filling blank areas: the smoothest surface, or faired meshes.
enum class FillMethod { Tension, Mesh };

/// Options of the steps from points to a DEM.
struct DemBuildOptions {
  /// Filter that keeps only points of the ground; all points are then in memory at once, in about
  /// 100 bytes each. Without one, the lowest surface is the ground.
  std::optional<GroundFilterOptions> filter;
  FusionOptions fusion;
  std::optional<double> sight_margin_m;  ///< as for sight_bound; default: a quarter of a cell
  std::optional<SmoothOptions> smooth;
  std::optional<FillOptions> fill = FillOptions{};
  FillMethod fill_method = FillMethod::Tension;
  std::size_t most_rim_edges = 1000;  ///< limit for holes that meshes fill
};

/// Statistics of the upper bounds from lines of sight.
struct BoundTally {
  std::size_t samples = 0;
  std::size_t broken = 0;  ///< heights that exceed their bound by three standard deviations
};

/// DEM with the results of each step.
struct DemResult {
  DemLayers layers;
  bool has_ground = false;  ///< false: no height at all, and the steps after fusion were omitted
  FusionCounts fusion;
  std::optional<GroundCounts> ground;
  std::optional<BoundTally> bound;
  std::optional<SmoothHeights> smoothed;  ///< its heights have been moved out
  std::optional<FilledHeights> filled;    ///< its rasters have been moved out
  StageSeconds seconds;
};

/// Makes a DEM: filters the ground, fuses points, bounds blank areas by lines of sight, smooths
/// measured heights, fills blank areas, and computes slopes where neighbours both along the row and
/// along the column have heights. The result does not depend on the number of threads.
/// @throws Error as filter_ground, fuse, smooth_dem, fill_dem and fill_dem_by_mesh.
DemResult build_dem(const DemSources& sources, const GridFrame& frame,
                    const DemBuildOptions& options, const PipelineControl& control = {});

/// Lowers `layers.upper_bound_m` to the heights at which beams pass, each raised by two standard
/// deviations of its point's height, including those of its pose. Beams that end where nothing was
/// measured, or below the measured ground, are omitted: their points may be outliers.
/// @param margin_m  margin added to the bound, see sight_bound.
void bound_by_sight(const LidarBlock& block, double margin_m, DemLayers& layers);

}  // namespace groundray
