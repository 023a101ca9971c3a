// A round bale of hay: a cylinder on its side with the layers of the roll on its ends, an uneven
// mantle, and straws that stand out.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_shapes.h"

namespace groundray {
namespace {

class BaleMaker {
 public:
  BaleMaker(AssetBuilder& builder, AssetShape& shape)
      : builder_(builder),
        random_(shape.random),
        radius_(shape.size_m / 2),
        half_(shape.width_m / 2),
        fineness_(std::sqrt(shape.detail)),
        hay_(builder.surface("hay", {0.36f, 0.29f, 0.155f})) {
    constexpr double longest = 4, ratio = 1.35;
    for (double number = longest; number < 60 * fineness_; number *= ratio) {
      for (int i = 0; i < 3; ++i) {
        const glm::dvec3 direction = random_.direction();
        const double phase = random_.angle_rad();
        waves_.push_back({direction * number / radius_, phase, math::pow(number / longest, -0.55)});
      }
    }
    start_ = random_.angle_rad();
  }

  void add() {
    add_roll();
    add_straws();
  }

 private:
  struct Wave {
    glm::dvec3 vector;
    double phase;
    double amplitude;
  };

  // Unevenness of the surface in m; its mean is 0.
  double relief(const glm::dvec3& p) const {
    double sum = 0;
    for (const Wave& wave : waves_)
      sum += wave.amplitude * math::sin(glm::dot(wave.vector, p) + wave.phase);
    return 0.0035 * sum;
  }

  // Point of the roll: distance from its axis, offset along it, angle.
  glm::dvec3 at(double r, double y, double angle) const {
    return {r * math::sin(angle), y, -r * math::cos(angle)};
  }

  void add_roll() {
    const int sides = static_cast<int>(std::lround(120 * fineness_));
    const int rings = static_cast<int>(std::lround(24 * fineness_));
    const int layers = static_cast<int>(std::lround(30 * fineness_));
    const double edge = 0.05 * radius_;
    std::vector<Section> sections;
    const auto end_face = [&](double side, int layer) {
      const double r = (radius_ - edge) * (layer + 0.5) / (layers + 0.5);
      Section section;
      for (int k = 0; k < sides; ++k) {
        const double angle = 2 * std::numbers::pi * k / sides;
        // Layers of the roll wind outward, unevenly.
        const glm::dvec3 flat = at(r, side * half_, angle);
        const double winding = math::sin(2 * std::numbers::pi * (r / (0.055 * radius_)) -
                                         side * angle + start_ + 300 * relief(0.4 * flat));
        const double depth = 0.004 * winding + 1.6 * relief(flat);
        section.push_back(at(r, side * (half_ + depth), angle));
      }
      return section;
    };
    for (int i = 0; i < layers; ++i) sections.push_back(end_face(-1, i));
    for (int i = 0; i <= rings; ++i) {
      const double y = (half_ - edge * 0.4) * (2.0 * i / rings - 1);
      const double rounding = i == 0 || i == rings ? edge * 0.4 : 0;
      Section section;
      for (int k = 0; k < sides; ++k) {
        const double angle = 2 * std::numbers::pi * k / sides;
        // Net wrap: shallow rings.
        const double wrap = 0.004 * math::sin(2 * std::numbers::pi * y / 0.12 + start_);
        const double r = radius_ - rounding + wrap + relief(at(radius_, y, angle));
        // Flattened where it rests on the ground.
        glm::dvec3 p = at(r, y, angle);
        p.z = std::max(p.z, -0.985 * radius_ + 0.02 * (p.z + radius_));
        section.push_back(p);
      }
      sections.push_back(std::move(section));
    }
    for (int i = layers; i-- > 0;) sections.push_back(end_face(1, i));
    for (Section& section : sections) {
      for (glm::dvec3& p : section) p.z += 0.985 * radius_;
      std::ranges::reverse(section);
    }
    add_sweep(builder_, sections, hay_);
  }

  void add_straws() {
    const int count = static_cast<int>(std::lround(1200 * fineness_ * fineness_));
    for (int i = 0; i < count; ++i) {
      const double angle = random_.angle_rad();
      const double y = random_.between(-0.97, 0.97) * half_;
      const double length = random_.between(0.04, 0.11) * radius_ / 0.75;
      const glm::dvec3 turn = random_.direction();
      const glm::dvec3 out = at(1, 0, angle);
      const glm::dvec3 root = at(radius_ - 0.01, y, angle) + glm::dvec3(0, 0, 0.985 * radius_);
      if (out.z < -0.75) continue;
      const glm::dvec3 along = glm::normalize(0.3 * out + turn);
      const glm::dvec3 forward = glm::dot(along, out) < 0.08 ? along + 0.5 * out : along;
      const std::array<TubeRing, 3> straw = {
          {{root, 0.0016},
           {root + 0.5 * length * forward, 0.0016},
           {root + length * (forward + glm::dvec3(0, 0, -0.15)), 0.0008}}};
      add_pipe(builder_, straw, 3, hay_);
    }
  }

  AssetBuilder& builder_;
  AssetRandom& random_;
  double radius_, half_, fineness_;
  std::uint16_t hay_;
  std::vector<Wave> waves_;
  double start_ = 0;
};

}  // namespace

Model make_hay_bale(AssetShape shape) {
  AssetBuilder builder;
  BaleMaker(builder, shape).add();
  return creased(builder.take(), 0.8);
}

}  // namespace groundray
