#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <variant>

#include "core/cosine_table.h"
#include "core/material.h"

namespace groundray {

/// Sends `albedo` of the light evenly into the hemisphere it came from.
struct LambertianBsdf {
  glm::dvec3 albedo{0};
};

/// The energy-preserving model of Oren and Nayar. `albedo` is of the whole surface, in light from
/// everywhere; the facets' follows from it.
/// @see Portsmouth, Kutz and Hill, EON: a practical energy-preserving rough diffuse BRDF (JCGT
///      2025).
struct RoughDiffuseBsdf {
  glm::dvec3 albedo{0};
  double roughness = 0;  ///< 0 to 1
};

/// A rough dielectric surface (GGX) on a Lambertian base. What the surface does not mirror enters,
/// is scattered by the base, and leaves, as often as it is thrown back from inside.
/// @see Saunderson, Calculation of the color of pigmented plastics (JOSA 1942); Lekner and Dorf,
///      Why some things are darker when wet (Applied Optics 1988).
struct CoatedBsdf {
  glm::dvec3 albedo{0};  ///< of the base alone
  double refractive_index = 1.5;
  double alpha = 0.1;
  CosineTable<float> mirrored{};  ///< share of light by the cosine of its incidence
  double thrown_back = 0;         ///< share of the base's light that the surface keeps inside

  /// Returns f, 1/sr, of light that goes in and out through a surface that mirrors none of it.
  glm::dvec3 base_per_sr() const noexcept;
};

/// A rough metal (GGX). Light that facets scatter more than once is added (Kulla and Conty,
/// Revisiting physically based shading at Imageworks, 2017).
struct ConductorBsdf {
  CosineTable<glm::vec3> reflectance{};  ///< of a facet, by the cosine of incidence on it
  double alpha = 0.1;
  CosineTable<float> once{};    ///< share of light that a white metal scatters but once
  glm::dvec3 shared_per_sr{0};  ///< f of light scattered more than once, per share that is, squared
};

/// A thin leaf, Lambertian on both sides.
struct PlantLeafBsdf {
  glm::dvec3 reflectance{0};
  glm::dvec3 transmittance{0};
};

/// Sends nothing back but to the source, for which there is `retro_brdf`.
struct BlackBsdf {};

/// A direction that `sample` chose.
struct BsdfSample {
  glm::dvec3 wi{0, 0, 1};
  glm::dvec3 weight{0};   ///< f |cos_i| / pdf; 0 if no light comes this way: then drop the path
  double pdf_per_sr = 0;  ///< pdf_per_sr(bsdf, wo, wi)
};

/// How a surface scatters light of three colours, or of one wavelength in all three channels.
/// Plain data. Directions are unit vectors away from the surface, z = shading normal. Every surface
/// is the same from below as from above; only leaves let light through.
struct Bsdf {
  std::variant<LambertianBsdf, RoughDiffuseBsdf, CoatedBsdf, ConductorBsdf, PlantLeafBsdf,
               BlackBsdf>
      surface;

  /// Returns the BSDF f, 1/sr: radiance toward `wo` for each W/m^2 that arrives from `wi`. The same
  /// with `wo` and `wi` exchanged.
  glm::dvec3 eval(const glm::dvec3& wo, const glm::dvec3& wi) const noexcept;

  /// Returns the density with which `sample` chooses `wi`, 1/sr. It integrates to 1 less the chance
  /// of samples of weight 0.
  double pdf_per_sr(const glm::dvec3& wo, const glm::dvec3& wi) const noexcept;

  /// Chooses a direction for light to come from.
  /// @param u  uniform in [0, 1)^2.
  BsdfSample sample(const glm::dvec3& wo, const glm::dvec2& u) const noexcept;

  /// Returns the share of light from everywhere that comes back to the side it came from, to 1e-3.
  glm::dvec3 albedo() const noexcept;

  /// Returns the same surface with its reflectance, of a coated one the base's, multiplied by what
  /// a texture tells, >= 0, up to where all light comes back. Metals stay as they are.
  Bsdf tinted(const glm::dvec3& factor) const noexcept;
};

/// Returns how a material scatters the colours of linear sRGB; what lies out of gamut is cut to
/// [0, 1]. Takes some 20 ms for coated and metallic ones: do it once for each material.
/// @throws Error as check_material, or if a spectrum does not reach from 400 to 700 nm.
Bsdf bsdf_in_colour(const Material& material);

/// Returns how a material scatters one wavelength, the same in all three channels.
/// @throws Error as check_material, or if a spectrum does not reach `wavelength_nm`.
Bsdf bsdf_at(const Material& material, double wavelength_nm);

/// Returns the share of unpolarised light that a smooth surface mirrors, by the cosine of
/// incidence and the index n + i k of what lies behind it; before it is air.
/// @see Born and Wolf, Principles of Optics, sections 1.5 and 14.2.
double fresnel_reflectance(double cosine, double n, double k) noexcept;

}  // namespace groundray
