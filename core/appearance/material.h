#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <variant>

#include "core/appearance/cosine_table.h"
#include "core/appearance/spectrum.h"

namespace groundray {

/// A surface whose radiance is the same in all directions.
struct Lambertian {
  Spectrum spectrum;  ///< hemispherical reflectance, 0 to 1
};

/// A rough surface of Lambertian facets: the energy-preserving Oren-Nayar model. It looks flatter
/// than a Lambertian surface, and brighter when lit from behind the viewer.
/// @see docs/reference/materials.md
struct RoughDiffuse {
  Spectrum spectrum;     ///< reflectance of the whole surface under uniform illumination, 0 to 1
  double roughness = 0;  ///< 0 (Lambertian) to 1
};

/// A Lambertian base under a clear coat with a rough surface: wet ground, varnish, gloss paint.
struct Coated {
  Spectrum spectrum;              ///< reflectance of the base without the coat, 0 to 1
  double refractive_index = 1.5;  ///< of the coat, > 1 up to 4; the same at all wavelengths
  double alpha = 0.1;             ///< GGX width of the distribution of its facets, 0.01 to 1
};

/// A bare metal with a rough surface.
struct Conductor {
  Spectrum refractive_index;        ///< real part n of the index, > 0
  Spectrum extinction_coefficient;  ///< imaginary part k, >= 0
  double alpha = 0.1;               ///< GGX width of the distribution of its facets, 0.01 to 1
};

/// A thin leaf, equal on both sides: Lambertian in reflection and in transmission.
struct PlantLeaf {
  Spectrum reflectance;
  Spectrum transmittance;  ///< sum with the reflectance at most 1
};

/// A surface that returns light to its source only: sheeting of glass beads or prisms.
struct RetroReflector {
  /// Coefficient of retroreflection R_A of ASTM E808 at small angles, cd/(lx m^2) = 1/sr: intensity
  /// towards the source, per illuminance on a plane across the beam and per area of sheeting.
  double coefficient_cd_lx_m2 = 0;
};

/// Reflection and emission of a surface.
struct Material {
  std::string name;
  std::variant<Lambertian, RoughDiffuse, Coated, Conductor, PlantLeaf, RetroReflector> reflection;
  /// Emitted radiance, equal in all directions and on both sides: linear sRGB, W/(m^2 sr); see
  /// docs/theory/sky.md for the unit. Cameras see it; lidars ignore it.
  glm::dvec3 emitted{0};
};

/// @throws Error listing every field of `material` that is out of bounds. A spectrum must have
///         samples, by ascending wavelength, with reflectances from 0 to 1; a coefficient must be
///         positive; emission must be finite and >= 0. The fields state the other bounds.
void check_material(const Material& material);

/// Backscatter of a rough surface at one wavelength: the terms that `retro_brdf_cos` sums.
struct RoughRetro {
  double grazing_per_sr = 0;   ///< coefficient of the squared sine of incidence (rough diffuse)
  double mirror = 0;           ///< reflectance of a facet at normal incidence
  double alpha = 1;            ///< GGX width
  double shared_per_sr = 0;    ///< multiple scattering or base: coefficient of (1 - share)^2 cos
  CosineTable<float> share{};  ///< directional albedo of the first scattering
};

/// Backscatter of a material at one wavelength; see `retro_brdf_cos`.
struct RetroBrdf {
  double diffuse_per_sr = 0;          ///< f_r of the Lambertian term: reflectance / pi
  double retro_per_sr = 0;            ///< f_r cos of a retro-reflector: R_A
  std::optional<RoughRetro> rough{};  ///< other terms, of rough, coated and metallic surfaces
  double albedo = 0;                  ///< fraction of uniform illumination that is reflected
  bool takes_tint = true;             ///< false for metals and retro-reflectors
};

/// Returns the backscatter of a material at a wavelength. Spectra are interpolated linearly; a
/// retro-reflector is assumed to be the same at all wavelengths. Takes about 20 ms for coated and
/// metallic surfaces: call it once for each lidar.
/// @throws Error as check_material, or if a spectrum does not cover `wavelength_nm`.
RetroBrdf retro_brdf(const Material& material, double wavelength_nm);

/// Returns the part of `retro_brdf_cos` that is due to roughness, 1/sr.
double rough_retro_brdf_cos(const RoughRetro& rough, double cos_incidence) noexcept;

/// Returns f_r cos, 1/sr: the intensity returned to the source for each watt that hits the surface.
/// f_r is the BRDF back to the source, and cos the cosine of incidence, in [0, 1].
/// @see docs/reference/materials.md: a retro-reflector returns R_A, not R_A cos.
inline double retro_brdf_cos(const RetroBrdf& brdf, double cos_incidence) noexcept {
  const double matt_and_retro = brdf.diffuse_per_sr * cos_incidence + brdf.retro_per_sr;
  if (!brdf.rough) [[likely]]
    return matt_and_retro;
  return matt_and_retro + rough_retro_brdf_cos(*brdf.rough, cos_incidence);
}

/// Returns retro_brdf_cos of a surface with a texture. The texture scales all terms except specular
/// reflection. For rough and coated surfaces this treats light that is scattered more than once as
/// proportional, too.
/// @param brightness  see Tint; limited to 1 / albedo, where all light is reflected.
double tinted_retro_brdf_cos(const RetroBrdf& brdf, double cos_incidence,
                             double brightness) noexcept;

/// Returns the fraction of uniform illumination that the surface with a texture reflects.
double tinted_albedo(const RetroBrdf& brdf, double brightness) noexcept;

}  // namespace groundray
