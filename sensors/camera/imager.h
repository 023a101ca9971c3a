#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "core/image/image.h"
#include "core/random.h"

namespace groundray {

class Lens;
struct ApertureSpec;

/// Colour filter of the pixels; a mosaic is named by the four pixels of its upper left corner.
enum class ColorFilter { Mono, Rggb, Bggr, Grbg, Gbrg };

/// Returns the channel that a pixel measures: 0, 1 or 2 for red, green or blue; 1 for Mono.
int channel_of(ColorFilter filter, glm::ivec2 pixel) noexcept;

/// Parameters of a sensor, in the terms of EMVA 1288.
struct ImagerSpec {
  double pixel_pitch_m = 3.45e-6;
  ColorFilter filter = ColorFilter::Rggb;
  /// Electrons per photon of 555 nm for red, green and blue pixels, > 0 up to 4: above 1 for pixels
  /// with a wider band than the eye's. Mono uses green's.
  glm::dvec3 quantum_efficiency{0.6};
  double full_well_e = 1e4;     ///< capacity of a pixel, 1 to 1e7
  double read_noise_e = 0;      ///< standard deviation of the read noise
  double dark_current_e_s = 0;  ///< dark current at `reference_c`
  double reference_c = 25;
  double temperature_c = 25;  ///< temperature of the sensor
  double doubling_k = 7;      ///< temperature difference that doubles the dark current
  double prnu = 0;            ///< standard deviation of pixels' responsivities, relative
  double dsnu_e = 0;          ///< standard deviation of pixels' offsets
  double gain_dn_e = 0.4;     ///< system gain K, DN per electron
  double black_dn = 0;        ///< digital number at zero electrons
  int bits = 12;              ///< bit depth, 8 to 16
  bool noise = true;  ///< true for random draws and fixed patterns, false for means of equal pixels
};

/// Returns the mean number of photons of 555 nm on a pixel for an irradiance of 1 W/m^2.
double photons_per_w_m2(const ImagerSpec& imager, double exposure_s);

/// Converts the irradiance of a sensor to digital numbers, stage by stage. Immutable; any number of
/// threads may use one.
/// @see EMVA Standard 1288, release 4.0 (2021); docs/theory/camera_imager.md for the equations.
class Imager {
 public:
  /// @throws Error listing every field of `spec` that is out of bounds, and an exposure that is not
  ///         positive.
  Imager(const ImagerSpec& spec, double exposure_s);

  const ImagerSpec& spec() const noexcept { return spec_; }

  /// Returns the mean number of photons on each pixel in an exposure, one channel.
  /// @param irradiance_w_m2  linear sRGB on the sensor, weighted by the eye's response: 1 W/m^2 is
  ///        683 lx. Photons are those of 555 nm. Negative values and NaN count as dark.
  ImageF photons(const ImageF& irradiance_w_m2) const;
  /// Returns the electrons in each pixel at the end of the exposure, up to the full well; whole
  /// numbers below it if there is noise.
  /// @param key  names sensor and frame.
  ImageF electrons(const ImageF& photons, const RandomKey& key) const;
  /// Returns the digital numbers read out of one channel of electrons.
  Image16 digital(const ImageF& electrons, const RandomKey& key) const;
  /// Returns the fraction of the pixels that are full, or have the largest digital number.
  /// @param electrons, digital  of the same image.
  double saturated_share(const ImageF& electrons, const Image16& digital) const;

 private:
  ImagerSpec spec_;
  double exposure_s_;
};

/// Returns the irradiance of each pixel, W/m^2, for a scene of uniform radiance 1 W/(m^2 sr), hence
/// in sr: the solid angle of the pupil as seen from the pixel, times the cosine there, transmission
/// and vignetting. One channel; 0 where a pixel has no viewing direction.
/// @param pixel_pitch_m  side of a pixel.
/// @throws Error listing every field that is out of bounds; if the vignetting is negative anywhere
///         in the image; or if the focal length is not within a factor of 1.5 of the lens' own for
///         pixels of this pitch.
/// @see docs/theory/camera_imager.md
ImageF pupil_sr(const Lens& lens, const ApertureSpec& aperture, double pixel_pitch_m);

/// Returns the irradiance of the sensor, W/m^2: each channel of `radiance`, W/(m^2 sr), times
/// `pupil_sr`.
/// @throws Error if their sizes differ, or if `pupil_sr` does not have one channel.
ImageF irradiance(const ImageF& radiance, const ImageF& pupil_sr);

}  // namespace groundray
