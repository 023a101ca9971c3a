#include "reconstruction/mesh/accuracy/two_sided_error.h"

#include <algorithm>

namespace groundray {

HausdorffDistance TwoSidedError::largest() const noexcept {
  return {std::max(forth.at_least_m, back.at_least_m), std::max(forth.at_most_m, back.at_most_m)};
}

double TwoSidedError::mean_m() const noexcept {
  return std::max(forth.mean.value_m, back.mean.value_m);
}

double TwoSidedError::rms_m() const noexcept {
  return std::max(forth.rms.value_m, back.rms.value_m);
}

TwoSidedError two_sided_error(const TriangleMesh& first, const TriangleMesh& second,
                              const ErrorFineness& fineness, const RayDevice& device) {
  return {MeshDistance(first, second, device).error(fineness),
          MeshDistance(second, first, device).error(fineness)};
}

TwoSidedError two_sided_error(const ClosestPoint& first, const ClosestPoint& second,
                              const ErrorFineness& fineness) {
  return {MeshDistance(first.mesh(), second).error(fineness),
          MeshDistance(second.mesh(), first).error(fineness)};
}

}  // namespace groundray
