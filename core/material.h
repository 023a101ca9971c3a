#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <variant>

#include "core/cosine_table.h"
#include "core/spectrum.h"

namespace groundray {

/// A surface that looks equally bright from everywhere.
struct Lambertian {
  Spectrum spectrum;  ///< hemispherical reflectance: the share of the light that comes back, 0 to 1
};

/// A matt surface of Lambertian facets, which looks flatter than a Lambertian one and brighter when
/// lit from behind the viewer: the energy-preserving model of Oren and Nayar.
/// @see docs/materials.md
struct RoughDiffuse {
  Spectrum spectrum;     ///< reflectance of the whole surface in light from everywhere, 0 to 1
  double roughness = 0;  ///< 0, Lambertian, to 1
};

/// A Lambertian base under a clear coat with a rough surface: wet ground, varnish, gloss paint.
struct Coated {
  Spectrum spectrum;              ///< reflectance of the base where there is no coat, 0 to 1
  double refractive_index = 1.5;  ///< of the coat, > 1 up to 4; the same at all wavelengths
  double alpha = 0.1;             ///< width of the slopes of its facets (GGX), 0.01 to 1
};

/// A bare metal with a rough surface.
struct Conductor {
  Spectrum refractive_index;        ///< real part n of the index, > 0
  Spectrum extinction_coefficient;  ///< imaginary part k, >= 0
  double alpha = 0.1;               ///< width of the slopes of its facets (GGX), 0.01 to 1
};

/// A thin leaf, equal on both sides: it scatters light evenly to the side it came from and, less or
/// more, to the other.
struct PlantLeaf {
  Spectrum reflectance;
  Spectrum transmittance;  ///< with the reflectance at most 1
};

/// A surface that sends light back to its source: sheeting of glass beads or prisms.
struct RetroReflector {
  /// Coefficient of retroreflection R_A of ASTM E808 at small angles, cd/(lx m^2) = 1/sr: intensity
  /// back to the source per illuminance across the beam and area of sheeting.
  double coefficient_cd_lx_m2 = 0;
};

/// How a surface reflects, and what it shines with itself.
struct Material {
  std::string name;
  std::variant<Lambertian, RoughDiffuse, Coated, Conductor, PlantLeaf, RetroReflector> reflection;
  /// Radiance of its own, the same to all sides and from both: linear sRGB, W/(m^2 sr), see
  /// docs/sky.md for the unit. Cameras see it; lidars do not.
  glm::dvec3 emitted{0};
};

/// @throws Error listing every field of `material` that is out of bounds: a spectrum must have
///         samples, by ascending wavelength, of reflectances from 0 to 1; a coefficient must be
///         positive; what is emitted finite and >= 0; other bounds stand at the fields.
void check_material(const Material& material);

/// What a rough surface sends back to the source at one wavelength, in the terms that
/// `retro_brdf_cos` adds up.
struct RoughRetro {
  double grazing_per_sr = 0;   ///< of rough diffuse surfaces, times the squared sine of incidence
  double mirror = 0;           ///< reflectance of a facet across the beam
  double alpha = 1;            ///< of GGX
  double shared_per_sr = 0;    ///< of light that two shares below let pass, times their product
  CosineTable<float> share{};  ///< of light that leaves at first scattering
};

/// What a material sends back to the source at one wavelength; see `retro_brdf_cos`.
struct RetroBrdf {
  double diffuse_per_sr = 0;          ///< f_r of a Lambertian: reflectance / pi
  double retro_per_sr = 0;            ///< f_r cos of a retro-reflector: R_A
  std::optional<RoughRetro> rough{};  ///< of the kinds that depend on incidence otherwise
  double albedo = 0;  ///< share of light from everywhere that comes back: what sunlight becomes
  bool takes_tint = true;  ///< false of metals and retro-reflectors
};

/// Returns what a material sends back at a wavelength; spectra are linear between their samples,
/// and a retro-reflector is taken as the same at all wavelengths. Takes some 20 ms for a rough
/// surface: do this once for each lidar.
/// @throws Error as check_material, or if a spectrum does not reach `wavelength_nm`.
RetroBrdf retro_brdf(const Material& material, double wavelength_nm);

/// Returns the part of `retro_brdf_cos` that is of roughness, 1/sr.
double rough_retro_brdf_cos(const RoughRetro& rough, double cos_incidence) noexcept;

/// Returns f_r cos, in 1/sr: the intensity that a surface sends back to the source for each watt of
/// the source's light that hits it, where f_r is its BRDF back to the source and cos the cosine of
/// incidence, in [0, 1].
/// @see docs/materials.md: why R_A, not R_A cos, stands for a retro-reflector.
inline double retro_brdf_cos(const RetroBrdf& brdf, double cos_incidence) noexcept {
  const double matt_and_retro = brdf.diffuse_per_sr * cos_incidence + brdf.retro_per_sr;
  if (!brdf.rough) [[likely]]
    return matt_and_retro;
  return matt_and_retro + rough_retro_brdf_cos(*brdf.rough, cos_incidence);
}

/// Returns the same of a surface that a texture makes brighter or darker: all but what its facets
/// mirror, which is the same under any paint. Of rough and coated surfaces the light that is
/// scattered more than once changes in proportion, too.
/// @param brightness  see Tint; counts up to 1 / albedo, where all light comes back.
double tinted_retro_brdf_cos(const RetroBrdf& brdf, double cos_incidence,
                             double brightness) noexcept;

/// Returns the share of light from everywhere that such a surface sends back.
double tinted_albedo(const RetroBrdf& brdf, double brightness) noexcept;

}  // namespace groundray
