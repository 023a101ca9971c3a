#include "sensors/camera/imager.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/image/luminance.h"
#include "core/math.h"
#include "sensors/camera/camera_spec.h"
#include "sensors/camera/lens/lens.h"

namespace groundray {
namespace {

constexpr double planck_j_s = 6.62607015e-34;  // exact in the SI
constexpr double light_m_s = 299'792'458;      // exact in the SI
constexpr double green_m = 555e-9;             // wavelength at which 1 W is 683 lm

// Returns the key of a pixel's random numbers in a frame.
RandomKey of_pixel(RandomKey key, std::size_t pixel, RandomStream stream) {
  key.pulse = static_cast<std::uint32_t>(pixel);
  key.sub_ray = 0;
  key.stream = stream;
  return key;
}

// Returns the deviations of a pixel's responsivity and offset, in standard deviations; they are
// equal in all frames.
glm::dvec2 fixed_pattern(RandomKey key, std::size_t pixel) {
  key.frame = 0;
  return random_normal(of_pixel(key, pixel, RandomStream::FixedPattern));
}

// Calls act(x, y, index of the pixel) for all pixels, on all cores.
template <typename Act>
void for_each_pixel(int width, int height, const Act& act) {
  tbb::parallel_for(0, height, [&](int y) {
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
    for (int x = 0; x < width; ++x) act(x, y, first + static_cast<std::size_t>(x));
  });
}

void check_image(const ImageF& image, int channels, const char* what) {
  if (image.channels() == channels) return;
  throw Error("imager: an image of {} must have {} channels, but has {}", what, channels,
              image.channels());
}

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

int channel_of(ColorFilter filter, glm::ivec2 pixel) noexcept {
  if (filter == ColorFilter::Mono) return 1;
  constexpr std::array<std::array<int, 4>, 4> corners{
      {{0, 1, 1, 2}, {2, 1, 1, 0}, {1, 0, 2, 1}, {1, 2, 0, 1}}};
  const auto& corner = corners[static_cast<std::size_t>(filter) - 1];
  return corner[static_cast<std::size_t>(pixel.y % 2 * 2 + pixel.x % 2)];
}

double photons_per_w_m2(const ImagerSpec& imager, double exposure_s) {
  return imager.pixel_pitch_m * imager.pixel_pitch_m * exposure_s * green_m /
         (planck_j_s * light_m_s);
}

Imager::Imager(const ImagerSpec& spec, double exposure_s) : spec_(spec), exposure_s_(exposure_s) {
  Violations broken("imager");
  const auto positive = [&](const char* name, double value) {
    broken.unless(value > 0 && std::isfinite(value), "{} = {} must be positive and finite", name,
                  value);
  };
  const auto not_negative = [&](const char* name, double value) {
    broken.unless(value >= 0 && std::isfinite(value), "{} = {} must be 0 or more, and finite", name,
                  value);
  };
  positive("exposure_s", exposure_s);
  positive("pixel_pitch_m", spec.pixel_pitch_m);
  positive("gain_dn_e", spec.gain_dn_e);
  positive("doubling_k", spec.doubling_k);
  not_negative("read_noise_e", spec.read_noise_e);
  not_negative("dark_current_e_s", spec.dark_current_e_s);
  not_negative("prnu", spec.prnu);
  not_negative("dsnu_e", spec.dsnu_e);
  for (glm::length_t i = 0; i < 3; ++i) {
    const double share = spec.quantum_efficiency[i];
    broken.unless(0 < share && share <= 4,
                  "quantum_efficiency {} must be > 0 and at most 4: is it in percent?", share);
  }
  // Above the limit, a float would not represent every whole number.
  broken.unless(1 <= spec.full_well_e && spec.full_well_e <= 1e7,
                "full_well_e = {} must be from 1 to 1e7", spec.full_well_e);
  broken.unless(std::isfinite(spec.temperature_c) && std::isfinite(spec.reference_c),
                "temperature_c = {} and reference_c = {} must be finite", spec.temperature_c,
                spec.reference_c);
  broken.unless(8 <= spec.bits && spec.bits <= 16, "bits = {} must be from 8 to 16", spec.bits);
  const double top_dn = math::exp2(spec.bits) - 1;
  broken.unless(0 <= spec.black_dn && spec.black_dn < top_dn,
                "black_dn = {} must be 0 or more, and less than {}, the greatest value of {} bits",
                spec.black_dn, top_dn, spec.bits);
  broken.throw_if_any();
}

ImageF Imager::photons(const ImageF& irradiance_w_m2) const {
  check_image(irradiance_w_m2, 3, "irradiance");
  ImageF photons(irradiance_w_m2.width(), irradiance_w_m2.height(), 1);
  const double per_w_m2 = photons_per_w_m2(spec_, exposure_s_);
  for_each_pixel(photons.width(), photons.height(), [&](int x, int y, std::size_t pixel) {
    const auto light = irradiance_w_m2.at(x, y);
    const double w_m2 = spec_.filter == ColorFilter::Mono
                            ? luminance({light[0], light[1], light[2]})
                            : light[static_cast<std::size_t>(channel_of(spec_.filter, {x, y}))];
    photons.values()[pixel] = static_cast<float>(std::max(0.0, w_m2) * per_w_m2);
  });
  return photons;
}

ImageF Imager::electrons(const ImageF& photons, const RandomKey& key) const {
  check_image(photons, 1, "photons");
  ImageF electrons(photons.width(), photons.height(), 1);
  const double dark_e = spec_.dark_current_e_s * exposure_s_ *
                        math::exp2((spec_.temperature_c - spec_.reference_c) / spec_.doubling_k);
  for_each_pixel(photons.width(), photons.height(), [&](int x, int y, std::size_t pixel) {
    double photo_e =
        spec_.quantum_efficiency[channel_of(spec_.filter, {x, y})] * photons.values()[pixel];
    if (spec_.noise && spec_.prnu > 0)
      photo_e *= std::max(0.0, 1 + spec_.prnu * fixed_pattern(key, pixel).x);
    double count = photo_e + dark_e;
    if (spec_.noise) count = random_poisson(of_pixel(key, pixel, RandomStream::ShotNoise), count);
    electrons.values()[pixel] =
        count > 0 ? static_cast<float>(std::min(spec_.full_well_e, count)) : 0;
  });
  return electrons;
}

Image16 Imager::digital(const ImageF& electrons, const RandomKey& key) const {
  check_image(electrons, 1, "electrons");
  Image16 digital(electrons.width(), electrons.height(), 1);
  const double top_dn = math::exp2(spec_.bits) - 1;
  for_each_pixel(electrons.width(), electrons.height(), [&](int, int, std::size_t pixel) {
    double count = electrons.values()[pixel];
    if (spec_.noise && spec_.dsnu_e > 0) count += spec_.dsnu_e * fixed_pattern(key, pixel).y;
    if (spec_.noise && spec_.read_noise_e > 0)
      count += spec_.read_noise_e * random_normal(of_pixel(key, pixel, RandomStream::ReadNoise)).x;
    const double dn = std::round(spec_.gain_dn_e * count + spec_.black_dn);
    digital.values()[pixel] = static_cast<std::uint16_t>(std::min(top_dn, std::max(0.0, dn)));
  });
  return digital;
}

double Imager::saturated_share(const ImageF& electrons, const Image16& digital) const {
  const double top_dn = math::exp2(spec_.bits) - 1;
  std::size_t saturated = 0;
  for (std::size_t i = 0; i < electrons.values().size(); ++i)
    saturated +=
        electrons.values()[i] >= spec_.full_well_e || digital.values()[i] >= top_dn ? 1 : 0;
  return static_cast<double>(saturated) /
         static_cast<double>(std::max(electrons.values().size(), std::size_t{1}));
}

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
