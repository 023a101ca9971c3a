#include "reconstruction/mesh/accuracy/agreement.h"

#include "reconstruction/mesh/accuracy/accuracy.h"

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

}  // namespace groundray
