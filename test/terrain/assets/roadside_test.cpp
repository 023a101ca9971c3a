#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <string_view>

#include "terrain/assets/asset.h"

namespace groundray::roadside_test {
namespace {

// Area of the triangles of a surface that face forward, in projection along x.
double area_ahead(const Model& model, std::string_view surface) {
  double sum = 0;
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    if (model.surfaces[model.surface_of[i]].name != surface) continue;
    const glm::uvec3& t = model.mesh.triangles[i];
    const auto& p = model.mesh.vertices_m;
    sum += std::max(glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]).x / 2, 0.0);
  }
  return sum;
}

double volume(const Model& model) {
  double sum = 0;
  for (const glm::uvec3& t : model.mesh.triangles) {
    const auto& p = model.mesh.vertices_m;
    sum += glm::dot(p[t.x], glm::cross(p[t.y], p[t.z])) / 6;
  }
  return sum;
}

// MUTCD: 24 by 30 inches (variant 2) and an octagon of 30 inches (variant 1). The face shows twice,
// as a layer within 99.5 % of the plate and one within 93.5 % above the border; on a stop sign only
// the latter. A lean of the post is a shear and keeps areas. Corners of the octagon are rounded by
// 2 % of its radius, which takes 0.0001 of its area.
TEST(Sign, HasTheAreaOfItsStandardPlate) {
  const double inch = 0.0254;
  const double plate = 24 * 30 * inch * inch;
  EXPECT_NEAR(area_ahead(make_asset({.kind = AssetKind::Sign, .seed = {2}}), "sign_face"),
              plate * (0.995 * 0.995 + 0.935 * 0.935), 1e-9);
  const double octagon = 2 * (std::numbers::sqrt2 - 1) * std::pow(30 * inch, 2);
  EXPECT_NEAR(area_ahead(make_asset({.kind = AssetKind::Sign, .seed = {1}}), "sign_face"),
              octagon * 0.935 * 0.935, 2e-4 * octagon);
}

// Section 2A.18: 5 feet from the ground to the lower edge.
TEST(Sign, HangsFiveFeetAboveTheGround) {
  const Model model = make_asset({.kind = AssetKind::Sign});
  double lowest = 1e9, highest = -1e9;
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    if (model.surfaces[model.surface_of[i]].name != "sign_face") continue;
    for (int k = 0; k < 3; ++k) {
      const double z = model.mesh.vertices_m[model.mesh.triangles[i][k]].z;
      lowest = std::min(lowest, z);
      highest = std::max(highest, z);
    }
  }
  EXPECT_GE(lowest, 5 * 0.3048);
  EXPECT_LT(highest, 2.6);
  // A diamond of 30 inches, with rounded corners.
  EXPECT_NEAR(highest - lowest, 0.762 * std::numbers::sqrt2, 0.06);
}

// A cylinder of 5 feet across and 4 feet wide. Rounded edges, the flat foot and the layers take or
// add about a hundredth.
TEST(HayBale, HasTheVolumeOfItsCylinder) {
  for (const std::uint64_t seed : {0u, 1u, 2u}) {
    const Model bale = make_asset({.kind = AssetKind::HayBale, .seed = {seed}});
    const double cylinder = std::numbers::pi * std::pow(1.524 / 2, 2) * 1.219;
    EXPECT_NEAR(volume(bale), cylinder, 0.015 * cylinder);
  }
}

}  // namespace
}  // namespace groundray::roadside_test
