#include "apps/groundray/dem/dem_output.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "apps/groundray/dem/dem_picture.h"
#include "apps/groundray/result_files.h"
#include "core/error.h"
#include "core/image/png_io.h"
#include "terrain/dem/layers_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr float no_height = std::numeric_limits<float>::quiet_NaN();

template <typename T>
std::vector<float> numbers(const std::vector<T>& values) {
  std::vector<float> all;
  all.reserve(values.size());
  for (const T value : values) all.push_back(static_cast<float>(value));
  return all;
}

std::vector<float> degrees(std::vector<float> values_rad) {
  for (float& value : values_rad) value *= static_cast<float>(180 / std::numbers::pi);
  return values_rad;
}

void write_layers(const fs::path& path, const DemLayers& layers, const Georeference& georeference) {
  const auto lidar = numbers(layers.lidar), stereo = numbers(layers.stereo),
             surfaces = numbers(layers.surfaces), source = numbers(layers.source),
             slope_deg = degrees(layers.slope_rad);
  const std::vector<RasterLayer> bands{{"elevation", "m", layers.elevation_m},
                                       {"variance", "m2", layers.variance_m2},
                                       {"n_lidar", "", lidar},
                                       {"n_stereo", "", stereo},
                                       {"chi2", "", layers.chi2},
                                       {"n_surfaces", "", surfaces},
                                       {"source", "", source},
                                       {"distance_to_data", "m", layers.to_data_m},
                                       {"fill_sd", "m", layers.fill_sd_m},
                                       {"upper_bound", "m", layers.upper_bound_m},
                                       {"slope", "deg", slope_deg},
                                       {"overhang", "m", layers.overhang_m},
                                       {"clearance", "m", layers.clearance_m}};
  write_layers(path, layers.frame, georeference, bands);
}

// Returns the slope (rise over run) along one axis; NaN if neither neighbour has a height.
float slope_along(const DemLayers& layers, std::ptrdiff_t i, int place, int count,
                  std::ptrdiff_t stride, double step_m) {
  const auto height_m = [&](std::ptrdiff_t at) {
    return layers.elevation_m[static_cast<std::size_t>(at)];
  };
  const float before_m = place > 0 ? height_m(i - stride) : no_height;
  const float after_m = place + 1 < count ? height_m(i + stride) : no_height;
  const auto step = static_cast<float>(step_m);
  if (!std::isnan(before_m) && !std::isnan(after_m)) return (after_m - before_m) / (2 * step);
  return (std::isnan(after_m) ? height_m(i) - before_m : after_m - height_m(i)) / step;
}

}  // namespace

void check_output(const DemOutput& output, std::span<const fs::path> inputs) {
  check_ending(output.dem, {".tif", ".tiff"});
  std::vector<fs::path> results{output.dem};
  if (output.picture) {
    check_ending(*output.picture, {".png"});
    results.push_back(*output.picture);
  }
  if (output.error_map) {
    check_ending(*output.error_map, {".tif", ".tiff"});
    results.push_back(*output.error_map);
  }
  if (output.report) results.push_back(*output.report);
  check_results(results, inputs);
}

void set_slopes(DemLayers& layers) {
  const glm::ivec2 samples = layers.frame.samples;
  std::ptrdiff_t i = 0;
  for (int row = 0; row < samples.y; ++row) {
    for (int column = 0; column < samples.x; ++column, ++i) {
      const float x = slope_along(layers, i, column, samples.x, 1, layers.frame.step_m.x);
      const float y = slope_along(layers, i, row, samples.y, samples.x, layers.frame.step_m.y);
      layers.slope_rad[static_cast<std::size_t>(i)] =
          std::isnan(layers.elevation_m[static_cast<std::size_t>(i)]) ? no_height
                                                                      : std::atan(std::hypot(x, y));
    }
  }
}

void write_output(const DemOutput& output, const DemLayers& layers, const TruthComparison* truth,
                  DemReport& report) {
  ResultFiles files;
  if (output.picture) {
    PictureScale scale;
    const std::vector<float> errors_m = truth != nullptr ? truth->error_m : std::vector<float>{};
    files.write(*output.picture,
                [&](const fs::path& path) { write_png(path, draw_dem(layers, errors_m, scale)); });
    report.colour_m = scale.most_m;
  }
  if (output.error_map && truth != nullptr) {
    const std::vector<RasterLayer> bands{{"error", "m", truth->error_m},
                                         {"normalised_error", "", truth->normalised}};
    files.write(*output.error_map, [&](const fs::path& path) {
      write_layers(path, layers.frame, report.georeference, bands);
    });
  }
  if (output.report)
    files.write(*output.report, [&](const fs::path& path) { write_json(path, report); });
  files.write(output.dem,
              [&](const fs::path& path) { write_layers(path, layers, report.georeference); });
  files.appear();
}

}  // namespace groundray
