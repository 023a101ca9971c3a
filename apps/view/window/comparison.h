#pragma once

#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include "apps/scene/simulation.h"
#include "apps/view/compare/deviation.h"
#include "apps/view/rendering/layer.h"

namespace groundray {

/// Reference that a layer is compared with.
struct Truth {
  /// DEM file.
  struct DemFile {
    std::filesystem::path path;
  };
  std::string name;  ///< name for display, unique among the truths that are offered
  /// Reference surface of a scene, that of a DEM file, or a displayed surface.
  std::variant<std::shared_ptr<const Simulation>, DemFile, Layer> what;
};

/// Comparison of a layer with the truth.
struct Comparison {
  std::string layer, truth;
  Deviation deviation;  ///< deviations of the layer's points
  DeviationHistogram histogram;
  std::vector<Agreement> agreements;  ///< agreement of two surfaces, if a tolerance is given
};

/// Measures the distances of a layer's points from the truth. Thread-safe.
/// @param tolerance_m  tolerance for precision and completeness of two surfaces; 0 to omit them.
/// @throws Interrupted if a stop is requested.
/// @throws Error if a file is invalid, the truth has no triangle, or no point has a deviation.
Comparison compare(const Layer& layer, const Truth& truth, double tolerance_m,
                   const std::stop_token& stop, const ShareDone& progress);

/// Returns the layer coloured by its deviations, as the column "deviation".
Layer coloured_by_deviation(Layer layer, const Comparison& comparison);

}  // namespace groundray
