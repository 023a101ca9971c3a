// Man-made objects: posts, wires, targets.
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"

namespace groundray {
namespace {

// Returns the number of sides, a multiple of four, so that the bounding box is that of the circle.
int sides_of(double at_usual, double detail) {
  return 4 * std::max(2, static_cast<int>(std::lround(at_usual * std::sqrt(detail) / 4)));
}

// Returns the parameter a of the catenary z = a cosh(x / a), by bisection: the sag falls as a
// grows.
double catenary_parameter(double span_m, double sag_m) {
  const double h = span_m / 2;
  const auto sag = [&](double a) {
    const double s = math::sinh(h / (2 * a));
    return 2 * a * s * s;  // a (cosh - 1) without cancellation
  };
  double low = h * 1e-3, high = h;
  while (sag(low) < sag_m) low /= 2;
  while (sag(high) > sag_m) high *= 2;
  for (int i = 0; i < 200 && low < high; ++i) {
    const double middle = low + (high - low) / 2;
    if (middle == low || middle == high) break;
    (sag(middle) > sag_m ? low : high) = middle;
  }
  return high;
}

}  // namespace

Model make_fence_post(AssetShape shape) {
  constexpr double depth_m = 0.46;  // 18 inches: USDA NRCS Mississippi, standard 382 (2000)
  AssetBuilder builder;
  const std::uint16_t surface = builder.add_surface(asset_surface("wood"));
  builder.add_cylinder({0, 0, -depth_m}, depth_m + shape.size_m, shape.width_m / 2,
                       sides_of(16, shape.detail), surface);
  return builder.take();
}

Model make_person_cylinder(AssetShape shape) {
  AssetBuilder builder;
  const std::uint16_t surface = builder.add_surface(asset_surface("metal"));
  builder.add_cylinder({0, 0, 0}, shape.size_m, shape.width_m / 2, sides_of(128, shape.detail),
                       surface);
  return builder.take();
}

Model make_wire(AssetShape shape) {
  const double a = catenary_parameter(shape.size_m, shape.sag_m);
  const double half_length = a * math::sinh(shape.size_m / (2 * a));
  // A chord of length c deviates from the curve by at most c^2 / (8 a), which is a twentieth of the
  // diameter divided by `detail` here.
  const double chord = std::sqrt(8 * a * shape.width_m / 20 / shape.detail);
  const int half_count = std::max(4, static_cast<int>(std::ceil(half_length / chord)));
  std::vector<TubeRing> rings;
  for (int i = -half_count; i <= half_count; ++i) {
    const double s = half_length * i / half_count;
    const double x = a * math::asinh(s / a), half_sinh = math::sinh(x / (2 * a));
    rings.push_back({{x, 0, 2 * a * half_sinh * half_sinh - shape.sag_m}, shape.width_m / 2});
  }
  rings.front().p = {-shape.size_m / 2, 0, 0};
  rings.back().p = {shape.size_m / 2, 0, 0};
  AssetBuilder builder;
  const std::uint16_t surface = builder.add_surface(asset_surface("metal"));
  builder.add_tube(rings, 8, surface);
  return builder.take();
}

std::optional<int> squares_along(double length_m, double square_m) {
  const double count = std::round(length_m / square_m);
  if (!(count >= 1 && count <= 1000)) return {};
  if (std::abs(count * square_m - length_m) > 1e-6 * length_m) return {};
  return static_cast<int>(count);
}

Model make_calibration_board(AssetShape shape) {
  constexpr double thickness_m = 0.01;
  const int columns = shape.square_m ? *squares_along(shape.width_m, *shape.square_m) : 1;
  const int rows = shape.square_m ? *squares_along(shape.size_m, *shape.square_m) : 1;
  AssetBuilder builder;
  const std::uint16_t back = builder.add_surface(asset_surface("metal"));
  const std::uint16_t white =
      shape.square_m ? builder.add_surface(asset_surface("white_paint")) : back;
  const std::uint16_t black =
      shape.square_m ? builder.add_surface(asset_surface("black_paint")) : back;
  for (const double x : {0.0, -thickness_m}) {
    for (int r = 0; r <= rows; ++r) {
      for (int c = 0; c <= columns; ++c) {
        builder.add_vertex(
            {x, shape.width_m * c / columns - shape.width_m / 2, shape.size_m * r / rows});
      }
    }
  }
  const auto at = [&](int side, int c, int r) {
    return static_cast<std::uint32_t>((side * (rows + 1) + r) * (columns + 1) + c);
  };
  const auto add_quad = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r, std::uint32_t s,
                            std::uint16_t surface) {
    builder.add_triangle(p, q, r, surface);
    builder.add_triangle(p, r, s, surface);
  };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      add_quad(at(0, c, r), at(0, c + 1, r), at(0, c + 1, r + 1), at(0, c, r + 1),
               (r + c) % 2 == 0 ? black : white);
      add_quad(at(1, c, r), at(1, c, r + 1), at(1, c + 1, r + 1), at(1, c + 1, r), back);
    }
  }
  for (int c = 0; c < columns; ++c) {
    add_quad(at(1, c, 0), at(1, c + 1, 0), at(0, c + 1, 0), at(0, c, 0), back);
    add_quad(at(0, c, rows), at(0, c + 1, rows), at(1, c + 1, rows), at(1, c, rows), back);
  }
  for (int r = 0; r < rows; ++r) {
    add_quad(at(1, 0, r), at(0, 0, r), at(0, 0, r + 1), at(1, 0, r + 1), back);
    add_quad(at(0, columns, r), at(1, columns, r), at(1, columns, r + 1), at(0, columns, r + 1),
             back);
  }
  return builder.take();
}

}  // namespace groundray
