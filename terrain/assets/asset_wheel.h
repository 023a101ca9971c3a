#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

#include "terrain/assets/asset_builder.h"

namespace groundray {

/// Pattern of a tyre's tread: blocks in rows round the tyre, or bars from the middle to the
/// shoulders, alternately left and right, that point forward at the top.
enum class Tread : std::uint8_t { Blocks, Bars };

/// A wheel that turns about y.
struct WheelShape {
  glm::dvec3 centre{0};
  double radius = 0, width = 0;  ///< of the tyre, with its tread
  double rim = 0;                ///< radius of the rim
  double outer = 1;              ///< 1 if its outer side is the left one, -1 for the right
  Tread tread = Tread::Blocks;
  int count = 48;      ///< blocks in a row, or bars on each side
  double height = 0;   ///< of the tread
  int spokes = 6;      ///< 0 for a plain disc
  double dish = 0.35;  ///< depth of the disc below the outer side, as a fraction of the width
};

/// Surfaces of a wheel.
struct WheelSurfaces {
  std::uint16_t tyre = 0, rim = 0, dark = 0;
};

/// Adds a wheel. Its tread reaches `radius`, exactly so at the lowest point.
void add_wheel(AssetBuilder& builder, const WheelShape& wheel, const WheelSurfaces& surfaces,
               double detail);

}  // namespace groundray
