// Foliage: images of sprays, and the area that leaves cover.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "core/image/srgb.h"
#include "core/math.h"
#include "terrain/assets/asset_builder.h"

namespace groundray {
namespace {

constexpr int image_size = 128;
constexpr int alpha = 3;

// Leaf or needle: the shape of a lens from its stalk to its tip, in coordinates of the image.
struct DrawnBlade {
  glm::dvec2 stalk;
  double angle_rad;  // from the u axis towards v
  double length;
  double half_width;
  double shade;  // sRGB, 0 to 1
};

// Draws blades on top of one another. Positions are (u, v); v points up, whereas rows of the image
// run down.
class SprayImage {
 public:
  SprayImage() : image_(image_size, image_size, 4) {
    for (std::size_t i = 0; i < image_.values().size(); ++i) {
      image_.values()[i] = i % 4 == alpha ? 0 : 220;
    }
  }

  void draw(const DrawnBlade& blade) {
    const glm::dvec2 along{math::cos(blade.angle_rad), math::sin(blade.angle_rad)};
    const glm::dvec2 tip = blade.stalk + along * blade.length;
    const double margin = blade.half_width + 2.0 / image_size;
    const auto first = [&](double at) {
      return std::clamp(static_cast<int>((at - margin) * image_size), 0, image_size - 1);
    };
    const auto last = [&](double at) {
      return std::clamp(static_cast<int>((at + margin) * image_size), 0, image_size - 1);
    };
    for (int j = first(std::min(blade.stalk.y, tip.y)); j <= last(std::max(blade.stalk.y, tip.y));
         ++j) {
      for (int i = first(std::min(blade.stalk.x, tip.x)); i <= last(std::max(blade.stalk.x, tip.x));
           ++i) {
        draw_pixel(blade, along, i, j);
      }
    }
  }

  Image8 take() { return std::move(image_); }

 private:
  void draw_pixel(const DrawnBlade& blade, const glm::dvec2& along, int i, int j) {
    const glm::dvec2 q = (glm::dvec2(i, j) + 0.5) / static_cast<double>(image_size) - blade.stalk;
    const double s = glm::dot(q, along) / blade.length;
    const double off = std::abs(q.y * along.x - q.x * along.y);
    const double inside = blade.half_width * 4 * s * (1 - s) - off;  // negative beyond the ends
    // Alpha ramps over half a pixel on either side, so that linear filtering finds the outline at
    // one half.
    const double cover = std::clamp(0.5 + inside * image_size, 0.0, 1.0);
    const auto pixel = image_.at(i, image_size - 1 - j);
    const auto level = static_cast<std::uint8_t>(std::lround(255 * cover));
    if (level < 128 && level <= pixel[alpha]) return;
    const double vein = off < 0.12 * blade.half_width ? 0.94 : 1;
    const auto value = static_cast<std::uint8_t>(std::lround(255 * blade.shade * vein));
    for (std::size_t channel = 0; channel < 3; ++channel) pixel[channel] = value;
    pixel[alpha] = std::max(pixel[alpha], level);
  }

