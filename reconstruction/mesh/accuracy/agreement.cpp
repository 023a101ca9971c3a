#include "reconstruction/mesh/accuracy/agreement.h"

#include <algorithm>

namespace groundray {
namespace {

double harmonic_mean(double a, double b) { return a + b > 0 ? 2 * a * b / (a + b) : 0; }

}  // namespace

// The harmonic mean increases with both arguments, so it maps bounds to bounds.
AreaShare Agreement::f1() const noexcept {
  return {harmonic_mean(precision.value, completeness.value),
          harmonic_mean(precision.at_least, completeness.at_least),
          harmonic_mean(precision.at_most, completeness.at_most)};
}

std::vector<Agreement> agreement(const TriangleMesh& mesh, const TriangleMesh& truth,
                                 std::span<const double> tolerances_m,
                                 const ShareFineness& fineness, const SurfaceWeight& truth_weight,
                                 const RayDevice& device) {
  const auto precision = MeshDistance(mesh, truth, device).within(tolerances_m, fineness);
  const auto completeness =
      MeshDistance(truth, mesh, device).within(tolerances_m, fineness, truth_weight);
  std::vector<Agreement> all;
  for (std::size_t k = 0; k < tolerances_m.size(); ++k)
    all.push_back({tolerances_m[k], precision[k], completeness[k]});
  return all;
}

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
