#pragma once

#include <string>
#include <variant>
#include <vector>

namespace groundray {

/// One value of a spectrum.
struct SpectrumSample {
  double wavelength_nm = 0;  ///< in vacuum
  double reflectance = 0;    ///< hemispherical: the share of the light that comes back, 0 to 1
};

/// A surface that looks equally bright from everywhere.
struct Lambertian {
  std::vector<SpectrumSample> spectrum;  ///< by ascending wavelength
};

/// A surface that sends light back to its source: sheeting of glass beads or prisms.
struct RetroReflector {
  /// Coefficient of retroreflection R_A of ASTM E808 at small angles, cd/(lx m^2) = 1/sr: intensity
  /// back to the source per illuminance across the beam and area of sheeting.
  double coefficient_cd_lx_m2 = 0;
};

/// How a surface reflects.
struct Material {
  std::string name;
  std::variant<Lambertian, RetroReflector> reflection;
};

/// @throws Error listing every field of `material` that is out of bounds: a spectrum must have
///         samples, by ascending wavelength, of reflectances from 0 to 1; a coefficient must be
///         positive.
void check_material(const Material& material);

/// What a material sends back to the source at one wavelength; see `retro_brdf_cos`.
struct RetroBrdf {
  double diffuse_per_sr = 0;  ///< f_r of a Lambertian: reflectance / pi
  double retro_per_sr = 0;    ///< f_r cos of a retro-reflector: R_A
};

/// Returns what a material sends back at a wavelength; spectra are linear between their samples,
/// and a retro-reflector is taken as the same at all wavelengths. Do this once for each lidar.
/// @throws Error as check_material, or if the spectrum does not reach `wavelength_nm`.
RetroBrdf retro_brdf(const Material& material, double wavelength_nm);

/// Returns f_r cos, in 1/sr: the intensity that a surface sends back to the source for each watt of
/// the source's light that hits it, where f_r is its BRDF back to the source and cos the cosine of
/// incidence, in [0, 1].
/// @see docs/materials.md: why R_A, not R_A cos, stands for a retro-reflector.
constexpr double retro_brdf_cos(const RetroBrdf& brdf, double cos_incidence) noexcept {
  return brdf.diffuse_per_sr * cos_incidence + brdf.retro_per_sr;
}

}  // namespace groundray
