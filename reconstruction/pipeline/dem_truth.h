#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "core/io/mesh_io.h"
#include "reconstruction/dem/dem_layers.h"
#include "terrain/dem/dem_io.h"

namespace groundray {

/// Errors of a DEM's heights over a set of samples; NaN for an empty set.
struct HeightErrors {
  std::string of;           ///< name of the set: "measured", "filled", ...
  std::size_t samples = 0;  ///< number of samples with a height in both
  double bias_m = 0;        ///< mean error
  double rmse_m = 0;
  double nmad_m = 0;  ///< 1.4826 times the median absolute deviation from the median
  double p95_m = 0;   ///< 95 % quantile of the absolute error
  double largest_m = 0;
  /// Number of samples with a stated standard deviation above 0; the figures below are of their
  /// errors, divided by it.
  std::size_t stated = 0;
  double normalised_rms = 0;     ///< 1 if the standard deviations are correct
  double normalised_robust = 0;  ///< the same from the median of squares
  double within_1sd = 0;         ///< fraction; 0.683 for normal errors
  double within_2sd = 0;         ///< fraction; 0.954 for normal errors
};

/// Comparison of a DEM with the truth.
struct TruthComparison {
  std::vector<HeightErrors> errors;  ///< errors of measured samples, each source, filled samples
  std::vector<float> error_m;        ///< error of each sample; NaN where either has no height
  std::vector<float> normalised;     ///< error over stated standard deviation, or NaN
};

/// Compares heights with those of the truth's surface at the samples' positions.
/// @param georeference  georeference of the layers' D.
TruthComparison compare_with_truth(const DemLayers& layers, const Georeference& georeference,
                                   const Dem& truth);

}  // namespace groundray
