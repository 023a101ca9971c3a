#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/scan_files.h"
#include "apps/dataset/scan_input.h"
#include "apps/groundray/command.h"
#include "reconstruction/pipeline/dem_pipeline.h"
#include "reconstruction/pipeline/dem_points.h"
#include "terrain/dem/density_map.h"

namespace groundray {

/// Errors of measurements and of poses.
struct MeasurementNoise {
  /// Without a divergence, that of the calibration of a dataset's lidar is used.
  PointNoise points;
  double longest_pose_gap_s = 1;
};

/// Source of upper bounds for ground that was not measured: none, or passing beams.
enum class SightUse { None, Beams };

/// Selection of a dataset's stereo pairs.
struct PairChoice {
  bool are_any = true;
  std::vector<std::string> names;  ///< names of pairs, or LEFT,RIGHT; empty for all
  FrameRange frames;
};

/// Output files.
struct DemOutput {
  std::filesystem::path dem;
  std::optional<std::filesystem::path> report;     ///< JSON
  std::optional<std::filesystem::path> picture;    ///< PNG
  std::optional<std::filesystem::path> error_map;  ///< GeoTIFF
  ReportFacts facts;
};

/// Request for a DEM from scans and stereo pairs.
struct DemRequest {
  ScanChoice choice;
  ScanTaking taking;
  MeasurementNoise noise;
  PairChoice pairs;
  StereoOptions stereo;

  std::optional<double> cell_m;
  std::optional<std::filesystem::path> like, truth;
  std::optional<Area> area_w;

  DemBuildOptions dem;
  SightUse sight = SightUse::Beams;

  DemOutput output;
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();
};

/// Makes the requested DEM, writes it and prints a report.
/// @throws Error describing a fault of the request or its files, or if no point yields ground.
void rebuild_dem(const DemRequest& request);

}  // namespace groundray
