#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/groundray/dem/dem_request.h"
#include "core/image/image.h"
#include "core/io/mesh_io.h"
#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/pipeline/dem_pipeline.h"
#include "reconstruction/pipeline/dem_points.h"
#include "reconstruction/pipeline/dem_truth.h"

namespace groundray {

/// Statistics of a scan or a stereo pair.
struct PointTally {
  std::string name;
  std::size_t rows = 0;            ///< rows of the file, or matched pixels
  std::size_t points = 0;          ///< number of points passed on to the DEM
  bool is_noiseless = false;       ///< true if no standard deviation of ranges is known
  std::vector<std::string> notes;  ///< messages for the user
  StereoTally pixels;              ///< use of a pair's pixels; all 0 for a scan
};

/// DEM made from scans and stereo pairs, and the report on it.
struct DemReport {
  std::vector<PointTally> scans, pairs;
  DemResult result;
  std::optional<TruthComparison> truth;
  double colour_m = 0;  ///< value of the picture's most saturated colour; 0 without one
  Georeference georeference;
  StageSeconds seconds;  ///< including those of `result`
  std::vector<std::string> notes;
};

/// Colour scale of a picture's third panel.
struct PictureScale {
  double most_m = 0;  ///< error or standard deviation of the most saturated colour, m
};

/// Draws a DEM as panels side by side, north up: a hillshade of the measured samples, with holes
/// dark; the same with filled samples, in orange; and the error, red where the DEM is too high and
/// blue where it is too low. Without errors, the third panel shows the stated standard deviation
/// (yellow is small, violet large). `scale` is set so that 95 % of the values are within it.
/// @param error_m  error of each sample, or empty.
Image8 draw_dem(const DemLayers& layers, const std::vector<float>& error_m, PictureScale& scale);

/// Checks, before long computations, that the results can be written.
/// @throws Error if not.
void check_output(const DemOutput& output, std::span<const std::filesystem::path> inputs);

/// Writes all requested results, with the report as JSON (docs/reference/formats.md), and prints
/// the report: either all files appear, each complete, or none. Sets the picture's scale in the
/// report.
/// @throws Error as the writers of the formats.
void write_output(const DemOutput& output, DemReport& report);

}  // namespace groundray
