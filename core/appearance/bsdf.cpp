#include "core/appearance/bsdf.h"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <optional>
#include <string>

#include "core/appearance/microfacets.h"
#include "core/error.h"
#include "core/sobol.h"

namespace groundray {
namespace {

using std::numbers::pi;

// All functions below assume wo.z > 0.

glm::dvec3 sample_cosine(const glm::dvec2& u) noexcept {
  const double radius = std::sqrt(u.y);
  const double turn = 2 * pi * u.x;
  return {radius * std::cos(turn), radius * std::sin(turn), std::sqrt(1 - u.y)};
}

glm::dvec3 sample_hemisphere(const glm::dvec2& u) noexcept {
  const double radius = std::sqrt(u.y * (2 - u.y));
  const double turn = 2 * pi * u.x;
  return {radius * std::cos(turn), radius * std::sin(turn), 1 - u.y};
}

// Chooses the first option with probability `first` by u.x, then rescales u.x to be uniform again.
bool takes_first(double first, glm::dvec2& u) noexcept {
  const bool takes = u.x < first;
  u.x = std::clamp(takes ? u.x / first : (u.x - first) / (1 - first), 0.0, 1.0);
  return takes;
}

// Cosine of incidence on the microfacet that reflects one direction into the other.
double facet_cosine(const glm::dvec3& wo, const glm::dvec3& wi) noexcept {
  return glm::length(wo + wi) / 2;
}

glm::dvec3 eval(const LambertianBsdf& surface, const glm::dvec3&, const glm::dvec3& wi) noexcept {
  return wi.z > 0 ? surface.albedo / pi : glm::dvec3(0);
}

double pdf(const LambertianBsdf&, const glm::dvec3&, const glm::dvec3& wi) noexcept {
  return std::max(wi.z, 0.0) / pi;
}

glm::dvec3 direction(const LambertianBsdf&, const glm::dvec3&, const glm::dvec2& u) noexcept {
  return sample_cosine(u);
}

glm::dvec3 eval(const RoughDiffuseBsdf& surface, const glm::dvec3& wo,
                const glm::dvec3& wi) noexcept {
  if (!(wi.z > 0)) return glm::dvec3(0);
  const double roughness = surface.roughness;
  const double mean = oren_nayar::mean_share(roughness);
  const glm::dvec3 facets = oren_nayar::facet_albedo(surface.albedo, mean);
  const double s = wo.x * wi.x + wo.y * wi.y;
  const double s_over_t = s > 0 ? s / std::max(wo.z, wi.z) : s;
  const double once = oren_nayar::scale(roughness) * (1 + roughness * s_over_t);
  if (!(mean < 1)) return facets * (once / pi);
  const double often = (1 - oren_nayar::share(wo.z, roughness)) *
                       (1 - oren_nayar::share(wi.z, roughness)) / (1 - mean);
  return facets * (glm::dvec3(once) + surface.albedo * often) / pi;
}

// Probability of uniform sampling: the density of cosine sampling vanishes at grazing angles, where
// rough surfaces are brightest.
double hemisphere_chance(const RoughDiffuseBsdf& surface) noexcept { return surface.roughness / 2; }

double pdf(const RoughDiffuseBsdf& surface, const glm::dvec3&, const glm::dvec3& wi) noexcept {
  if (!(wi.z > 0)) return 0;
  return std::lerp(wi.z / pi, 1 / (2 * pi), hemisphere_chance(surface));
}

glm::dvec3 direction(const RoughDiffuseBsdf& surface, const glm::dvec3&, glm::dvec2 u) noexcept {
  return takes_first(hemisphere_chance(surface), u) ? sample_hemisphere(u) : sample_cosine(u);
}

glm::dvec3 eval(const CoatedBsdf& surface, const glm::dvec3& wo, const glm::dvec3& wi) noexcept {
  if (!(wi.z > 0)) return glm::dvec3(0);
  const double cosine = facet_cosine(wo, wi);
  const double mirrored = ggx::brdf_per_sr(wo, wi, surface.alpha) *
                          fresnel_reflectance(cosine, surface.refractive_index, 0);
  const double let_pass = double{1 - surface.mirrored(wo.z)} * double{1 - surface.mirrored(wi.z)};
  return glm::dvec3(mirrored) + surface.base_per_sr() * let_pass;
}

// Fraction of the reflected light that is specular.
double mirror_chance(const CoatedBsdf& surface, const glm::dvec3& wo) noexcept {
  const double mirrored = surface.mirrored(wo.z);
  const glm::dvec3 base = surface.base_per_sr() * (pi * (1 - mirrored));
  return mirrored / (mirrored + std::max({base.x, base.y, base.z}));
}

double mirror_chance(const ConductorBsdf& surface, const glm::dvec3& wo) noexcept {
  return surface.once(wo.z);
}

template <typename T>
concept Mirroring = std::same_as<T, CoatedBsdf> || std::same_as<T, ConductorBsdf>;

double pdf(const Mirroring auto& surface, const glm::dvec3& wo, const glm::dvec3& wi) noexcept {
  if (!(wi.z > 0)) return 0;
  return std::lerp(wi.z / pi, ggx::pdf_per_sr(wo, wi, surface.alpha), mirror_chance(surface, wo));
}

glm::dvec3 direction(const Mirroring auto& surface, const glm::dvec3& wo, glm::dvec2 u) noexcept {
  return takes_first(mirror_chance(surface, wo), u) ? ggx::sample(wo, surface.alpha, u)
                                                    : sample_cosine(u);
}

glm::dvec3 eval(const ConductorBsdf& surface, const glm::dvec3& wo, const glm::dvec3& wi) noexcept {
  if (!(wi.z > 0)) return glm::dvec3(0);
  const double cosine = facet_cosine(wo, wi);
  const double often = double{1 - surface.once(wo.z)} * double{1 - surface.once(wi.z)};
  return glm::dvec3(surface.reflectance(cosine)) * ggx::brdf_per_sr(wo, wi, surface.alpha) +
         surface.shared_per_sr * often;
}

glm::dvec3 eval(const PlantLeafBsdf& leaf, const glm::dvec3&, const glm::dvec3& wi) noexcept {
  return (wi.z > 0 ? leaf.reflectance : leaf.transmittance) / pi;
}

double transmission_chance(const PlantLeafBsdf& leaf) noexcept {
  const double through = leaf.transmittance.x + leaf.transmittance.y + leaf.transmittance.z;
  const double back = leaf.reflectance.x + leaf.reflectance.y + leaf.reflectance.z;
  return through + back > 0 ? through / (through + back) : 0;
}

double pdf(const PlantLeafBsdf& leaf, const glm::dvec3&, const glm::dvec3& wi) noexcept {
  const double through = transmission_chance(leaf);
  return std::abs(wi.z) * (wi.z > 0 ? 1 - through : through) / pi;
}

glm::dvec3 direction(const PlantLeafBsdf& leaf, const glm::dvec3&, glm::dvec2 u) noexcept {
  const bool through = takes_first(transmission_chance(leaf), u);
  const glm::dvec3 wi = sample_cosine(u);
  return through ? -wi : wi;
}

glm::dvec3 eval(const BlackBsdf&, const glm::dvec3&, const glm::dvec3&) noexcept {
  return glm::dvec3(0);
}

double pdf(const BlackBsdf&, const glm::dvec3&, const glm::dvec3&) noexcept { return 0; }

glm::dvec3 direction(const BlackBsdf&, const glm::dvec3& wo, const glm::dvec2&) noexcept {
  return wo;
}

// Flips directions if the surface is seen from below.
struct Side {
  explicit Side(const glm::dvec3& wo) noexcept : sign(wo.z < 0 ? -1 : 1) {}
  glm::dvec3 operator()(const glm::dvec3& w) const noexcept { return {w.x, w.y, sign * w.z}; }
  double sign;
};

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

glm::dvec3 CoatedBsdf::base_per_sr() const noexcept {
  const glm::dvec3 let_out = glm::dvec3(1) - albedo * thrown_back;
  return albedo / (pi * refractive_index * refractive_index * let_out);
}

glm::dvec3 Bsdf::eval(const glm::dvec3& wo, const glm::dvec3& wi) const noexcept {
  const Side side(wo);
  const auto f = [&](const auto& kind) { return groundray::eval(kind, side(wo), side(wi)); };
  return wo.z == 0 || wi.z == 0 ? glm::dvec3(0) : std::visit(f, surface);
}

double Bsdf::pdf_per_sr(const glm::dvec3& wo, const glm::dvec3& wi) const noexcept {
  const Side side(wo);
  const auto density = [&](const auto& kind) { return pdf(kind, side(wo), side(wi)); };
  return wo.z == 0 ? 0 : std::visit(density, surface);
}

BsdfSample Bsdf::sample(const glm::dvec3& wo, const glm::dvec2& u) const noexcept {
  if (wo.z == 0) return {};
  const Side side(wo);
  const auto choose = [&](const auto& kind) {
    const glm::dvec3 wi = direction(kind, side(wo), u);
    const double density = pdf(kind, side(wo), wi);
    const glm::dvec3 weight = density > 0
                                  ? groundray::eval(kind, side(wo), wi) * (std::abs(wi.z) / density)
                                  : glm::dvec3(0);
    return BsdfSample{side(wi), weight, density};
  };
  return std::visit(choose, surface);
}

glm::dvec3 Bsdf::albedo() const noexcept {
  if (const auto* matt = std::get_if<LambertianBsdf>(&surface)) return matt->albedo;
  if (const auto* rough = std::get_if<RoughDiffuseBsdf>(&surface)) return rough->albedo;
  if (const auto* leaf = std::get_if<PlantLeafBsdf>(&surface)) return leaf->reflectance;
  if (const auto* coated = std::get_if<CoatedBsdf>(&surface)) {
    const double mirrored = coated->mirrored.mean(), let_pass = 1 - mirrored;
    return mirrored + pi * let_pass * let_pass * coated->base_per_sr();
  }
  constexpr std::uint32_t count = 1 << 16;
  glm::dvec3 sum(0);
  for (std::uint32_t i = 0; i < count; ++i) {
    SobolPairs numbers(1, i);
    const glm::dvec2 u = numbers.next();
    // Uniform illumination arrives with a density proportional to the cosine.
    const double sine = std::sqrt(u.x), azimuth_rad = 2 * std::numbers::pi * u.y;
    const glm::dvec3 from(sine * std::cos(azimuth_rad), sine * std::sin(azimuth_rad),
                          std::sqrt(1 - u.x));
    sum += sample(from, numbers.next()).weight;
  }
  return sum / static_cast<double>(count);
}

Bsdf Bsdf::tinted(const glm::dvec3& factor) const noexcept {
  Bsdf result = *this;
  const auto tint = [&](glm::dvec3& albedo) { albedo = glm::min(albedo * factor, glm::dvec3(1)); };
  if (auto* matt = std::get_if<LambertianBsdf>(&result.surface)) tint(matt->albedo);
  if (auto* rough = std::get_if<RoughDiffuseBsdf>(&result.surface)) tint(rough->albedo);
  if (auto* coated = std::get_if<CoatedBsdf>(&result.surface)) tint(coated->albedo);
  if (auto* leaf = std::get_if<PlantLeafBsdf>(&result.surface)) {
    const glm::dvec3 all = leaf->reflectance + leaf->transmittance;
    const glm::dvec3 most = 1.0 / glm::max(all, glm::dvec3(1e-300));
    leaf->reflectance *= glm::min(factor, most);
    leaf->transmittance *= glm::min(factor, most);
  }
  return result;
}

Bsdf bsdf_in_colour(const Material& material) { return resolve(material, std::nullopt); }

Bsdf bsdf_at(const Material& material, double wavelength_nm) {
  return resolve(material, wavelength_nm);
}

double fresnel_reflectance(double cosine, double n, double k) noexcept {
  const double c = std::clamp(cosine, 0.0, 1.0);
  const double c2 = c * c;
  const double s2 = 1 - c2;
  const double difference = (n - 1) * (n + 1) - k * k + c2;
  const double modulus = std::sqrt(difference * difference + 4 * n * n * k * k);
  // (modulus + difference) / 2, without cancellation for strong absorbers
  double real2 = 0;
  if (difference > 0) {
    real2 = (modulus + difference) / 2;
  } else if (modulus > difference) {
    real2 = 2 * n * n * k * k / (modulus - difference);
  }
  const double doubled = 2 * c * std::sqrt(real2);
  const double sum = modulus + c2;
  if (!(sum > 0)) return 0;  // grazing incidence with n = 1: there is no interface
  const double across = (sum - doubled) / (sum + doubled);
  const double within =
      (c2 * modulus + s2 * s2 - doubled * s2) / (c2 * modulus + s2 * s2 + doubled * s2);
  return across * (1 + within) / 2;
}

}  // namespace groundray
