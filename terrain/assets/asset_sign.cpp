// Road signs on a post. Sides and colours follow the MUTCD (2009): a warning diamond of 30 inches
// (W1-1, table 2C-2), a stop sign of 30 inches (R1-1, table 2B-1) and a regulatory plate of 24 by
// 30 inches (R2-1); the lower edge of a diamond is 5 feet above the ground, as on rural roads
// (section 2A.18). Symbols and the post are our own.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_shapes.h"

namespace groundray {
namespace {

using Outline2 = std::vector<glm::dvec2>;  // y and z, counter-clockwise as seen from ahead

// Regular polygon with a circumradius of 1 and rounded corners.
Outline2 rounded_polygon(int corners, double first_rad, double rounding) {
  Outline2 outline;
  const double turn = 2 * std::numbers::pi / corners;
  const double inner = 1 - rounding / math::cos(turn / 2);
  for (int i = 0; i < corners; ++i) {
    for (int k = -2; k <= 2; ++k) {
      const double angle = first_rad + turn * i, at = angle + turn * k / 4;
      outline.push_back(inner * glm::dvec2(math::cos(angle), math::sin(angle)) +
                        rounding * glm::dvec2(math::cos(at), math::sin(at)));
    }
  }
  return outline;
}

class SignMaker {
 public:
  SignMaker(AssetBuilder& builder, const AssetShape& shape, std::uint64_t form)
      : builder_(builder), form_(form % 3), top_(shape.size_m), side_(shape.width_m) {
    constexpr std::array<glm::vec3, 3> grounds = {
        {{0.62f, 0.38f, 0.012f}, {0.38f, 0.015f, 0.02f}, {0.75f, 0.75f, 0.74f}}};
    constexpr std::array<glm::vec3, 3> legends = {
        {{0.03f, 0.03f, 0.03f}, {0.75f, 0.75f, 0.74f}, {0.03f, 0.03f, 0.03f}}};
    AssetRandom random = shape.random;
    const auto faded = static_cast<float>(random.between(0.85, 1));
    lean_ = 0.02 * random.normal();
    face_ = builder.surface("sign_face", grounds[form_] * faded);
    legend_ = builder.surface("sign_legend", legends[form_]);
    steel_ = builder.add_surface(asset_surface("metal"));
  }

  // Sideways lean of the post, as a slope.
  double lean() const { return lean_; }

  void add() {
    add_post();
    if (form_ == 0) {
      const double r = side_ / std::numbers::sqrt2;
      add_plate(rounded_polygon(4, 0, 0.10), r);
      add_arrow(0.55 * r, top_ - r);
    } else if (form_ == 1) {
      const double eighth = std::numbers::pi / 8;
      const double r = side_ / 2 / math::cos(eighth);
      add_plate(rounded_polygon(8, eighth, 0.02), r);
      add_layer({{-0.30, -0.055}, {0.30, -0.055}, {0.30, 0.055}, {-0.30, 0.055}}, side_,
                top_ - side_ / 2, 0.004, legend_);
    } else {
      const Outline2 plate = {{-0.4, -0.5}, {0.4, -0.5}, {0.4, 0.5}, {-0.4, 0.5}};
      add_plate(plate, side_);
      for (const double z : {0.30, 0.15})
        add_layer({{-0.24, z - 0.04}, {0.24, z - 0.04}, {0.24, z + 0.04}, {-0.24, z + 0.04}}, side_,
                  top_ - side_ / 2, 0.004, legend_);
      for (const double y : {-0.13, 0.13})
        add_layer({{y - 0.07, -0.33}, {y + 0.07, -0.33}, {y + 0.07, 0}, {y - 0.07, 0}}, side_,
                  top_ - side_ / 2, 0.004, legend_);
    }
  }

 private:
  // A layer of sheeting on the plate, 1 mm thick, `height` in front of the plate's back.
  void add_layer(const Outline2& outline, double scale, double centre_z, double height,
                 std::uint16_t surface, double thickness = 0.0015) {
    Section low, high;
    for (const glm::dvec2& p : outline) {
      const glm::dvec2 q = p * scale;
      low.emplace_back(0.03 + height - thickness, q.x, centre_z + q.y);
      high.emplace_back(0.03 + height, q.x, centre_z + q.y);
    }
    builder_.add_loft(low, high, surface);
  }

  // Back of sheet metal, border and face.
  void add_plate(const Outline2& outline, double scale) {
    double high = 0;
    for (const glm::dvec2& p : outline) high = std::max(high, p.y);
    const double centre = top_ - high * scale;
    add_layer(outline, scale, centre, 0.0012, steel_, 0.0022);
    // A diamond's border is black within a yellow edge, the other's are those of their legend.
    if (form_ != 1) add_layer(outline, 0.995 * scale, centre, 0.0018, face_, 0.001);
    add_layer(outline, (form_ == 1 ? 0.995 : 0.965) * scale, centre, 0.0024, legend_, 0.001);
    add_layer(outline, 0.935 * scale, centre, 0.0031, face_, 0.001);
  }

  // A bent arrow: the road turns left.
  void add_arrow(double r, double centre_z) {
    const Outline2 arrow = {{-0.28, -0.75}, {-0.06, -0.75}, {-0.06, -0.10}, {0.02, 0.06},
                            {0.20, 0.10},   {0.20, -0.12},  {0.66, 0.22},   {0.20, 0.56},
                            {0.20, 0.34},   {-0.12, 0.28},  {-0.28, 0.02}};
    add_layer(arrow, r, centre_z, 0.004, legend_);
  }

  // A steel channel, open to the rear, from below the ground to the upper third of the plate.
  void add_post() {
    const Outline2 channel = {{0.026, -0.04}, {0.026, 0.04},   {-0.012, 0.04},   {-0.012, 0.036},
                              {0.022, 0.036}, {0.022, -0.036}, {-0.012, -0.036}, {-0.012, -0.04}};
    Section low, high;
    for (const glm::dvec2& p : channel) {
      low.emplace_back(p.x, p.y, -0.6);
      high.emplace_back(p.x, p.y, top_ - 0.12 * side_);
    }
    builder_.add_loft(low, high, steel_);
    for (const double share : {0.25, 0.75}) {  // bolts
      const double z = top_ - share * side_;
      const std::array<LatheRing, 4> bolt = {
          {{0, 0, steel_}, {0, 0.009, steel_}, {0.016, 0.009, steel_}, {0.016, 0, steel_}}};
      add_lathe(builder_, {0.0205, 0, z}, 0, bolt, 12);
    }
  }

  AssetBuilder& builder_;
  std::uint64_t form_;
  double top_, side_;
  double lean_ = 0;
  std::uint16_t face_ = 0, legend_ = 0, steel_ = 0;
};

}  // namespace

Model make_sign(AssetShape shape) {
  AssetBuilder builder;
  SignMaker maker(builder, shape, shape.seed.value);
  maker.add();
  Model model = builder.take();
  for (glm::dvec3& p : model.mesh.vertices_m) p.y += maker.lean() * p.z;
  return creased(std::move(model), 0.6);
}

}  // namespace groundray
