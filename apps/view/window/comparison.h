#pragma once

#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include "apps/scene/world.h"
#include "apps/view/deviation.h"
#include "apps/view/layer.h"

namespace groundray {

/// What something shown is measured against.
struct Truth {
  /// A DEM's file.
  struct DemFile {
    std::filesystem::path path;
  };
  std::string name;  ///< for people, unique among those that are offered
  /// The reference surface of a scene; that of a DEM file; or a surface that is shown.
  std::variant<std::shared_ptr<const World>, DemFile, Layer> what;
};

/// How a layer compares with the truth.
struct Comparison {
  std::string layer, truth;
  Deviation deviation;  ///< of each of the layer's points
  DeviationHistogram histogram;
  std::vector<Agreement> agreements;  ///< of two surfaces, if a tolerance is given
};

/// Measures how far a layer's points are from the truth. Any thread may call it.
/// @param tolerance_m  at which precision and completeness of surfaces are told; 0 for none.
/// @throws Interrupted if asked to stop. @throws Error if a file is at fault, or a surface has no
///         triangle.
Comparison compare(const Layer& layer, const Truth& truth, double tolerance_m,
                   const std::stop_token& stop, const ShareDone& progress);

/// Returns the layer with its deviations as the column "deviation", coloured by that.
Layer coloured_by_deviation(Layer layer, const Comparison& comparison);

}  // namespace groundray
