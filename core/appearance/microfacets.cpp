#include "core/appearance/microfacets.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace groundray::ggx {
namespace {

using std::numbers::pi;

// cos (1 + 2 Lambda), with Smith's Lambda, without a division by the cosine.
double masked_cosine(double cosine, double alpha) noexcept {
  return std::sqrt(cosine * cosine + alpha * alpha * (1 - cosine * cosine));
}

}  // namespace

double normals_per_sr(const glm::dvec3& h, double alpha) noexcept {
  const double alpha2 = alpha * alpha;
  const double spread = alpha2 * h.z * h.z + (h.x * h.x + h.y * h.y);
  return alpha2 / (pi * spread * spread);
}

double brdf_per_sr(const glm::dvec3& wo, const glm::dvec3& wi, double alpha) noexcept {
  const double normals = normals_per_sr(glm::normalize(wo + wi), alpha);
  return normals / (2 * (wi.z * masked_cosine(wo.z, alpha) + wo.z * masked_cosine(wi.z, alpha)));
}

double retro_brdf_cos(double cosine, double alpha) noexcept {
  const double alpha2 = alpha * alpha;
  const double cos2 = cosine * cosine;
  const double spread = alpha2 * cos2 + (1 - cos2);
  return alpha2 / (4 * pi * spread * spread * masked_cosine(cosine, alpha));
}

glm::dvec3 sample(const glm::dvec3& wo, double alpha, const glm::dvec2& u) noexcept {
  const glm::dvec3 stretched = glm::normalize(glm::dvec3(alpha * wo.x, alpha * wo.y, wo.z));
  const double turn = 2 * pi * u.x;
  const double z = (1 - u.y) * (1 + stretched.z) - stretched.z;
  const double sine = std::sqrt(std::max(1 - z * z, 0.0));
  const glm::dvec3 normal = glm::dvec3(sine * std::cos(turn), sine * std::sin(turn), z) + stretched;
  const glm::dvec3 h =
      glm::normalize(glm::dvec3(alpha * normal.x, alpha * normal.y, std::max(normal.z, 1e-300)));
  return 2 * glm::dot(wo, h) * h - wo;
}

double pdf_per_sr(const glm::dvec3& wo, const glm::dvec3& wi, double alpha) noexcept {
  const double normals = normals_per_sr(glm::normalize(wo + wi), alpha);
  return normals / (2 * (wo.z + masked_cosine(wo.z, alpha)));
}

double sample_weight(const glm::dvec3& wo, const glm::dvec3& wi, double alpha) noexcept {
  if (!(wi.z > 0)) return 0;
  const double masked_o = masked_cosine(wo.z, alpha);
  return wi.z * (wo.z + masked_o) / (wi.z * masked_o + wo.z * masked_cosine(wi.z, alpha));
}

}  // namespace groundray::ggx

namespace groundray::oren_nayar {
namespace {

using std::numbers::pi;

}  // namespace

double scale(double roughness) noexcept { return 1 / (1 + (0.5 - 2 / (3 * pi)) * roughness); }

double share(double cosine, double roughness) noexcept {
  const double c = std::clamp(cosine, 0.0, 1.0);
  const double s = std::sqrt(1 - c * c);
  // tan(theta) (1 - s^3) of the paper, rewritten without the division by the cosine
  const double steep = s * c * (1 + s + s * s) / (1 + s);
  const double g = s * (std::acos(c) - s * c) + 2.0 / 3 * (steep - s);
  return scale(roughness) * (1 + roughness * g / pi);
}

double mean_share(double roughness) noexcept {
  return scale(roughness) * (1 + roughness * (2.0 / 3 - 28 / (15 * pi)));
}

}  // namespace groundray::oren_nayar
