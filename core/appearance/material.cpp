#include "core/appearance/material.h"

#include <cmath>
#include <numbers>
#include <string_view>

#include "core/appearance/bsdf.h"
#include "core/appearance/microfacets.h"
#include "core/error.h"

namespace groundray {
namespace {

using std::numbers::pi;

void check_order(const Spectrum& spectrum, std::string_view field, Violations& broken) {
  broken.unless(!spectrum.empty(), "{}: there must be at least one sample", field);
  for (std::size_t i = 0; i < spectrum.size(); ++i) {
    const double wavelength_nm = spectrum[i].wavelength_nm;
    broken.unless(wavelength_nm > 0 && std::isfinite(wavelength_nm),
                  "{}[{}].wavelength_nm = {} must be positive and finite", field, i, wavelength_nm);
    broken.unless(
        i == 0 || spectrum[i - 1].wavelength_nm < wavelength_nm,
        "{}[{}].wavelength_nm = {} must be greater than the previous one: sort the samples", field,
        i, wavelength_nm);
  }
}

void check_shares(const Spectrum& spectrum, std::string_view field, Violations& broken) {
  check_order(spectrum, field, broken);
  for (std::size_t i = 0; i < spectrum.size(); ++i) {
    const double value = spectrum[i].value;
    broken.unless(value >= 0 && value <= 1,
                  "{}[{}].value = {} must be in [0, 1]: is it in percent?", field, i, value);
  }
}

void check_alpha(double alpha, Violations& broken) {
  broken.unless(alpha >= 0.01 && alpha <= 1, "alpha = {} must be in [0.01, 1]", alpha);
}

void check_reflection(const Lambertian& surface, Violations& broken) {
  check_shares(surface.spectrum, "spectrum", broken);
}

void check_reflection(const RoughDiffuse& surface, Violations& broken) {
  check_shares(surface.spectrum, "spectrum", broken);
  broken.unless(surface.roughness >= 0 && surface.roughness <= 1,
                "roughness = {} must be in [0, 1]: it is not an angle", surface.roughness);
}

void check_reflection(const Coated& surface, Violations& broken) {
  check_shares(surface.spectrum, "spectrum", broken);
  broken.unless(surface.refractive_index > 1 && surface.refractive_index <= 4,
                "refractive_index = {} must be in (1, 4]", surface.refractive_index);
  check_alpha(surface.alpha, broken);
}

void check_reflection(const Conductor& surface, Violations& broken) {
  check_order(surface.refractive_index, "refractive_index", broken);
  for (const auto& [wavelength_nm, n] : surface.refractive_index) {
    broken.unless(n > 0 && std::isfinite(n), "refractive_index at {} nm = {} must be positive",
                  wavelength_nm, n);
  }
  check_order(surface.extinction_coefficient, "extinction_coefficient", broken);
  for (const auto& [wavelength_nm, k] : surface.extinction_coefficient) {
    broken.unless(k >= 0 && std::isfinite(k),
                  "extinction_coefficient at {} nm = {} must not be negative", wavelength_nm, k);
  }
  check_alpha(surface.alpha, broken);
}

// Both spectra are piecewise linear, so their sum is greatest at a sample of one of them.
void check_reflection(const PlantLeaf& leaf, Violations& broken) {
  check_shares(leaf.reflectance, "reflectance", broken);
  check_shares(leaf.transmittance, "transmittance", broken);
  for (const Spectrum* spectrum : {&leaf.reflectance, &leaf.transmittance}) {
    for (const SpectrumSample& sample : *spectrum) {
      const double sum = value_at(leaf.reflectance, sample.wavelength_nm).value_or(0) +
                         value_at(leaf.transmittance, sample.wavelength_nm).value_or(0);
      broken.unless(
          !(sum > 1),
          "reflectance and transmittance at {} nm add up to {}; their sum must be at most 1",
          sample.wavelength_nm, sum);
    }
  }
}

void check_reflection(const RetroReflector& surface, Violations& broken) {
  const double coefficient = surface.coefficient_cd_lx_m2;
  broken.unless(coefficient > 0 && std::isfinite(coefficient),
                "coefficient_cd_lx_m2 = {} must be positive and finite", coefficient);
}

// Cosine-weighted mean of a reflectance or directional albedo over the hemisphere.
template <typename Share>
double mean_of(const Share& share) {
  constexpr int steps = 64;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double cosine = (i + 0.5) / steps;
    sum += 2 * cosine * share(cosine) / steps;
  }
  return sum;
}

RetroBrdf retro(const LambertianBsdf& surface) {
  return {.diffuse_per_sr = surface.albedo.x / pi, .albedo = surface.albedo.x};
}

RetroBrdf retro(const RoughDiffuseBsdf& surface) {
  const double roughness = surface.roughness;
  const double mean = oren_nayar::mean_share(roughness);
  const double facets = oren_nayar::facet_albedo(surface.albedo.x, mean);
  const double once = facets * oren_nayar::scale(roughness) / pi;
  if (!(mean < 1)) return {.diffuse_per_sr = once, .albedo = surface.albedo.x};
  RoughRetro rough{.grazing_per_sr = once * roughness,
                   .shared_per_sr = facets * surface.albedo.x / (pi * (1 - mean))};
  rough.share = CosineTable<float>([roughness](double cosine) {
    return static_cast<float>(oren_nayar::share(cosine, roughness));
  });
  return {.diffuse_per_sr = once, .rough = rough, .albedo = surface.albedo.x};
}

RetroBrdf retro(const CoatedBsdf& surface) {
  const double mirrored = mean_of([&](double cosine) { return double{surface.mirrored(cosine)}; });
  return {.rough = RoughRetro{.mirror = fresnel_reflectance(1, surface.refractive_index, 0),
                              .alpha = surface.alpha,
                              .shared_per_sr = surface.base_per_sr(surface.albedo).x,
                              .share = surface.mirrored},
          .albedo = mirrored +
                    pi * surface.base_per_sr(surface.albedo).x * (1 - mirrored) * (1 - mirrored)};
}

RetroBrdf retro(const ConductorBsdf& surface) {
  const double once = mean_of([&](double cosine) { return double{surface.once(cosine)}; });
  const double facet =
      mean_of([&](double cosine) { return double{surface.reflectance(cosine).x}; });
  return {.rough = RoughRetro{.mirror = double{surface.reflectance(1).x},
                              .alpha = surface.alpha,
                              .shared_per_sr = surface.shared_per_sr.x,
                              .share = surface.once},
          .albedo = once * facet + pi * surface.shared_per_sr.x * (1 - once) * (1 - once),
          .takes_tint = false};
}

RetroBrdf retro(const PlantLeafBsdf& leaf) {
  return {.diffuse_per_sr = leaf.reflectance.x / pi, .albedo = leaf.reflectance.x};
}

RetroBrdf retro(const BlackBsdf&) { return {}; }

}  // namespace

