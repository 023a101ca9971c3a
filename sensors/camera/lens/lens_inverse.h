#pragma once

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <numbers>

#include "core/math.h"
#include "sensors/camera/lens/lens.h"
#include "sensors/camera/lens/lens_models.h"

// Inverse of lens models, private to this library: Newton's method in a chart of the directions,
// continued along a path from the axis.
namespace groundray::lens {

inline constexpr double farthest_rad = std::numbers::pi - 1e-3;  // excludes straight back

// Returns the direction of a position in the chart, a stereographic projection from behind: w = 2
// tan(theta / 2) towards the azimuth. The chart is smooth except straight back, and preserves
// orientation.
inline Direction<double> unfolded(const glm::dvec2& w) {
  const double scale = 1 / (1 + glm::dot(w, w) / 4);
  return {w.x * scale, w.y * scale, 2 * scale - 1};
}

// Returns the same direction with its derivatives by w.
inline Direction<Dual> unfolded_dual(const glm::dvec2& w) {
  const double scale = 1 / (1 + glm::dot(w, w) / 4), shrink = -scale * scale / 2;
  const glm::dvec2 slope = shrink * w;  // derivative of the scale
  return {{w.x * scale, scale + w.x * slope.x, w.x * slope.y},
          {w.y * scale, w.y * slope.x, scale + w.y * slope.y},
          {2 * scale - 1, 2 * slope.x, 2 * slope.y}};
}

// Image of a position in the chart, and its derivatives.
struct Imaged {
  glm::dvec2 pixel{0};
  glm::dvec2 by_a{0}, by_b{0};
  double determinant() const { return by_a.x * by_b.y - by_b.x * by_a.y; }
  // Tolerated distance of an image from its pixel: 3e-10 px plus, where the model is steep, the
  // effect of the direction's rounding.
  double tolerance_px() const {
    const glm::dvec2 steep = glm::abs(by_a) + glm::abs(by_b);
    return 3e-10 + 4 * std::numeric_limits<double>::epsilon() * std::max(steep.x, steep.y);
  }
  bool is_sound() const { return determinant() > 0 && std::isfinite(pixel.x + pixel.y); }
};
template <typename Model>
Imaged image_of(const Model& model, const glm::dvec2& w) {
  const auto [u, v] = model.image(unfolded_dual(w));
  return {{u.value, v.value}, {u.dx, v.dx}, {u.dy, v.dy}};
}

// Returns the Newton step in the chart that brings the image to a pixel.
inline glm::dvec2 step_to(const Imaged& at, const glm::dvec2& pixel) {
  const glm::dvec2 off = pixel - at.pixel;
  return glm::dvec2(off.x * at.by_b.y - at.by_b.x * off.y, at.by_a.x * off.y - off.x * at.by_a.y) /
         at.determinant();
}

inline PixelRay ray_at(const glm::dvec2& w, const Imaged& at) {
  const auto [x, y, z] = unfolded_dual(w);
  const glm::dvec3 by_a(x.dx, y.dx, z.dx), by_b(x.dy, y.dy, z.dy);
  const double inverse = 1 / at.determinant();
  return {{x.value, y.value, z.value},
          (by_a * at.by_b.y - by_b * at.by_a.y) * inverse,
          (by_b * at.by_a.x - by_a * at.by_b.x) * inverse};
}

// Returns the position of a direction in the chart.
inline glm::dvec2 toward(double azimuth_rad, double angle_rad) {
  return 2 * math::tan(angle_rad / 2) * glm::dvec2(math::cos(azimuth_rad), math::sin(azimuth_rad));
}

template <typename Model>
class Inverse {
 public:
  /// @param least_limit_rad  angle from the axis within which all directions are imaged.
  Inverse(const Lens& lens, const Model& model, double least_limit_rad)
      : lens_(lens),
        model_(model),
        sure_(2 * math::tan(std::min(least_limit_rad, farthest_rad) / 2)) {}

  /// Iterates Newton's method from w, at most `steps` times, until the image is within coarse_px,
  /// or the tolerance if that is larger. Returns false if it leaves the imaged field or does not
  /// converge.
  bool arrive(const glm::dvec2& pixel, int steps, double coarse_px, glm::dvec2& w,
              Imaged& at) const {
    for (int i = 0;; ++i) {
      if (!is_imaged(w)) return false;
      at = image_of(model_, w);
      if (!at.is_sound()) return false;
      const glm::dvec2 off = glm::abs(pixel - at.pixel);
      if (std::max(off.x, off.y) < std::max(coarse_px, at.tolerance_px())) return true;
      if (i == steps) return false;
      w += step_to(at, pixel);
    }
  }

  /// Follows the straight line in the image from the axis' pixel, with steps that are halved where
  /// Newton's method does not converge. Returns false if the pixel is not reached.
  bool follow(const glm::dvec2& pixel, glm::dvec2& w, Imaged& at) const {
    w = glm::dvec2(0);
    at = image_of(model_, w);
    const glm::dvec2 begin = at.pixel;
    double done = 0, step = 1.0 / 4;
    while (done < 1) {
      const double next = std::min(done + step, 1.0);
      glm::dvec2 w_next = w;
      Imaged at_next;
      if (arrive(begin + (pixel - begin) * next, 4, next < 1 ? 1e-6 : 0, w_next, at_next)) {
        w = w_next;
        at = at_next;
        done = next;
        step *= 2;
      } else {
        step /= 2;
        if (step < 1e-8) return false;
      }
    }
    return true;
  }

  /// Takes one Newton step from an estimate extrapolated from neighbours, which nearly always
  /// suffices, and iterates otherwise. After a single step, `at` has the tangents at the estimate,
  /// 1e-5 px away at most. Flattened because nearly all of the time is spent here.
  [[gnu::flatten]] bool step_along(const glm::dvec2& pixel, const glm::dvec2& from, glm::dvec2& w,
                                   Imaged& at) const {
    at = image_of(model_, from);
    if (!at.is_sound()) return false;
    w = from + step_to(at, pixel);
    const auto [u, v] = model_.image(unfolded(w));
    const glm::dvec2 off = glm::abs(pixel - at.pixel);
    if (std::max(std::abs(u - pixel.x), std::abs(v - pixel.y)) < at.tolerance_px() &&
        std::max(off.x, off.y) < 1e-5)
      return is_imaged(w);
    return arrive(pixel, 4, 0, w, at);
  }

 private:
  bool is_imaged(const glm::dvec2& w) const {
    if (glm::dot(w, w) < sure_ * sure_) return true;
    const auto [x, y, z] = unfolded(w);
    return lens_.images({x, y, z});
  }

  const Lens& lens_;
  const Model& model_;
  double sure_;
};

}  // namespace groundray::lens
