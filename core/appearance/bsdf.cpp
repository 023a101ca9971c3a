#include "core/appearance/bsdf.h"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <numbers>
#include <utility>

#include "core/appearance/microfacets.h"
#include "core/elementary.h"
#include "core/math.h"
#include "core/sobol.h"

namespace groundray {
namespace {

using std::numbers::pi;

// The functions below assume wo.z > 0. A surface's colours are passed separately, because textures
// tint them.

template <typename Real>
Real fresnel(const Real& cosine, double n, double k) noexcept {
  using std::max;
  using std::min;
  using std::sqrt;
  const Real c = min(max(cosine, Real(0.0)), Real(1.0));
  const Real c2 = c * c;
  const Real s2 = 1.0 - c2;
  const Real difference = (n - 1) * (n + 1) - k * k + c2;
  const Real modulus = sqrt(difference * difference + 4 * n * n * k * k);
  // (modulus + difference) / 2, without cancellation for strong absorbers
  const Real absorbed = modulus - difference;
  const Real small = select(absorbed > 0.0, 2 * n * n * k * k / absorbed, Real(0.0));
  const Real real2 = select(difference > 0.0, (modulus + difference) / 2.0, small);
  const Real doubled = 2.0 * c * sqrt(real2);
  const Real sum = modulus + c2;
  const Real across = (sum - doubled) / (sum + doubled);
  const Real within =
      (c2 * modulus + s2 * s2 - doubled * s2) / (c2 * modulus + s2 * s2 + doubled * s2);
  // At grazing incidence with n = 1 there is no interface.
  return select(sum > 0.0, across * (1.0 + within) / 2.0, Real(0.0));
}

template <typename Real>
Vec3<Real> sample_cosine(const Vec2<Real>& u) noexcept {
  using std::sqrt;
  const Vec2<Real> across = on_circle(u.x) * sqrt(u.y);
  return {across.x, across.y, sqrt(1.0 - u.y)};
}

template <typename Real>
Vec3<Real> sample_hemisphere(const Vec2<Real>& u) noexcept {
  using std::sqrt;
  const Vec2<Real> across = on_circle(u.x) * sqrt(u.y * (2.0 - u.y));
  return {across.x, across.y, 1.0 - u.y};
}

// Chooses the first option with probability `first` by u.x, then rescales u.x to be uniform again.
template <typename Real>
auto takes_first(const Real& first, Vec2<Real>& u) noexcept {
  using std::max;
  using std::min;
  const auto takes = u.x < first;
  const Real rescaled = select(takes, u.x / first, (u.x - first) / (1.0 - first));
  u.x = min(max(rescaled, Real(0.0)), Real(1.0));
  return takes;
}

// Cosine of incidence on the microfacet that reflects one direction into the other.
template <typename Real>
Real facet_cosine(const Vec3<Real>& wo, const Vec3<Real>& wi) noexcept {
  using std::sqrt;
  const Vec3<Real> both = wo + wi;
  return sqrt(dot_of(both, both)) / 2.0;
}

template <typename Real>
Real mix_of(const Real& a, const Real& b, const Real& share) noexcept {
  return a * (1.0 - share) + b * share;
}

template <typename Real>
Vec3<Real> least_of(const Vec3<Real>& a, const Vec3<Real>& b) noexcept {
  using std::min;
  return {min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)};
}

template <typename T>
concept Diffuse = std::same_as<T, LambertianBsdf> || std::same_as<T, RoughDiffuseBsdf> ||
                  std::same_as<T, CoatedBsdf>;
template <typename T>
concept Mirroring = std::same_as<T, CoatedBsdf> || std::same_as<T, ConductorBsdf>;

struct NoColours {};
template <typename Real>
struct LeafColours {
  Vec3<Real> reflectance, transmittance;
};

// Returns the colours of a surface, multiplied by those of a texture.
template <typename Real>
Vec3<Real> tinted(const Diffuse auto& surface, const Vec3<Real>& tint) noexcept {
  return least_of(Vec3<Real>(surface.albedo) * tint, Vec3<Real>(Real(1.0)));
}

template <typename Real>
LeafColours<Real> tinted(const PlantLeafBsdf& leaf, const Vec3<Real>& tint) noexcept {
  const glm::dvec3 most = 1.0 / glm::max(leaf.reflectance + leaf.transmittance, glm::dvec3(1e-300));
  const Vec3<Real> factor = least_of(tint, Vec3<Real>(most));
  return {Vec3<Real>(leaf.reflectance) * factor, Vec3<Real>(leaf.transmittance) * factor};
}

template <typename Real>
NoColours tinted(const ConductorBsdf&, const Vec3<Real>&) noexcept {
  return {};
}
template <typename Real>
NoColours tinted(const BlackBsdf&, const Vec3<Real>&) noexcept {
  return {};
}

template <typename Real>
Vec3<Real> black() noexcept {
  return Vec3<Real>(Real(0.0));
}

template <typename Real>
Vec3<Real> eval(const LambertianBsdf&, const Vec3<Real>& albedo, const Vec3<Real>&,
                const Vec3<Real>& wi) noexcept {
  return select(wi.z > 0.0, albedo / Real(pi), black<Real>());
}

template <typename Real>
Real pdf(const LambertianBsdf&, const Vec3<Real>&, const Vec3<Real>&,
         const Vec3<Real>& wi) noexcept {
  using std::max;
  return max(wi.z, Real(0.0)) / pi;
}

template <typename Real>
Vec3<Real> direction(const LambertianBsdf&, const Vec3<Real>&, const Vec3<Real>&,
                     const Vec2<Real>& u) noexcept {
  return sample_cosine(u);
}

template <typename Real>
Vec3<Real> eval(const RoughDiffuseBsdf& surface, const Vec3<Real>& albedo, const Vec3<Real>& wo,
                const Vec3<Real>& wi) noexcept {
  using std::max;
  const double roughness = surface.roughness;
  const double mean = oren_nayar::mean_share(roughness);
  const Vec3<Real> facets = oren_nayar::facet_albedo(albedo, mean);
  const Real s = wo.x * wi.x + wo.y * wi.y;
  const Real s_over_t = select(s > 0.0, s / max(wo.z, wi.z), s);
  const Real once = oren_nayar::scale(roughness) * (1.0 + roughness * s_over_t);
  const Real lost =
      (1.0 - oren_nayar::share(wo.z, roughness)) * (1.0 - oren_nayar::share(wi.z, roughness));
  const Real often = mean < 1 ? lost / (1 - mean) : Real(0.0);
  const Vec3<Real> f = facets * (Vec3<Real>(once) + albedo * often) / Real(pi);
  return select(wi.z > 0.0, f, black<Real>());
}

// Probability of uniform sampling: the density of cosine sampling vanishes at grazing angles, where
// rough surfaces are brightest.
double hemisphere_chance(const RoughDiffuseBsdf& surface) noexcept { return surface.roughness / 2; }

template <typename Real>
Real pdf(const RoughDiffuseBsdf& surface, const Vec3<Real>&, const Vec3<Real>&,
         const Vec3<Real>& wi) noexcept {
  const Real density = mix_of(wi.z / pi, Real(1 / (2 * pi)), Real(hemisphere_chance(surface)));
  return select(wi.z > 0.0, density, Real(0.0));
}

template <typename Real>
Vec3<Real> direction(const RoughDiffuseBsdf& surface, const Vec3<Real>&, const Vec3<Real>&,
                     Vec2<Real> u) noexcept {
  const auto is_uniform = takes_first(Real(hemisphere_chance(surface)), u);
  return select(is_uniform, sample_hemisphere(u), sample_cosine(u));
}

// Returns the BRDF of a coat's base, 1/sr: see CoatedBsdf::base_per_sr.
template <typename Real>
Vec3<Real> base_of(const CoatedBsdf& coat, const Vec3<Real>& albedo) noexcept {
  const Vec3<Real> let_out = Vec3<Real>(Real(1.0)) - albedo * Real(coat.thrown_back);
  return albedo / (let_out * Real(pi * coat.refractive_index * coat.refractive_index));
}

template <typename Real>
Vec3<Real> eval(const CoatedBsdf& surface, const Vec3<Real>& albedo, const Vec3<Real>& wo,
                const Vec3<Real>& wi) noexcept {
  const Real mirrored = ggx::brdf_per_sr(wo, wi, surface.alpha) *
                        fresnel(facet_cosine(wo, wi), surface.refractive_index, 0);
  const Real let_pass = (1.0 - surface.mirrored(wo.z)) * (1.0 - surface.mirrored(wi.z));
  const Vec3<Real> f = Vec3<Real>(mirrored) + base_of(surface, albedo) * let_pass;
  return select(wi.z > 0.0, f, black<Real>());
}

// Fraction of the reflected light that is specular.
template <typename Real>
Real mirror_chance(const CoatedBsdf& surface, const Vec3<Real>& albedo,
                   const Vec3<Real>& wo) noexcept {
  const Real mirrored = surface.mirrored(wo.z);
  return mirrored / (mirrored + largest_of(base_of(surface, albedo)) * (pi * (1.0 - mirrored)));
}

template <typename Real>
Real mirror_chance(const ConductorBsdf& surface, NoColours, const Vec3<Real>& wo) noexcept {
  return surface.once(wo.z);
}

template <typename Real>
Real pdf(const Mirroring auto& surface, const auto& colours, const Vec3<Real>& wo,
         const Vec3<Real>& wi) noexcept {
  const Real density = mix_of(wi.z / pi, ggx::pdf_per_sr(wo, wi, surface.alpha),
                              mirror_chance(surface, colours, wo));
  return select(wi.z > 0.0, density, Real(0.0));
}

template <typename Real>
Vec3<Real> direction(const Mirroring auto& surface, const auto& colours, const Vec3<Real>& wo,
                     Vec2<Real> u) noexcept {
  const auto is_mirrored = takes_first(mirror_chance(surface, colours, wo), u);
  return select(is_mirrored, ggx::sample(wo, surface.alpha, u), sample_cosine(u));
}

template <typename Real>
Vec3<Real> eval(const ConductorBsdf& surface, NoColours, const Vec3<Real>& wo,
                const Vec3<Real>& wi) noexcept {
  const Real often = (1.0 - surface.once(wo.z)) * (1.0 - surface.once(wi.z));
  const Vec3<Real> once = Vec3<Real>(surface.reflectance(facet_cosine(wo, wi))) *
                          ggx::brdf_per_sr(wo, wi, surface.alpha);
  const Vec3<Real> f = once + Vec3<Real>(surface.shared_per_sr) * often;
  return select(wi.z > 0.0, f, black<Real>());
}

template <typename Real>
Vec3<Real> eval(const PlantLeafBsdf&, const LeafColours<Real>& leaf, const Vec3<Real>&,
                const Vec3<Real>& wi) noexcept {
  return select(wi.z > 0.0, leaf.reflectance, leaf.transmittance) / Real(pi);
}

template <typename Real>
Real transmission_chance(const LeafColours<Real>& leaf) noexcept {
  const Real through = leaf.transmittance.x + leaf.transmittance.y + leaf.transmittance.z;
  const Real back = leaf.reflectance.x + leaf.reflectance.y + leaf.reflectance.z;
  return select(through + back > 0.0, through / (through + back), Real(0.0));
}

template <typename Real>
Real pdf(const PlantLeafBsdf&, const LeafColours<Real>& leaf, const Vec3<Real>&,
         const Vec3<Real>& wi) noexcept {
  using std::abs;
  const Real through = transmission_chance(leaf);
  return abs(wi.z) * select(wi.z > 0.0, 1.0 - through, through) / pi;
}

template <typename Real>
Vec3<Real> direction(const PlantLeafBsdf&, const LeafColours<Real>& leaf, const Vec3<Real>&,
                     Vec2<Real> u) noexcept {
  const auto through = takes_first(transmission_chance(leaf), u);
  const Vec3<Real> wi = sample_cosine(u);
  return select(through, -wi, wi);
}

template <typename Real>
Vec3<Real> eval(const BlackBsdf&, NoColours, const Vec3<Real>&, const Vec3<Real>&) noexcept {
  return black<Real>();
}

template <typename Real>
Real pdf(const BlackBsdf&, NoColours, const Vec3<Real>&, const Vec3<Real>&) noexcept {
  return Real(0.0);
}

template <typename Real>
Vec3<Real> direction(const BlackBsdf&, NoColours, const Vec3<Real>& wo,
                     const Vec2<Real>&) noexcept {
  return wo;
}

// Returns a direction as if a surface seen from below were seen from above.
template <typename Real>
Vec3<Real> turned(const Vec3<Real>& wo, const Vec3<Real>& w) noexcept {
  return {w.x, w.y, select(wo.z < 0.0, -w.z, w.z)};
}

// The functions of Bsdf, for directions on either side.

template <typename Real>
Vec3<Real> eval_of(const Bsdf& bsdf, const Vec3<Real>& wo, const Vec3<Real>& wi,
                   const Vec3<Real>& tint) noexcept {
  return std::visit(
      [&](const auto& kind) {
        const auto colours = tinted(kind, tint);
        const Vec3<Real> f = eval(kind, colours, turned(wo, wo), turned(wo, wi));
        return select(wo.z == 0.0 || wi.z == 0.0, black<Real>(), f);
      },
      bsdf.surface);
}

template <typename Real>
Real pdf_of(const Bsdf& bsdf, const Vec3<Real>& wo, const Vec3<Real>& wi,
            const Vec3<Real>& tint) noexcept {
  return std::visit(
      [&](const auto& kind) {
        const Real density = pdf(kind, tinted(kind, tint), turned(wo, wo), turned(wo, wi));
        return select(wo.z == 0.0, Real(0.0), density);
      },
      bsdf.surface);
}

template <typename Real>
BsdfSampleOf<Real> sample_of(const Bsdf& bsdf, const Vec3<Real>& wo, const Vec2<Real>& u,
                             const Vec3<Real>& tint) noexcept {
  return std::visit(
      [&](const auto& kind) -> BsdfSampleOf<Real> {
        using std::abs;
        const auto colours = tinted(kind, tint);
        const Vec3<Real> from = turned(wo, wo);
        const Vec3<Real> wi = direction(kind, colours, from, u);
        const Real density = select(wo.z == 0.0, Real(0.0), pdf(kind, colours, from, wi));
        const Vec3<Real> weight = eval(kind, colours, from, wi) * (abs(wi.z) / density);
        return {turned(wo, wi), select(density > 0.0, weight, black<Real>()), density};
      },
      bsdf.surface);
}

}  // namespace

