#include "sensors/camera/lens/lens.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/math.h"
#include "sensors/camera/lens/lens_inverse.h"

namespace groundray {
namespace {

using namespace lens;  // NOLINT(google-build-using-namespace)

using std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int azimuths = 720;     // number of azimuths with a limit
constexpr int even_angles = 256;  // number of equal steps from the axis to the far side

template <typename Model>
concept Closed = requires(const Model& model) { model.ray(Pixel<Dual>{}); };

template <typename Model>
concept Unlimited = requires { Model::images_all; };

template <Closed Model>
PixelRay closed_ray(const Model& model, const glm::dvec2& pixel) {
  const auto [x, y, z] = model.ray(Pixel<Dual>{{pixel.x, 1, 0}, {pixel.y, 0, 1}});
  return {{x.value, y.value, z.value}, {x.dx, y.dx, z.dx}, {x.dy, y.dy, z.dy}};
}

// Returns angles from near the axis to the far side, at least one of them between any two turns of
// the model.
std::vector<double> angles_of(const LensModel& model) {
  std::vector<double> angles_rad;
  for (int i = 1; i <= even_angles; ++i) angles_rad.push_back(farthest_rad * i / even_angles);
  const std::vector<double> turns = turns_rad(model);
  for (std::size_t i = 0; i + 1 < turns.size(); ++i) {
    const double middle_rad = (turns[i] + turns[i + 1]) / 2;
    if (middle_rad < farthest_rad) angles_rad.push_back(middle_rad);
  }
  std::ranges::sort(angles_rad);
  return angles_rad;
}

// Returns the angle at which the model first ceases to be sound, to rounding.
template <typename Model>
double first_limit_rad(const Model& model, double azimuth_rad, std::span<const double> angles_rad) {
  const auto is_sound = [&](double angle_rad) {
    return image_of(model, toward(azimuth_rad, angle_rad)).is_sound();
  };
  const auto bad = std::ranges::find_if_not(angles_rad, is_sound);
  if (bad == angles_rad.end()) return pi;
  double sound = bad == angles_rad.begin() ? 0 : *std::prev(bad), limit = *bad;
  while (true) {
    const double middle = (sound + limit) / 2;
    if (middle <= sound || middle >= limit) return sound;
    (is_sound(middle) ? sound : limit) = middle;
  }
}

// Returns that angle for each azimuth.
template <typename Model>
std::vector<double> limits_of(const Model& model) {
  const std::vector<double> angles_rad = angles_of(model);
  std::vector<double> limits_rad;
  for (int i = 0; i < azimuths; ++i)
    limits_rad.push_back(first_limit_rad(model, 2 * pi * i / azimuths, angles_rad));
  return limits_rad;
}

std::size_t bin_of(double azimuth_rad) {
  const double turns = azimuth_rad / (2 * pi);
  return static_cast<std::size_t>((turns - std::floor(turns)) * azimuths) % azimuths;
}

// Returns the radius of the imaged field round the axis' pixel, by azimuth in the image, slightly
// overestimated. The field ends at the image of the limits if that curve winds round the pixel
// once; otherwise the radius is unknown, and infinite.
template <typename Model>
std::vector<double> reach_of(const Model& model, std::span<const double> limits_rad) {
  std::vector<double> unknown_px(azimuths, infinity);
  const glm::dvec2 centre = image_of(model, {0, 0}).pixel;
  std::vector<double> reach_px(azimuths, 0.0);
  std::vector<glm::dvec2> rim;
  for (int i = 0; i <= azimuths; ++i) {
    const auto bin = static_cast<std::size_t>(i % azimuths);
    const glm::dvec2 w = toward(2 * pi * i / azimuths, std::min(limits_rad[bin], farthest_rad));
    rim.push_back(image_of(model, w).pixel - centre);
  }
  int turned = 0;
  for (std::size_t i = 0; i < azimuths; ++i) {
    const glm::dvec2 a = rim[i], b = rim[i + 1];
    // A smooth boundary bulges beyond its chord by some 1e-5 of its radius, less than the margin
    // here.
    const double far_px = 1.0002 * std::max(glm::length(a), glm::length(b)) + 0.05;
    if (!std::isfinite(far_px)) return unknown_px;
    const int first = static_cast<int>(bin_of(math::atan2(a.y, a.x)));
    const int last = static_cast<int>(bin_of(math::atan2(b.y, b.x)));
    const int up = (last - first + azimuths + azimuths / 2) % azimuths - azimuths / 2;
    if (std::abs(up) > azimuths / 8) return unknown_px;
    turned += up;
    // All bins from a to b, and one more on each side.
    for (int k = std::min(up, 0) - 1; k <= std::max(up, 0) + 1; ++k) {
      double& bin_px = reach_px[static_cast<std::size_t>((first + k + azimuths) % azimuths)];
      bin_px = std::max(bin_px, far_px);
    }
  }
  return turned == azimuths ? reach_px : unknown_px;
}

LensModel checked_lens(LensModel model, glm::ivec2 size_px) {
  Violations broken("lens");
  broken.unless(
      size_px.x > 0 && size_px.y > 0 && std::int64_t{size_px.x} * size_px.y <= most_image_pixels,
      "an image of {} x {} px must have from 1 to {} pixels; its rays take {} MiB", size_px.x,
      size_px.y, most_image_pixels,
      std::int64_t{size_px.x} * size_px.y * std::int64_t{sizeof(PixelRay)} >> 20);
  check_lens(model, broken);
  broken.throw_if_any();
  if (auto* all_round = std::get_if<Equirectangular>(&model)) all_round->size_px = size_px;
  if (auto* brown = std::get_if<BrownConrady>(&model))
    brown->sensor = sensor_homography(brown->k[12], brown->k[13]);
  if (auto* f_theta = std::get_if<FTheta>(&model)) f_theta->top = top_of(f_theta->k);
  return model;
}

// Computes the rays of consecutive rows, each from those of its neighbours.
template <typename Model>
class RowFiller {
 public:
  RowFiller(const Lens& lens, const Model& model, std::span<const double> reach_px,
            double least_limit_rad)
      : lens_(lens),
        inverse_(lens, model, least_limit_rad),
        centre_px_(image_of(model, {0, 0}).pixel),
        reach_px_(reach_px),
        least_reach_px_(std::ranges::min(reach_px)) {
    const double across = static_cast<double>(lens.size_px().x - 1);
    first_ = static_cast<int>(std::clamp(std::round(centre_px_.x), 0.0, across));
  }

