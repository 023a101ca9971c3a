#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <numbers>
#include <optional>
#include <string>

#include "core/appearance/bsdf.h"
#include "core/appearance/microfacets.h"
#include "core/error.h"

namespace groundray {
namespace {

using std::numbers::pi;

// Converts a spectrum to three channels: its value at one wavelength, or its colour in linear sRGB.
class Channels {
 public:
  Channels(const Material& material, std::optional<double> wavelength_nm)
      : name_(material.name), wavelength_nm_(wavelength_nm) {}

  glm::dvec3 operator()(const Spectrum& spectrum) const {
    check_reach(spectrum);
    if (wavelength_nm_) return glm::dvec3(*value_at(spectrum, *wavelength_nm_));
    return glm::clamp(linear_srgb(spectrum), 0.0, 1.0);
  }

  // Reflectance of a metal's facets, by the cosine of incidence on them.
  glm::dvec3 operator()(const Conductor& metal, double cosine) const {
    check_reach(metal.refractive_index);
    check_reach(metal.extinction_coefficient);
    const auto reflectance = [&](double nm) {
      return fresnel_reflectance(cosine, *value_at(metal.refractive_index, nm),
                                 *value_at(metal.extinction_coefficient, nm));
    };
    if (wavelength_nm_) return glm::dvec3(reflectance(*wavelength_nm_));
    Spectrum spectrum;
    for (double nm = colour_from_nm; nm <= colour_to_nm; nm += 5)
      spectrum.push_back({nm, reflectance(nm)});
    return glm::clamp(linear_srgb(spectrum), 0.0, 1.0);
  }

 private:
  void check_reach(const Spectrum& spectrum) const {
    for (const double nm :
         {wavelength_nm_.value_or(colour_from_nm), wavelength_nm_.value_or(colour_to_nm)}) {
      if (!value_at(spectrum, nm)) {
        throw Error("Material '{}': the spectrum reaches from {} to {} nm, but not to {} nm{}",
                    name_, spectrum.front().wavelength_nm, spectrum.back().wavelength_nm, nm,
                    wavelength_nm_ ? "" : ", which colours require");
      }
    }
  }

  const std::string& name_;
  std::optional<double> wavelength_nm_;
};

Bsdf resolve(const Lambertian& surface, const Channels& seen) {
  return {LambertianBsdf{seen(surface.spectrum)}};
}

Bsdf resolve(const RoughDiffuse& surface, const Channels& seen) {
  return {RoughDiffuseBsdf{seen(surface.spectrum), surface.roughness}};
}

Bsdf resolve(const Coated& surface, const Channels& seen) {
  const double n = surface.refractive_index;
  CoatedBsdf coated{
      .albedo = seen(surface.spectrum), .refractive_index = n, .alpha = surface.alpha};
  coated.mirrored = ggx::reflected_share(
      surface.alpha, [n](double cosine) { return fresnel_reflectance(cosine, n, 0); });
  // By reciprocity, the diffuse transmittance from inside is that from outside divided by n^2.
  coated.thrown_back = 1 - (1 - coated.mirrored.mean()) / (n * n);
  return {coated};
}

Bsdf resolve(const Conductor& surface, const Channels& seen) {
  ConductorBsdf metal{.alpha = surface.alpha};
  metal.reflectance =
      CosineTable<glm::vec3>([&](double cosine) { return glm::vec3(seen(surface, cosine)); });
  metal.once = ggx::reflected_share(surface.alpha, [](double) { return 1.0; });
  const double once = metal.once.mean();
  const glm::dvec3 mean(metal.reflectance.mean());
  metal.shared_per_sr = mean * mean * once / (pi * (1 - once) * (1.0 - mean * (1 - once)));
  return {metal};
}

Bsdf resolve(const PlantLeaf& leaf, const Channels& seen) {
  PlantLeafBsdf result{seen(leaf.reflectance), seen(leaf.transmittance)};
  // Clipping each colour to the gamut separately may raise the sum above 1.
  const glm::dvec3 sum = glm::max(result.reflectance + result.transmittance, glm::dvec3(1));
  result.reflectance /= sum;
  result.transmittance /= sum;
  return {result};
}

Bsdf resolve(const RetroReflector&, const Channels&) { return {BlackBsdf{}}; }

Bsdf resolve(const Material& material, std::optional<double> wavelength_nm) {
  check_material(material);
  const Channels seen(material, wavelength_nm);
  return std::visit([&](const auto& kind) { return resolve(kind, seen); }, material.reflection);
}

}  // namespace

Bsdf bsdf_in_colour(const Material& material) { return resolve(material, std::nullopt); }

Bsdf bsdf_at(const Material& material, double wavelength_nm) {
  return resolve(material, wavelength_nm);
}

}  // namespace groundray
