#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh_io.h"
#include "reconstruction/dem/dem_layers.h"
#include "terrain/dem.h"

namespace groundray {

/// What a DEM's heights are off, over some of its samples. NaN of no sample.
struct HeightErrors {
  std::string of;           ///< which samples: "measured", "filled", ...
  std::size_t samples = 0;  ///< that the truth has, too
  double bias_m = 0;        ///< mean error
  double rmse_m = 0;
  double nmad_m = 0;  ///< 1.4826 times the median of distances to the median
  double p95_m = 0;   ///< 95 % of errors are no larger
  double largest_m = 0;
  /// Of errors over their stated standard deviations, where these are above 0:
  std::size_t stated = 0;
  double normalised_rms = 0;     ///< 1 if the standard deviations are honest
  double normalised_robust = 0;  ///< the same by the median of squares
  double within_1sd = 0;         ///< share; 0.683 of normal errors
  double within_2sd = 0;         ///< 0.954
};

/// A DEM held against the truth.
struct TruthComparison {
  std::vector<HeightErrors> errors;  ///< of measured samples, each source and filled ones
  std::vector<float> error_m;        ///< of each sample; NaN where either has no height
  std::vector<float> normalised;     ///< over the stated standard deviation; NaN likewise
};

/// Compares heights with those of the truth's surface at the samples' places.
/// @param georeference  of the layers' D, whose height is W's.
TruthComparison compare_with_truth(const DemLayers& layers, const Georeference& georeference,
                                   const Dem& truth);

}  // namespace groundray
