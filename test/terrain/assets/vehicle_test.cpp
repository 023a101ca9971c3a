#include <gtest/gtest.h>

#include <algorithm>
#include <glm/common.hpp>
#include <string_view>

#include "core/model/model.h"
#include "terrain/assets/asset.h"

namespace groundray::vehicle_test {
namespace {

// Box of the triangles of a surface whose middle has an x between two bounds.
ModelBounds box_of(const Model& model, std::string_view surface, double low_x = -1e9,
                   double high_x = 1e9) {
  ModelBounds box{glm::dvec3(1e9), glm::dvec3(-1e9)};
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    if (model.surfaces[model.surface_of[i]].name != surface) continue;
    const glm::uvec3& t = model.mesh.triangles[i];
    const auto& p = model.mesh.vertices_m;
    const double x = (p[t.x].x + p[t.y].x + p[t.z].x) / 3;
    if (x < low_x || x > high_x) continue;
    for (int k = 0; k < 3; ++k) {
      box.low_m = glm::min(box.low_m, p[t[k]]);
      box.high_m = glm::max(box.high_m, p[t[k]]);
    }
  }
  return box;
}

glm::dvec3 extent(const ModelBounds& box) { return box.high_m - box.low_m; }

// Diameter of a tyre by its designation: rim in inches, width in mm, height of the side in per
// cent of the width.
double tyre_m(double width_mm, double percent, double rim_in) {
  return rim_in * 0.0254 + 2 * width_mm * percent * 1e-5;
}

// drive.com.au, 26 August 2022: 5265 x 1855 x 1865 mm, wheelbase 3085 mm, tyres 265/65 R17. The
// sheet metal is meshed in cells of 40 mm, whose vertices are on the surface but not at its
// extremes: 8 mm is a fifth of a cell.
TEST(Pickup, HasTheDimensionsOfItsDataSheet) {
  const Model model = make_asset({.kind = AssetKind::Pickup});
  const glm::dvec3 size = extent(bounds_of(model.mesh)), paint = extent(box_of(model, "paint"));
  EXPECT_NEAR(size.x, 5.265, 1e-12);
  EXPECT_NEAR(size.z, 1.865, 0.008);
  EXPECT_NEAR(paint.y, 1.855, 0.008);
  const double tyre = tyre_m(265, 65, 17);
  EXPECT_NEAR(extent(box_of(model, "tyre")).x, 3.085 + tyre, 0.003);
  EXPECT_NEAR(extent(box_of(model, "tyre", 0)).z, tyre, 0.003);
  EXPECT_NEAR(extent(box_of(model, "tyre")).y, 1.550 + 0.265, 0.003);
  // All of a tyre's weight is on the ground that the others stand on.
  EXPECT_NEAR(box_of(model, "tyre", 0).low_m.z, 0, 1e-12);
  EXPECT_NEAR(box_of(model, "tyre", -9, 0).low_m.z, 0, 1e-12);
}

// husky_description (github.com/husky/husky): base 0.9874 m long, wheelbase 0.5120, track 0.5708,
// wheels of radius 0.1651 and width 0.1143. Blocks of the tread may turn their corners aside: 2 mm.
TEST(Ugv, HasTheDimensionsOfItsDescription) {
  const Model model = make_asset({.kind = AssetKind::Ugv});
  const glm::dvec3 size = extent(bounds_of(model.mesh)), tyres = extent(box_of(model, "tyre"));
  EXPECT_NEAR(size.x, 0.9874, 1e-12);
  EXPECT_NEAR(size.y, 0.5708 + 0.1143, 0.002);
  EXPECT_NEAR(tyres.x, 0.5120 + 2 * 0.1651, 0.002);
  EXPECT_NEAR(tyres.z, 2 * 0.1651, 0.002);
  EXPECT_NEAR(size.z, 0.92 + 0.0755, 0.001);  // mast and lidar: our own
}

// Tyres 520/70 R38 and 420/70 R28. The corners of bars are 0.1 % farther out than their middles.
TEST(Tractor, HasTyresOfTheirDesignation) {
  const Model model = make_asset({.kind = AssetKind::Tractor});
  EXPECT_NEAR(extent(bounds_of(model.mesh)).x, 4.47, 1e-12);
  const ModelBounds rear = box_of(model, "tyre", -9, 0), front = box_of(model, "tyre", 0);
  EXPECT_NEAR(extent(rear).z, tyre_m(520, 70, 38), 0.006);
  EXPECT_NEAR(extent(front).z, tyre_m(420, 70, 28), 0.006);
  EXPECT_NEAR((front.low_m.x + front.high_m.x - rear.low_m.x - rear.high_m.x) / 2, 2.40, 0.005);
  EXPECT_NEAR(rear.low_m.z, front.low_m.z, 0.002);
}

}  // namespace
}  // namespace groundray::vehicle_test