  void fill(int row, std::span<PixelRay> rays) {
    Trail from_above;
    if (above_) from_above.push(*above_);
    const Trail first = look(first_, row, from_above, rays);
    above_ = first.any() ? std::optional(first.last()) : std::nullopt;
    for (const int side : {1, -1}) {
      Trail trail = first;
      for (int column = first_ + side; 0 <= column && column < lens_.size_px().x; column += side)
        trail = look(column, row, trail, rays);
    }
  }

 private:
  // Latest three positions in the chart, extrapolated by a parabola.
  class Trail {
   public:
    bool any() const { return count_ > 0; }
    const glm::dvec2& last() const { return last_[0]; }
    void push(const glm::dvec2& w) {
      last_ = {w, last_[0], last_[1]};
      count_ = std::min(count_ + 1, 3);
    }
    glm::dvec2 next() const {
      if (count_ == 3) return 3.0 * (last_[0] - last_[1]) + last_[2];
      return count_ == 2 ? 2.0 * last_[0] - last_[1] : last_[0];
    }

   private:
    std::array<glm::dvec2, 3> last_{};
    int count_ = 0;
  };

  // Computes the ray of a pixel; returns the trail with it, or an empty one without a viewing
  // direction.
  Trail look(int column, int row, Trail trail, std::span<PixelRay> rays) const {
    const glm::dvec2 pixel(column, row);
    PixelRay& ray = rays[static_cast<std::size_t>(column)];
    ray = {};
    Imaged at;
    glm::dvec2 w(0);
    if (!(trail.any() && inverse_.step_along(pixel, trail.next(), w, at)) &&
        !(may_reach(pixel) && inverse_.follow(pixel, w, at)))
      return {};
    ray = ray_at(w, at);
    trail.push(w);
    return trail;
  }

  bool may_reach(const glm::dvec2& pixel) const {
    const glm::dvec2 offset = pixel - centre_px_;
    const double distance_px = glm::length(offset);
    return distance_px <= least_reach_px_ ||
           distance_px <= reach_px_[bin_of(math::atan2(offset.y, offset.x))];
  }

