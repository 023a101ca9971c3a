// Wheels: a body of revolution for tyre and rim, a closed piece for each block or bar of the tread
// and for each spoke.
#include "terrain/assets/asset_wheel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_shapes.h"

namespace groundray {
namespace {

using std::numbers::pi;

class WheelMaker {
 public:
  WheelMaker(AssetBuilder& builder, const WheelShape& wheel, const WheelSurfaces& surfaces,
             double detail)
      : builder_(builder),
        wheel_(wheel),
        surfaces_(surfaces),
        half_(wheel.width / 2),
        base_(wheel.radius - wheel.height),
        sides_(std::max(16, 4 * static_cast<int>(std::lround(12 * std::sqrt(detail))))) {}

  void add() {
    add_body();
    if (wheel_.tread == Tread::Blocks) {
      add_blocks();
    } else {
      add_bars();
    }
    add_spokes();
  }

 private:
  // Point at a radius, an angle from the lowest point (positive towards the front) and an offset
  // along the axle, positive outward.
  glm::dvec3 at(double radius, double angle, double out) const {
    return wheel_.centre +
           glm::dvec3(radius * math::sin(angle), wheel_.outer * out, -radius * math::cos(angle));
  }

  // Radius of the tyre's carcass at an offset: rounded shoulders.
  double crown(double out) const {
    const double share = std::min(std::abs(out) / half_, 1.0);
    return base_ - 0.06 * (base_ - wheel_.rim) * share * share -
           0.12 * (base_ - wheel_.rim) * math::pow(share, 8);
  }

  void add_body() {
    const double wall = base_ - wheel_.rim, disc = half_ - wheel_.dish * wheel_.width;
    const std::uint16_t tyre = surfaces_.tyre, rim = surfaces_.rim;
    const std::uint16_t plate = wheel_.spokes > 0 ? surfaces_.dark : rim;
    // From the inner side to the outer one; in the order of y for wheels on the left.
    std::vector<LatheRing> rings = {
        {-0.62 * half_, 0, surfaces_.dark},       {-0.62 * half_, 0.93 * wheel_.rim, rim},
        {-0.80 * half_, 0.97 * wheel_.rim, tyre}, {-0.86 * half_, wheel_.rim + 0.05 * wall, tyre},
        {-half_, wheel_.rim + 0.42 * wall, tyre}, {-0.97 * half_, wheel_.rim + 0.68 * wall, tyre}};
    for (const double out : {-0.92, -0.8, -0.5, 0.0, 0.5, 0.8, 0.92})
      rings.push_back({out * half_, crown(out * half_), tyre});
    for (const LatheRing& ring :
         std::array<LatheRing, 10>{{{0.97 * half_, wheel_.rim + 0.68 * wall, tyre},
                                    {half_, wheel_.rim + 0.42 * wall, tyre},
                                    {0.86 * half_, wheel_.rim + 0.05 * wall, tyre},
                                    {0.84 * half_, wheel_.rim, rim},
                                    {0.78 * half_, 0.95 * wheel_.rim, rim},
                                    {disc + 0.02 * half_, 0.90 * wheel_.rim, plate},
                                    {disc, 0.84 * wheel_.rim, plate},
                                    {disc + 0.04 * half_, 0.32 * wheel_.rim, rim},
                                    {disc + 0.16 * half_, 0.24 * wheel_.rim, rim},
                                    {disc + 0.18 * half_, 0, rim}}})
      rings.push_back(ring);
    if (wheel_.outer < 0) {
      std::vector<LatheRing> mirrored;
      for (std::size_t i = rings.size(); i-- > 0;) {
        // The surface of a ring is that of the piece to the next one.
        mirrored.push_back(
            {-rings[i].along, rings[i].radius, i > 0 ? rings[i - 1].surface : rings[0].surface});
      }
      rings = std::move(mirrored);
    }
    add_lathe(builder_, wheel_.centre, 1, rings, sides_);
  }

