#pragma once

// Private to this library: the directional albedo of a rough surface of white Lambertian facets
// whose light is scattered once, in Fujii's form of Oren and Nayar's model:
// f = A / pi (1 + roughness s / t), s = wo . wi - cos_o cos_i, t = max(cos_o, cos_i) or, if s <
// 0, 1.
// @see Portsmouth, Kutz and Hill, EON: a practical energy-preserving rough diffuse BRDF (JCGT
// 2025).
namespace groundray::oren_nayar {

/// Returns A.
double scale(double roughness) noexcept;

/// Returns the share of light that leaves, by the cosine of its incidence.
double share(double cosine, double roughness) noexcept;

/// Returns the mean of `share` over light from everywhere.
double mean_share(double roughness) noexcept;

/// Returns the albedo of facets that gives the whole surface an albedo, in light from everywhere
/// and with all light counted that is scattered more than once.
template <typename Value>
Value facet_albedo(const Value& albedo, double mean_share) noexcept {
  return albedo / (mean_share + albedo * (1 - mean_share));
}

}  // namespace groundray::oren_nayar
