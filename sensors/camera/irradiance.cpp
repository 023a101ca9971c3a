#include "sensors/camera/irradiance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <numbers>
#include <optional>
#include <vector>

#include "core/error.h"

namespace groundray {
namespace {

double pixel_sr(const PixelRay& ray) { return glm::length(glm::cross(ray.by_u, ray.by_v)); }

void check_aperture(const Lens& lens, const ApertureSpec& aperture, double pixel_pitch_m) {
  Violations broken("aperture");
  const auto positive = [&](const char* name, double value) {
    broken.unless(value > 0 && std::isfinite(value), "{} = {} must be positive and finite", name,
                  value);
  };
  positive("focal_length_m", aperture.focal_length_m);
  positive("f_number", aperture.f_number);
  positive("pixel_pitch_m", pixel_pitch_m);
  broken.unless(0 < aperture.transmission && aperture.transmission <= 1,
                "transmission = {} must be > 0 and at most 1", aperture.transmission);
  const glm::dvec3& v = aperture.vignetting;
  broken.unless(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z),
                "vignetting = [{}, {}, {}] must be finite", v.x, v.y, v.z);
  broken.throw_if_any();
  // Calibrated focal lengths differ from nominal ones by a few per cent; wrong units or binning
  // change them by a factor of 2 or more.
  constexpr double most_ratio = 1.5;
  const auto axis = lens.project({0, 0, 1});
  const std::optional<PixelRay> ray = axis ? lens.ray(*axis) : std::nullopt;
  if (!ray) return;
  const double focal_length_m = pixel_pitch_m / std::sqrt(pixel_sr(*ray));
  const double ratio = aperture.focal_length_m / focal_length_m;
  broken.unless(
      1 / most_ratio < ratio && ratio < most_ratio,
      "focal_length_m = {} does not fit the lens, which has {:.4g} m with pixels of {} m: "
      "is it in millimetres, or are pixels binned?",
      aperture.focal_length_m, focal_length_m, pixel_pitch_m);
  broken.throw_if_any();
}

// Light on a pixel relative to one on the axis, without the factor of its solid angle. Negative
// values indicate an invalid vignetting.
class Falloff {
 public:
  Falloff(const Lens& lens, const ApertureSpec& aperture)
      : vignetting_(aperture.vignetting),
        pupil_(aperture.pupil),
        centre_px_(lens.project({0, 0, 1}).value_or(glm::dvec2(lens.size_px() - 1) / 2.0)),
        half_diagonal_px_(glm::length(glm::dvec2(lens.size_px())) / 2) {}

  double operator()(const glm::dvec2& pixel, const glm::dvec3& direction) const {
    const glm::dvec2 from_centre = (pixel - centre_px_) / half_diagonal_px_;
    const double r2 = glm::dot(from_centre, from_centre);
    const double rim = 1 + r2 * (vignetting_.x + r2 * (vignetting_.y + r2 * vignetting_.z));
    return pupil_ == ApertureSpec::Pupil::Flat ? rim * std::max(direction.z, 0.0) : rim;
  }

 private:
  glm::dvec3 vignetting_;
  ApertureSpec::Pupil pupil_;
  glm::dvec2 centre_px_;
  double half_diagonal_px_;
};

void check_rim(const ImageF& pupil_sr, const glm::dvec3& vignetting) {
  const auto bad = std::ranges::find_if(pupil_sr.values(), [](float sr) { return sr < 0; });
  if (bad == pupil_sr.values().end()) return;
  const auto pixel = bad - pupil_sr.values().begin();
  throw Error(
      "aperture: vignetting = [{}, {}, {}] is negative at the pixel ({}, {}); it must be 0 or more "
      "in the entire image: are its coefficients relative to half the diagonal?",
      vignetting.x, vignetting.y, vignetting.z, pixel % pupil_sr.width(), pixel / pupil_sr.width());
}

}  // namespace

ImageF pupil_sr(const Lens& lens, const ApertureSpec& aperture, double pixel_pitch_m) {
  check_aperture(lens, aperture, pixel_pitch_m);
  const Falloff falloff(lens, aperture);
  const int width = lens.size_px().x, height = lens.size_px().y;
  const double diameter_m = aperture.focal_length_m / aperture.f_number;
  const double on_axis = aperture.transmission * std::numbers::pi / 4 * diameter_m * diameter_m /
                         (pixel_pitch_m * pixel_pitch_m);
  ImageF result(width, height, 1);
  // Fixed blocks of rows give the same result on any number of threads: a ray depends, to rounding,
  // on its block.
  constexpr int rows_at_once = 16;
  tbb::parallel_for(0, (height + rows_at_once - 1) / rows_at_once, [&](int block) {
    const int first = block * rows_at_once, end = std::min(first + rows_at_once, height);
    std::vector<PixelRay> rays(static_cast<std::size_t>(end - first) *
                               static_cast<std::size_t>(width));
    lens.fill(first, end, rays);
    auto ray = rays.begin();
    for (int y = first; y < end; ++y) {
      for (int x = 0; x < width; ++x, ++ray) {
        if (ray->direction == glm::dvec3(0)) continue;
        result.at(x, y)[0] =
            static_cast<float>(on_axis * pixel_sr(*ray) * falloff({x, y}, ray->direction));
      }
    }
  });
  check_rim(result, aperture.vignetting);
  return result;
}

ImageF irradiance(const ImageF& radiance, const ImageF& pupil_sr) {
  if (radiance.width() != pupil_sr.width() || radiance.height() != pupil_sr.height() ||
      pupil_sr.channels() != 1) {
    throw Error(
        "irradiance: {} x {} px of radiance do not fit {} x {} px of pupils with {} channels",
        radiance.width(), radiance.height(), pupil_sr.width(), pupil_sr.height(),
        pupil_sr.channels());
  }
  ImageF result = radiance;
  const auto channels = static_cast<std::size_t>(radiance.channels());
  for (std::size_t i = 0; i < result.values().size(); ++i)
    result.values()[i] *= pupil_sr.values()[i / channels];
  return result;
}

}  // namespace groundray