  // A piece of tread between two lines across it: angles and offsets of the ends of its centre
  // line, and its half-width as an angle.
  void add_piece(const glm::dvec2& from, const glm::dvec2& to, double half_angle, double top) {
    const int steps = wheel_.tread == Tread::Blocks ? 1 : 3;
    std::vector<Section> sections;
    for (int i = 0; i <= steps; ++i) {
      const double share = double(i) / steps;
      const double angle = from.x + (to.x - from.x) * share, out = from.y + (to.y - from.y) * share;
      const double low = crown(out) - 0.35 * wheel_.height;
      // Narrower at its top.
      sections.push_back({at(low, angle - half_angle, out), at(low, angle + half_angle, out),
                          at(top, angle + 0.72 * half_angle, out),
                          at(top, angle - 0.72 * half_angle, out)});
      if (wheel_.outer < 0) std::ranges::reverse(sections.back());
      if (to.y < from.y) std::ranges::reverse(sections.back());
    }
    add_sweep(builder_, sections, surfaces_.tyre);
  }

  void add_blocks() {
    const double step = 2 * pi / wheel_.count;
    for (int i = 0; i < wheel_.count; ++i) {
      const double angle = i * step;
      // The blocks in the middle reach the tyre's radius; flat tops, so that one stands on the
      // ground.
      const double top = wheel_.radius / math::cos(0.72 * 0.36 * step);
      add_piece({angle, -0.30 * half_}, {angle, 0.30 * half_}, 0.36 * step, top);
      for (const double side : {-1.0, 1.0}) {
        const double off = angle + 0.5 * step;
        add_piece({off, side * 0.40 * half_}, {off + 0.2 * step, side * 0.93 * half_}, 0.33 * step,
                  wheel_.radius - 0.25 * wheel_.height);
      }
    }
  }

  void add_bars() {
    const double step = 2 * pi / wheel_.count;
    // Bars at 45 degrees to the axle.
    const double slant = 0.8 * half_ / wheel_.radius;
    for (int i = 0; i < wheel_.count; ++i) {
      for (const double side : {-1.0, 1.0}) {
        const double angle = (i + (side > 0 ? 0.5 : 0)) * step;
        const double top = wheel_.radius / math::cos(0.72 * 0.16 * step);
        add_piece({angle, -0.06 * side * half_}, {angle + slant, 0.97 * side * half_}, 0.16 * step,
                  top);
      }
    }
  }

  void add_spokes() {
    const double disc = half_ - wheel_.dish * wheel_.width;
    for (int i = 0; i < wheel_.spokes; ++i) {
      const double angle = 2 * pi * i / wheel_.spokes;
      std::vector<Section> sections;
      constexpr std::array<glm::dvec3, 3> shape = {
          // radius, half-width and height
          {{0.20, 0.10, 0.16}, {0.55, 0.085, 0.12}, {0.90, 0.14, 0.08}}};
      for (const glm::dvec3& part : shape) {
        const double r = part.x * wheel_.rim, turn = part.y / part.x;
        const double low = disc - 0.05 * half_, high = disc + part.z * half_;
        sections.push_back({at(r, angle - turn, low), at(r, angle - 0.75 * turn, high),
                            at(r, angle + 0.75 * turn, high), at(r, angle + turn, low)});
        if (wheel_.outer < 0) std::ranges::reverse(sections.back());
      }
      add_sweep(builder_, sections, surfaces_.rim);
    }
  }

  AssetBuilder& builder_;
  const WheelShape& wheel_;
  WheelSurfaces surfaces_;
  double half_;
  double base_;
  int sides_;
};

}  // namespace

void add_wheel(AssetBuilder& builder, const WheelShape& wheel, const WheelSurfaces& surfaces,
               double detail) {
  WheelMaker(builder, wheel, surfaces, detail).add();
}

}  // namespace groundray
