#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

namespace groundray {

/// One sample of a spectrum.
struct SpectrumSample {
  double wavelength_nm = 0;  ///< in vacuum
  double value = 0;          ///< a reflectance, a transmittance or an optical constant
};

/// Spectrum: samples by ascending wavelength, interpolated linearly.
using Spectrum = std::vector<SpectrumSample>;

/// Returns the value at a wavelength; nothing before the first and after the last sample.
std::optional<double> value_at(std::span<const SpectrumSample> spectrum,
                               double wavelength_nm) noexcept;

/// Wavelengths that a colour requires. A reflectance that differs by 1 outside them changes a
/// colour by less than 0.003.
inline constexpr double colour_from_nm = 400;
inline constexpr double colour_to_nm = 700;  ///< as colour_from_nm

/// Returns the linear sRGB colour (Rec. 709 primaries) of a reflectance or transmittance in
/// daylight, CIE D65, for the CIE 1931 2-degree observer: sums over 380 to 780 nm in steps of 5 nm,
/// where the spectrum is continued with its end values. A constant spectrum gives three equal
/// numbers. Saturated colours may have components below 0 or above 1.
/// @param spectrum  must cover colour_from_nm to colour_to_nm.
/// @see CIE 15:2018, Colorimetry; IEC 61966-2-1, sRGB.
glm::dvec3 linear_srgb(std::span<const SpectrumSample> spectrum) noexcept;

}  // namespace groundray
