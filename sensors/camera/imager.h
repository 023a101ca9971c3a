#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "core/image.h"
#include "core/random.h"

namespace groundray {

/// Which colour filter is in front of a pixel: of mosaics, by the four of the upper left corner.
enum class ColorFilter { Mono, Rggb, Bggr, Grbg, Gbrg };

/// Which of red, green and blue a pixel of a mosaic sees: 0, 1 or 2; green for Mono.
int channel_of(ColorFilter filter, glm::ivec2 pixel) noexcept;

/// A sensor by the terms of EMVA 1288.
struct ImagerSpec {
  double pixel_pitch_m = 3.45e-6;
  ColorFilter filter = ColorFilter::Rggb;
  /// Electrons for each photon of 555 nm on red, green and blue pixels, > 0 up to 4: more than 1
  /// for pixels that see a wider band than the eye. Of green for Mono.
  glm::dvec3 quantum_efficiency{0.6};
  double full_well_e = 1e4;     ///< as many electrons fit in a pixel, 1 to 1e7
  double read_noise_e = 0;      ///< standard deviation of what reading adds
  double dark_current_e_s = 0;  ///< at `reference_c`
  double reference_c = 25;
  double temperature_c = 25;  ///< of the sensor
  double doubling_k = 7;      ///< the dark current doubles with so much more
  double prnu = 0;            ///< standard deviation of pixels' responsivities, relative
  double dsnu_e = 0;          ///< standard deviation of pixels' offsets
  double gain_dn_e = 0.4;     ///< digital numbers for each electron: K
  double black_dn = 0;        ///< digital number of no electron
  int bits = 12;              ///< 8 to 16
  bool noise = true;          ///< off, means come out, of pixels that are all alike
};

/// Turns light on a sensor into digital numbers, stage by stage. Immutable; any number of threads
/// may use one.
/// @see EMVA Standard 1288, release 4.0 (2021); docs/camera_imager.md for the equations.
class Imager {
 public:
  /// @throws Error listing every field of `spec` that is out of bounds, and an exposure that is not
  ///         positive.
  Imager(const ImagerSpec& spec, double exposure_s);

  const ImagerSpec& spec() const noexcept { return spec_; }

  /// Returns the mean number of photons on each pixel in an exposure, one channel.
  /// @param irradiance_w_m2  linear red, green and blue of the light on the sensor, weighed by the
  ///        eye: 1 W/m^2 is 683 lx. Photons are those of 555 nm. What is negative or NaN counts
  ///        as dark.
  ImageF photons(const ImageF& irradiance_w_m2) const;
  /// Returns the electrons in each pixel at the end of the exposure: whole numbers, if there is
  /// noise, up to the full well.
  /// @param key  names sensor and frame.
  ImageF electrons(const ImageF& photons, const RandomKey& key) const;
  /// Returns what is read out of one channel of electrons.
  Image16 digital(const ImageF& electrons, const RandomKey& key) const;

 private:
  ImagerSpec spec_;
  double exposure_s_;
};

}  // namespace groundray
