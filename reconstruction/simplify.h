#pragma once

#include <cstddef>
#include <optional>
#include <variant>

#include "reconstruction/measured_mesh.h"
#include "reconstruction/work.h"

namespace groundray {

/// Stop before any vertex of the original is farther than this above or below the result, and its
/// border farther than `border_m` from the result's. For terrain: no triangle may hang over.
struct VerticalBound {
  double error_m = 0;
  double border_m = 0;
};

/// Stop before a point of either surface is farther than this from the other, and either border
/// farther than `border_m` from the other's.
struct DistanceBound {
  double error_m = 0;
  double border_m = 0;
};

/// Stop at so many triangles.
struct FaceBudget {
  std::size_t triangles = 0;
};

/// Stop where the error reaches so many standard deviations of the measurements: what is finer is
/// noise.
struct NoiseBound {
  double sds = 2;
};

/// Stop at the knee of cost over triangles.
struct CostKnee {};

using Halt = std::variant<VerticalBound, DistanceBound, FaceBudget, NoiseBound, CostKnee>;

}  // namespace groundray