  Image8 image_;
};

double rad(double deg) { return deg * std::numbers::pi / 180; }

// Draws a twig with leaves on both sides and one at its end.
void draw_twig(SprayImage& spray, const glm::dvec2& from, double angle_deg, double length) {
  const glm::dvec2 along{math::cos(rad(angle_deg)), math::sin(rad(angle_deg))};
  spray.draw({from, rad(angle_deg), length, 0.01, 0.7});
  constexpr double spacing = 0.085, leaf = 0.19, half_width = 0.046;
  double shade = 0.86;
  for (double s = 0.08; s < length; s += spacing) {
    for (const double side : {-1.0, 1.0}) {
      const glm::dvec2 stalk = from + along * (s + 0.02 * side);
      spray.draw({stalk, rad(angle_deg + 55 * side), leaf, half_width, shade});
      shade = shade > 0.94 ? 0.85 : shade + 0.03;
    }
  }
  spray.draw({from + along * (length - 0.02), rad(angle_deg), leaf, half_width, 0.95});
}

// Draws the stalk of the spray, widest where it leaves the image.
void draw_stalk(SprayImage& spray) { spray.draw({{0.5, -0.3}, rad(90), 0.6, 0.013, 0.7}); }

Image8 draw_leaves() {
  SprayImage spray;
  draw_stalk(spray);
  draw_twig(spray, {0.5, 0.02}, 92, 0.74);
  draw_twig(spray, {0.5, 0.14}, 38, 0.33);
  draw_twig(spray, {0.5, 0.2}, 141, 0.3);
  draw_twig(spray, {0.5, 0.47}, 44, 0.25);
  draw_twig(spray, {0.49, 0.52}, 136, 0.2);
  return spray.take();
}

// Draws a shoot with needles on both sides.
void draw_shoot(SprayImage& spray, const glm::dvec2& from, double angle_deg, double length) {
  const glm::dvec2 along{math::cos(rad(angle_deg)), math::sin(rad(angle_deg))};
  spray.draw({from, rad(angle_deg), length, 0.012, 0.75});
  constexpr double spacing = 0.03, needle = 0.1;
  for (double s = 0.02; s < length; s += spacing) {
    for (const double side : {-1.0, 1.0}) {
      spray.draw(
          {from + along * s, rad(angle_deg + side * 42), needle, 0.0085, side > 0 ? 0.94 : 0.84});
    }
  }
}

Image8 draw_needles() {
  SprayImage spray;
  draw_stalk(spray);
  for (double v = 0.1; v < 0.8; v += 0.15) {
    for (const double side : {-1.0, 1.0}) {
      draw_shoot(spray, {0.5, v + 0.03 * side}, 90 + side * 52, 0.46 - 0.3 * v);
    }
  }
  draw_shoot(spray, {0.5, 0}, 90, 0.9);
  return spray.take();
}

// Twice the area of a triangle; negative if it is clockwise.
double twice_area(const glm::dvec2& o, const glm::dvec2& a, const glm::dvec2& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

}  // namespace

double opaque_share(const Image8& image) {
  if (image.channels() != 4) return 1;
  const std::span<const std::uint8_t> values = image.values();
  std::size_t count = 0;
  for (std::size_t i = alpha; i < values.size(); i += 4) count += values[i] >= 128 ? 1 : 0;
  return static_cast<double>(count) / (static_cast<double>(values.size()) / 4);
}

ModelSurface spray_surface(SprayKind kind) {
  ModelSurface surface = asset_surface(kind == SprayKind::Leaves ? "broad_leaf" : "leaf");
  surface.albedo.pixels = kind == SprayKind::Leaves ? draw_leaves() : draw_needles();
  const std::span<const std::uint8_t> values = std::as_const(surface.albedo.pixels).values();
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < values.size(); i += 4) {
    if (values[i + alpha] < 128) continue;
    sum += linear_of_srgb(values[i] / 255.0);
    ++count;
  }
  surface.color *= static_cast<float>(count / sum);
  return surface;
}

// Andrew's monotone chain (1979).
double hull_area(std::vector<glm::dvec2> points) {
  if (points.size() < 3) return 0;
  std::ranges::sort(points, {}, [](const glm::dvec2& p) { return std::tuple(p.x, p.y); });
  std::vector<glm::dvec2> hull;
  const auto add = [&](const glm::dvec2& p, std::size_t kept) {
    while (hull.size() >= kept + 2 && twice_area(hull[hull.size() - 2], hull.back(), p) <= 0) {
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const glm::dvec2& p : points) add(p, 0);
  const std::size_t lower = hull.size() - 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], lower);
  double twice = 0;
  for (std::size_t i = 0; i + 1 < hull.size(); ++i)
    twice += twice_area(hull[0], hull[i], hull[i + 1]);
  return twice / 2;
}

}  // namespace groundray