double fresnel_reflectance(double cosine, double n, double k) noexcept {
  return fresnel(cosine, n, k);
}

glm::dvec3 CoatedBsdf::base_per_sr(const glm::dvec3& of_base) const noexcept {
  return base_of(*this, of_base);
}

glm::dvec3 Bsdf::eval(const glm::dvec3& wo, const glm::dvec3& wi,
                      const glm::dvec3& tint) const noexcept {
  return eval_of(*this, wo, wi, tint);
}
Vec3<Pack> Bsdf::eval(const Vec3<Pack>& wo, const Vec3<Pack>& wi,
                      const Vec3<Pack>& tint) const noexcept {
  return eval_of(*this, wo, wi, tint);
}

double Bsdf::pdf_per_sr(const glm::dvec3& wo, const glm::dvec3& wi,
                        const glm::dvec3& tint) const noexcept {
  return pdf_of(*this, wo, wi, tint);
}
Pack Bsdf::pdf_per_sr(const Vec3<Pack>& wo, const Vec3<Pack>& wi,
                      const Vec3<Pack>& tint) const noexcept {
  return pdf_of(*this, wo, wi, tint);
}

BsdfSample Bsdf::sample(const glm::dvec3& wo, const glm::dvec2& u,
                        const glm::dvec3& tint) const noexcept {
  return sample_of(*this, wo, u, tint);
}
BsdfSampleOf<Pack> Bsdf::sample(const Vec3<Pack>& wo, const Vec2<Pack>& u,
                                const Vec3<Pack>& tint) const noexcept {
  return sample_of(*this, wo, u, tint);
}

