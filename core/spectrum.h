#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

namespace groundray {

/// One value of a spectrum.
struct SpectrumSample {
  double wavelength_nm = 0;  ///< in vacuum
  double value = 0;          ///< a reflectance, a transmittance or an optical constant
};

/// A spectrum: samples by ascending wavelength, linear between them.
using Spectrum = std::vector<SpectrumSample>;

/// Returns the value at a wavelength; nothing beyond the first and the last sample.
std::optional<double> value_at(std::span<const SpectrumSample> spectrum,
                               double wavelength_nm) noexcept;

/// The wavelengths that a colour needs. A reflectance that differs by 1 beyond them changes a
/// colour by less than 0.003.
inline constexpr double colour_from_nm = 400;
inline constexpr double colour_to_nm = 700;  ///< as colour_from_nm

/// Returns the linear sRGB colour (Rec. 709 primaries) that a reflectance or transmittance has in
/// daylight, CIE D65, for the CIE 1931 2-degree observer: sums over 380 to 780 nm in steps of 5 nm,
/// in which a spectrum is held at its ends. A constant spectrum gives three equal numbers.
/// Saturated colours may have numbers below 0 or above 1.
/// @param spectrum  reaches from colour_from_nm, or less, to colour_to_nm, or more.
/// @see CIE 15:2018, Colorimetry; IEC 61966-2-1, sRGB.
glm::dvec3 linear_srgb(std::span<const SpectrumSample> spectrum) noexcept;

}  // namespace groundray
