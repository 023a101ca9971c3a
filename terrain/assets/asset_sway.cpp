#include "terrain/assets/asset_sway.h"

#include <glm/common.hpp>
#include <glm/trigonometric.hpp>

#include "terrain/assets/asset_defaults.h"

namespace groundray {
namespace {

// Inclination of a plant's stems in a wind of 10 m/s, degrees.
struct Yield {
  double lean_deg = 0;
  bool is_tree = false;
};

Yield yield_of(AssetKind kind) {
  switch (kind) {
    case AssetKind::Conifer:
    case AssetKind::BroadleafTree:
    case AssetKind::Spruce:
    case AssetKind::Pine:
    case AssetKind::Birch:
    case AssetKind::Oak:
      return {2, true};
    case AssetKind::Snag:
      return {0.5, true};
    case AssetKind::Shrub:
    case AssetKind::Bush:
      return {5};
    case AssetKind::Fern:
      return {10};
    case AssetKind::Reed:
      return {15};
    case AssetKind::GrassTuft:
    case AssetKind::GrassPatch:
      return {20};
    default:
      return {};
  }
}

// Regression over 602 conifers: Moore and Maguire (2004). Diameters are those of trees whose height
// is 55 times their diameter.
double tree_frequency_hz(double height_m) {
  const double diameter_cm = 100 * height_m / 55;
  return 0.0766 + 3.1219 * diameter_cm / (height_m * height_m);
}

}  // namespace

Flexibility asset_flexibility(const AssetSpec& spec) {
  const Yield yield = yield_of(spec.kind);
  if (yield.lean_deg == 0) return {};
  const double height_m = spec.size_m.value_or(asset_defaults(spec.kind).size_m);
  constexpr double herb_m_hz = 1.7;
  const double frequency_hz = yield.is_tree ? tree_frequency_hz(height_m) : herb_m_hz / height_m;
  return {glm::clamp(frequency_hz, 0.01, 100.0), glm::radians(yield.lean_deg)};
}

}  // namespace groundray
