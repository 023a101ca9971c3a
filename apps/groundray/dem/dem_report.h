#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/groundray/dem/dem_points.h"
#include "apps/groundray/dem/dem_truth.h"
#include "apps/groundray/dem/fill_report.h"
#include "core/geometry/grid_frame.h"
#include "core/io/mesh_io.h"
#include "reconstruction/dem/fusion/dem_fusion.h"
#include "reconstruction/dem/ground/ground_filter.h"

namespace groundray {

/// Result of smoothing.
struct SmoothTally {
  double curvature_sd_per_m = 0;
  std::size_t rounds = 0;
};

/// Statistics of the upper bounds from lines of sight.
struct BoundTally {
  std::size_t samples = 0;
  std::size_t broken = 0;  ///< heights that exceed their bound by three standard deviations
};

/// Report on a DEM made from scans and stereo pairs.
struct DemReport {
  std::vector<std::pair<std::string, std::string>> facts;  ///< names and values about the command
  std::vector<PointTally> scans, pairs;
  std::optional<GroundCounts> ground;
  FusionCounts fusion;
  std::optional<BoundTally> bound;
  std::optional<SmoothTally> smoothed;
  std::optional<FillTally> filled;
  std::array<std::size_t, 5> sources{};  ///< number of samples by HeightSource
  std::vector<HeightErrors> errors;      ///< comparison with the truth, or empty
  double colour_m = 0;  ///< value of the picture's most saturated colour; 0 without one
  GridFrame frame;
  Georeference georeference;
  std::vector<std::pair<std::string, double>> seconds;  ///< duration of each stage
  std::vector<std::string> notes;
};

/// Prints a report as text.
void print(const DemReport& report);

/// Writes a report as JSON (docs/reference/formats.md). @throws Error as write_whole.
void write_json(const std::filesystem::path& path, const DemReport& report);

}  // namespace groundray
