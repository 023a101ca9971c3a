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
#include "core/grid_frame.h"
#include "core/mesh_io.h"
#include "reconstruction/dem/dem_fusion.h"
#include "reconstruction/dem/ground_filter.h"

namespace groundray {

/// What smoothing did.
struct SmoothTally {
  double curvature_sd_per_m = 0;
  std::size_t rounds = 0;
};

/// How many samples lines of sight bound.
struct BoundTally {
  std::size_t samples = 0;
  std::size_t broken = 0;  ///< measured heights above it by more than three standard deviations
};

/// All that became of scans and pairs on their way to a DEM.
struct DemReport {
  std::vector<std::pair<std::string, std::string>> facts;  ///< of the command, by name
  std::vector<PointTally> scans, pairs;
  std::optional<GroundCounts> ground;
  FusionCounts fusion;
  std::optional<BoundTally> bound;
  std::optional<SmoothTally> smoothed;
  std::optional<FillTally> filled;
  std::array<std::size_t, 5> sources{};  ///< samples by HeightSource
  std::vector<HeightErrors> errors;      ///< against the truth; or none
  double colour_m = 0;                   ///< what a picture's fullest colour is; 0 for none
  GridFrame frame;
  Georeference georeference;
  std::vector<std::pair<std::string, double>> seconds;  ///< of each stage
  std::vector<std::string> notes;
};

/// Prints a report for people.
void print(const DemReport& report);

/// Writes a report as JSON (docs/formats.md). @throws Error as write_whole.
void write_json(const std::filesystem::path& path, const DemReport& report);

}  // namespace groundray
