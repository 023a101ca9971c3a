#include "reconstruction/scan/range_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <vector>

namespace groundray {

double apparent_sd_m(const OrganisedScan& scan) {
  check_scan(scan, "the scan");
  const auto rows = static_cast<std::size_t>(scan.rows);
  const auto columns = static_cast<std::size_t>(scan.columns);
  const auto inverse = [&](std::size_t cell) {
    return 1 / glm::distance(scan.points_m[cell], scan.origins_m[cell]);
  };
  // Along a line the inverse of range is linear but for the square of the step.
  std::vector<double> off_m;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 1; column + 1 < columns; ++column) {
      const std::size_t cell = row * columns + column;
      const double a = inverse(cell - 1), b = inverse(cell), c = inverse(cell + 1);
      const double off =
          std::abs(a - 2 * b + c) / std::sqrt(a * a * a * a + 4 * b * b * b * b + c * c * c * c);
      if (std::isfinite(off)) off_m.push_back(off);
    }
  }
  if (off_m.empty()) return 0;
  const auto middle = off_m.begin() + static_cast<std::ptrdiff_t>(off_m.size() / 2);
  std::ranges::nth_element(off_m, middle);
  return *middle / 0.6744897501960817;  // of a normal distribution
}

}  // namespace groundray
