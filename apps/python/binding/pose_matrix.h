#pragma once

#include <cstddef>
#include <glm/gtc/quaternion.hpp>
#include <vector>

#include "apps/python/binding/arrays.h"
#include "core/geometry/pose.h"

namespace groundray::python {

/// Returns X_AB as the 4 x 4 matrix that maps (x, y, z, 1) in B to A.
inline AnyArray matrix_of(const Pose& X_AB) {
  const glm::dmat3 R_AB = glm::mat3_cast(X_AB.rotation);
  std::vector<double> values(16, 0.0);
  for (std::size_t row = 0; row < 3; ++row) {
    const auto axis = static_cast<int>(row);
    for (std::size_t column = 0; column < 3; ++column)
      values[4 * row + column] = R_AB[static_cast<int>(column)][axis];
    values[4 * row + 3] = X_AB.translation_m[axis];
  }
  values[15] = 1;
  return array_of(std::move(values), {4, 4});
}

}  // namespace groundray::python