glm::dvec3 Bsdf::albedo(const glm::dvec3& tint) const noexcept {
  if (const auto* matt = std::get_if<LambertianBsdf>(&surface)) return tinted(*matt, tint);
  if (const auto* rough = std::get_if<RoughDiffuseBsdf>(&surface)) return tinted(*rough, tint);
  if (const auto* leaf = std::get_if<PlantLeafBsdf>(&surface))
    return tinted(*leaf, tint).reflectance;
  if (const auto* coated = std::get_if<CoatedBsdf>(&surface)) {
    const double mirrored = coated->mirrored.mean(), let_pass = 1 - mirrored;
    return mirrored + pi * let_pass * let_pass * coated->base_per_sr(tinted(*coated, tint));
  }
  constexpr std::uint32_t count = 1 << 16;
  glm::dvec3 sum(0);
  for (std::uint32_t i = 0; i < count; ++i) {
    SobolPairs numbers(1, i);
    const glm::dvec2 u = numbers.next();
    // Uniform illumination arrives with a density proportional to the cosine.
    const double sine = std::sqrt(u.x), azimuth_rad = 2 * std::numbers::pi * u.y;
    const glm::dvec3 from(sine * math::cos(azimuth_rad), sine * math::sin(azimuth_rad),
                          std::sqrt(1 - u.x));
    sum += sample(from, numbers.next()).weight;
  }
  return sum / static_cast<double>(count);
}

}  // namespace groundray