void check_material(const Material& material) {
  Violations broken("Material '" + material.name + "'");
  std::visit([&](const auto& surface) { check_reflection(surface, broken); }, material.reflection);
  for (glm::length_t k = 0; k < 3; ++k) {
    broken.unless(material.emitted[k] >= 0 && std::isfinite(material.emitted[k]),
                  "emitted[{}] = {} must be finite and >= 0", k, material.emitted[k]);
  }
  broken.throw_if_any();
}

RetroBrdf retro_brdf(const Material& material, double wavelength_nm) {
  const Bsdf bsdf = bsdf_at(material, wavelength_nm);
  if (const auto* sheet = std::get_if<RetroReflector>(&material.reflection))
    return {.retro_per_sr = sheet->coefficient_cd_lx_m2, .takes_tint = false};
  return std::visit([](const auto& surface) { return retro(surface); }, bsdf.surface);
}

namespace {

// All terms except specular reflection.
double matt_brdf_cos(const RoughRetro& rough, double cos_incidence) noexcept {
  const double let_pass = 1 - double{rough.share(cos_incidence)};
  return rough.grazing_per_sr * (1 - cos_incidence * cos_incidence) +
         rough.shared_per_sr * let_pass * let_pass * cos_incidence;
}

double mirror_brdf_cos(const RoughRetro& rough, double cos_incidence) noexcept {
  return rough.mirror > 0 ? rough.mirror * ggx::retro_brdf_cos(cos_incidence, rough.alpha) : 0;
}

// Brightness, limited so that no more light is reflected than arrives.
double possible_brightness(const RetroBrdf& brdf, double brightness) noexcept {
  if (!brdf.takes_tint) return 1;
  return brdf.albedo * brightness > 1 ? 1 / brdf.albedo : brightness;
}

}  // namespace

double rough_retro_brdf_cos(const RoughRetro& rough, double cos_incidence) noexcept {
  return matt_brdf_cos(rough, cos_incidence) + mirror_brdf_cos(rough, cos_incidence);
}

double tinted_retro_brdf_cos(const RetroBrdf& brdf, double cos_incidence,
                             double brightness) noexcept {
  const double factor = possible_brightness(brdf, brightness);
  const double matt = factor * brdf.diffuse_per_sr * cos_incidence + brdf.retro_per_sr;
  if (!brdf.rough) return matt;
  return matt + factor * matt_brdf_cos(*brdf.rough, cos_incidence) +
         mirror_brdf_cos(*brdf.rough, cos_incidence);
}

double tinted_albedo(const RetroBrdf& brdf, double brightness) noexcept {
  return possible_brightness(brdf, brightness) * brdf.albedo;
}

}  // namespace groundray