  const Lens& lens_;
  Inverse<Model> inverse_;
  glm::dvec2 centre_px_;
  std::span<const double> reach_px_;
  double least_reach_px_;
  int first_ = 0;
  std::optional<glm::dvec2> above_;
};

}  // namespace

Lens::Lens(LensModel model, glm::ivec2 size_px)
    : model_(checked_lens(std::move(model), size_px)), size_px_(size_px) {
  std::visit(
      [&]<typename Model>(const Model& kind) {
        limits_rad_.assign(azimuths, infinity);
        if constexpr (!Unlimited<Model>) {
          limits_rad_ = limits_of(kind);
          reach_px_ = reach_of(kind, limits_rad_);
        }
      },
      model_);
  least_limit_rad_ = std::ranges::min(limits_rad_);
  if (!(least_limit_rad_ > 0))
    throw Error(
        "lens: directions near its axis have no image: are its coefficients in the right order?");
}

double Lens::limit_rad(double azimuth_rad) const noexcept {
  if (!std::isfinite(azimuth_rad)) return 0;
  const double turns = azimuth_rad / (2 * pi);
  const double place = (turns - std::floor(turns)) * azimuths;
  const auto i = static_cast<std::size_t>(place) % azimuths;
  return std::min({limits_rad_[i], limits_rad_[(i + 1) % azimuths], pi});
}

bool Lens::images(const glm::dvec3& direction) const noexcept {
  const double sine = math::hypot(direction.x, direction.y);
  const double angle_rad = math::atan2(sine, direction.z);
  return angle_rad < least_limit_rad_ ||
         angle_rad < limit_rad(math::atan2(direction.y, direction.x));
}

std::optional<glm::dvec2> Lens::project(const glm::dvec3& p_C) const noexcept {
  const glm::dvec3 direction = glm::normalize(p_C);
  if (!images(direction)) return std::nullopt;
  const auto [u, v] = std::visit(
      [&](const auto& kind) {
        return kind.image(Direction<double>{direction.x, direction.y, direction.z});
      },
      model_);
  return glm::dvec2(u, v);
}

std::optional<PixelRay> Lens::ray(glm::dvec2 pixel) const noexcept {
  return std::visit(
      [&]<typename Model>(const Model& kind) -> std::optional<PixelRay> {
        if constexpr (Closed<Model>) {
          const PixelRay ray = closed_ray(kind, pixel);
          const auto back = project(ray.direction);
          // A direction's rounding moves its image by an ulp over the pixel's angle.
          const double tolerance_px = 1e-9 + 1e-15 / std::sqrt(pixel_sr(ray));
          return back && glm::distance(*back, pixel) < tolerance_px ? std::optional(ray)
                                                                    : std::nullopt;
        }
        glm::dvec2 w(0);
        Imaged at;
        if (!Inverse(*this, kind, least_limit_rad_).follow(pixel, w, at)) return std::nullopt;
        return ray_at(w, at);
      },
      model_);
}

std::optional<double> Lens::focal_px() const noexcept {
  const auto centre = project({0, 0, 1});
  const auto on_axis = centre ? ray(*centre) : std::nullopt;
  return on_axis ? std::optional(1 / std::sqrt(pixel_sr(*on_axis))) : std::nullopt;
}

void Lens::fill(int begin, int end, std::span<PixelRay> rays) const {
  std::visit(
      [&]<typename Model>(const Model& kind) {
        const auto width = static_cast<std::size_t>(size_px_.x);
        if constexpr (Closed<Model>) {
          const double least_cosine = math::cos(std::min(least_limit_rad_, farthest_rad));
          for (std::size_t i = 0; i < rays.size(); ++i) {
            const auto column = static_cast<double>(i % width);
            const std::size_t row = i / width;
            rays[i] = closed_ray(kind, {column, begin + static_cast<double>(row)});
            const glm::dvec3& direction = rays[i].direction;
            if (!Unlimited<Model> && direction.z <= least_cosine && !images(direction))
              rays[i] = {};
          }
          return;
        }
        RowFiller filler(*this, kind, reach_px_, least_limit_rad_);
        for (int row = begin; row < end; ++row)
          filler.fill(row, rays.subspan(static_cast<std::size_t>(row - begin) * width, width));
      },
      model_);
}

}  // namespace groundray
