#include "sensors/camera/imager.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/error.h"
#include "core/image/luminance.h"

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

}  // namespace

int channel_of(ColorFilter filter, glm::ivec2 pixel) noexcept {
  if (filter == ColorFilter::Mono) return 1;
  constexpr std::array<std::array<int, 4>, 4> corners{
      {{0, 1, 1, 2}, {2, 1, 1, 0}, {1, 0, 2, 1}, {1, 2, 0, 1}}};
  const auto& corner = corners[static_cast<std::size_t>(filter) - 1];
  return corner[static_cast<std::size_t>(pixel.y % 2 * 2 + pixel.x % 2)];
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
  const double top_dn = std::exp2(spec.bits) - 1;
  broken.unless(0 <= spec.black_dn && spec.black_dn < top_dn,
                "black_dn = {} must be 0 or more, and less than {}, the greatest value of {} bits",
                spec.black_dn, top_dn, spec.bits);
  broken.throw_if_any();
}

ImageF Imager::photons(const ImageF& irradiance_w_m2) const {
  check_image(irradiance_w_m2, 3, "irradiance");
  ImageF photons(irradiance_w_m2.width(), irradiance_w_m2.height(), 1);
  const double per_w_m2 =
      spec_.pixel_pitch_m * spec_.pixel_pitch_m * exposure_s_ * green_m / (planck_j_s * light_m_s);
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
                        std::exp2((spec_.temperature_c - spec_.reference_c) / spec_.doubling_k);
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
  const double top_dn = std::exp2(spec_.bits) - 1;
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

}  // namespace groundray
