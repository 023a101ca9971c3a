#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/dataset/scan_files.h"
#include "apps/dataset/scan_input.h"
#include "apps/groundray/dem/dem_points.h"
#include "apps/groundray/dem/dem_sight.h"
#include "apps/groundray/dem/dem_stereo.h"
#include "reconstruction/dem/fill/dem_fill.h"
#include "reconstruction/dem/fusion/dem_fusion.h"
#include "reconstruction/dem/ground/ground_filter.h"
#include "reconstruction/dem/smooth/dem_smooth.h"
#include "terrain/dem/density_map.h"

namespace groundray {

/// Method for filling blank areas: the smoothest surface, or faired meshes.
enum class FillMethod { Tension, Mesh };

/// Selection of a dataset's stereo pairs.
struct PairChoice {
  bool are_any = true;
  std::vector<std::string> names;  ///< names of pairs, or LEFT,RIGHT; empty for all
};

/// Output files.
struct DemOutput {
  std::filesystem::path dem;
  std::optional<std::filesystem::path> report;             ///< JSON
  std::optional<std::filesystem::path> picture;            ///< PNG
  std::optional<std::filesystem::path> error_map;          ///< GeoTIFF
  std::vector<std::pair<std::string, std::string>> facts;  ///< names and values for the report
};

/// Request for a DEM from scans and stereo pairs.
struct DemRequest {
  ScanChoice choice;
  ScanTaking taking;
  PointNoise noise;
  PairChoice pairs;
  StereoTaking stereo;

  std::optional<double> cell_m;
  std::optional<std::filesystem::path> like, truth;
  std::optional<Area> area_w;

  std::optional<GroundFilterOptions> filter;  ///< filter for the points; none to use all points
  FusionOptions fusion;
  std::optional<SmoothOptions> smooth;
  std::optional<FillOptions> fill = FillOptions{};
  FillMethod fill_method = FillMethod::Tension;
  std::size_t most_rim_edges = 1000;  ///< limit for holes that meshes fill
  SightUse sight = SightUse::Beams;
  std::optional<double> sight_margin_m;  ///< default: a quarter of a cell

  DemOutput output;
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();
};

/// Makes the requested DEM, writes it and prints a report.
/// @throws Error describing a fault of the request or its files, or if no point yields ground.
void rebuild_dem(const DemRequest& request);

}  // namespace groundray
