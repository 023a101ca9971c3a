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
#include "reconstruction/dem/dem_fill.h"
#include "reconstruction/dem/dem_fusion.h"
#include "reconstruction/dem/dem_smooth.h"
#include "reconstruction/dem/ground_filter.h"
#include "terrain/area.h"

namespace groundray {

/// What fills blank areas: a smoothest surface, or meshes.
enum class FillMethod { Tension, Mesh };

/// Which stereo pairs of a dataset measure.
struct PairChoice {
  bool are_any = true;
  std::vector<std::string> names;  ///< or LEFT,RIGHT; none for all
};

/// Where results go.
struct DemOutput {
  std::filesystem::path dem;
  std::optional<std::filesystem::path> report;             ///< JSON
  std::optional<std::filesystem::path> picture;            ///< PNG
  std::optional<std::filesystem::path> error_map;          ///< GeoTIFF
  std::vector<std::pair<std::string, std::string>> facts;  ///< for the report
};

/// How scans and stereo pairs become one DEM.
struct DemRequest {
  ScanChoice choice;
  ScanTaking taking;
  PointNoise noise;
  PairChoice pairs;
  StereoTaking stereo;

  std::optional<double> cell_m;
  std::optional<std::filesystem::path> like, truth;
  std::optional<Area> area_w;

  std::optional<GroundFilterOptions> filter;  ///< of points; none for all points
  FusionOptions fusion;
  std::optional<SmoothOptions> smooth;
  std::optional<FillOptions> fill = FillOptions{};
  FillMethod fill_method = FillMethod::Tension;
  std::size_t most_rim_edges = 1000;  ///< of holes that meshes fill
  SightUse sight = SightUse::Beams;
  std::optional<double> sight_margin_m;  ///< else a quarter of a cell

  DemOutput output;
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();
};

/// Makes a DEM as asked for, writes it and prints what became of it.
/// @throws Error naming what is wrong with the request or its files, or that no point makes ground.
void rebuild_dem(const DemRequest& request);

}  // namespace groundray
