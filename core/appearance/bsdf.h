#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <variant>

#include "core/appearance/cosine_table.h"
#include "core/appearance/material.h"
#include "core/pack.h"

namespace groundray {

/// A Lambertian surface: reflects the fraction `albedo` of the light to the side it came from.
struct LambertianBsdf {
  glm::dvec3 albedo{0};
};

/// The energy-preserving Oren-Nayar model. `albedo` is the reflectance of the whole surface under
/// uniform illumination; the albedo of the facets follows from it.
/// @see Portsmouth, Kutz and Hill, EON: a practical energy-preserving rough diffuse BRDF (JCGT
///      2025).
struct RoughDiffuseBsdf {
  glm::dvec3 albedo{0};
  double roughness = 0;  ///< 0 to 1
};

/// A rough dielectric coat (GGX) on a Lambertian base. Light that the coat does not reflect enters,
/// is scattered by the base, and leaves after any number of internal reflections.
/// @see Saunderson, Calculation of the color of pigmented plastics (JOSA 1942); Lekner and Dorf,
///      Why some things are darker when wet (Applied Optics 1988).
struct CoatedBsdf {
  glm::dvec3 albedo{0};  ///< of the base alone
  double refractive_index = 1.5;
  double alpha = 0.1;
  CosineTable<float> mirrored{};  ///< directional albedo of the specular reflection, by cosine
  double thrown_back = 0;  ///< fraction of the base's light that the coat reflects back inside

  /// Returns the BRDF of a base of albedo `of_base`, 1/sr, without the specular losses at entry and
  /// exit: f is this times (1 - mirrored(cos_o)) (1 - mirrored(cos_i)).
  glm::dvec3 base_per_sr(const glm::dvec3& of_base) const noexcept;
};

/// A rough metal (GGX), including light that is scattered by facets more than once (Kulla and
/// Conty, Revisiting physically based shading at Imageworks, 2017).
struct ConductorBsdf {
  CosineTable<glm::vec3> reflectance{};  ///< of a facet, by the cosine of incidence on it
  double alpha = 0.1;
  CosineTable<float> once{};    ///< directional albedo of white facets for single scattering
  glm::dvec3 shared_per_sr{0};  ///< multiple scattering: f / ((1 - once(cos_o)) (1 - once(cos_i)))
};

/// A thin leaf, Lambertian on both sides.
struct PlantLeafBsdf {
  glm::dvec3 reflectance{0};
  glm::dvec3 transmittance{0};
};

/// A surface that reflects light only back to its source, for which `retro_brdf` is used.
struct BlackBsdf {};

/// A direction drawn by Bsdf::sample, or a pack of them.
template <typename Real>
struct BsdfSampleOf {
  Vec3<Real> wi;
  Vec3<Real> weight;  ///< f |cos_i| / pdf; 0 if no light comes from wi: then end the path
  Real pdf_per_sr;    ///< Bsdf::pdf_per_sr(wo, wi)
};
/// One direction.
using BsdfSample = BsdfSampleOf<double>;

/// BSDF of a surface in three channels: linear sRGB, or one wavelength in all three. Plain data.
/// Directions are unit vectors away from the surface, z = shading normal. Both sides of a surface
/// are equal; only leaves transmit light.
///
/// `tint` is the colour of a texture, each channel >= 0: the surface's reflectance (of the base, if
/// coated) is multiplied by it, and limited so that no more light leaves than arrives. Metals and
/// retro-reflectors are not tinted.
struct Bsdf {
  std::variant<LambertianBsdf, RoughDiffuseBsdf, CoatedBsdf, ConductorBsdf, PlantLeafBsdf,
               BlackBsdf>
      surface;

  /// Returns the BSDF f, 1/sr: radiance towards `wo` per irradiance from `wi`. Symmetric in `wo`
  /// and `wi`.
  glm::dvec3 eval(const glm::dvec3& wo, const glm::dvec3& wi,
                  const glm::dvec3& tint = glm::dvec3(1)) const noexcept;
  Vec3<Pack> eval(const Vec3<Pack>& wo, const Vec3<Pack>& wi,
                  const Vec3<Pack>& tint) const noexcept;

  /// Returns the density with which `sample` draws `wi`, 1/sr. Its integral is 1 minus the
  /// probability that `sample` returns a direction of density 0 (and weight 0).
  double pdf_per_sr(const glm::dvec3& wo, const glm::dvec3& wi,
                    const glm::dvec3& tint = glm::dvec3(1)) const noexcept;
  Pack pdf_per_sr(const Vec3<Pack>& wo, const Vec3<Pack>& wi,
                  const Vec3<Pack>& tint) const noexcept;

  /// Draws a direction from which light arrives.
  /// @param u  uniform in [0, 1)^2.
  BsdfSample sample(const glm::dvec3& wo, const glm::dvec2& u,
                    const glm::dvec3& tint = glm::dvec3(1)) const noexcept;
  BsdfSampleOf<Pack> sample(const Vec3<Pack>& wo, const Vec2<Pack>& u,
                            const Vec3<Pack>& tint) const noexcept;

  /// Returns the fraction of uniform illumination that is reflected to the side it came from, to
  /// 1e-3.
  glm::dvec3 albedo(const glm::dvec3& tint = glm::dvec3(1)) const noexcept;
};

/// Returns the BSDF of a material for the colours of linear sRGB; colours out of gamut are clipped
/// to [0, 1]. Takes about 20 ms for coated and metallic materials: call it once for each material.
/// @throws Error as check_material, or if a spectrum does not cover 400 to 700 nm.
Bsdf bsdf_in_colour(const Material& material);

/// Returns the BSDF of a material at one wavelength, the same in all three channels.
/// @throws Error as check_material, or if a spectrum does not cover `wavelength_nm`.
Bsdf bsdf_at(const Material& material, double wavelength_nm);

/// Returns the Fresnel reflectance of a smooth surface for unpolarised light incident from air.
/// @param cosine  of incidence.
/// @param n  real part of the index n + i k of the medium behind the surface.
/// @param k  imaginary part of that index.
/// @see Born and Wolf, Principles of Optics, sections 1.5 and 14.2.
double fresnel_reflectance(double cosine, double n, double k) noexcept;

}  // namespace groundray
