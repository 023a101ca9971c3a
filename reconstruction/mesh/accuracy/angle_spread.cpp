#include "reconstruction/mesh/accuracy/angle_spread.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr double least_rad = 1e-7;  // smaller angles share one bin
constexpr double bins_each = 64;    // per doubling of the angle
constexpr std::size_t bin_count = 1601;

std::size_t bin_of(double angle_rad) {
  if (angle_rad < least_rad) return 0;
  const double bin = 1 + std::floor(bins_each * math::log2(angle_rad / least_rad));
  return std::min(static_cast<std::size_t>(bin), bin_count - 1);
}

double edge_rad(std::size_t bin) {
  if (bin == 0) return 0;
  return least_rad * math::exp2((static_cast<double>(bin) - 1) / bins_each);
}

}  // namespace

void AngleSpread::add(const glm::dvec3& a, const glm::dvec3& b, double area_m2) {
  ++samples_;
  if (!(glm::dot(a, a) > 0 && glm::dot(b, b) > 0)) {
    unknown_m2_ += area_m2;
    return;
  }
  const double angle_rad = angle_between(a, b);
  area_m2_ += area_m2;
  sum_ += area_m2 * angle_rad;
  square_ += area_m2 * angle_rad * angle_rad;
  largest_rad_ = std::max(largest_rad_, angle_rad);
  if (bins_m2_.empty()) bins_m2_.resize(bin_count);
  bins_m2_[bin_of(angle_rad)] += area_m2;
}

void AngleSpread::add(const AngleSpread& more) {
  area_m2_ += more.area_m2_;
  unknown_m2_ += more.unknown_m2_;
  sum_ += more.sum_;
  square_ += more.square_;
  largest_rad_ = std::max(largest_rad_, more.largest_rad_);
  samples_ += more.samples_;
  if (bins_m2_.size() < more.bins_m2_.size()) bins_m2_.resize(bin_count);
  for (std::size_t k = 0; k < more.bins_m2_.size(); ++k) bins_m2_[k] += more.bins_m2_[k];
}

double AngleSpread::mean_rad() const noexcept { return area_m2_ > 0 ? sum_ / area_m2_ : 0; }

double AngleSpread::rms_rad() const noexcept {
  return area_m2_ > 0 ? std::sqrt(square_ / area_m2_) : 0;
}

double AngleSpread::percentile_rad(double share) const {
  if (!(share >= 0 && share <= 1))
    throw Error("percentile of angles: share = {} must be within 0 to 1", share);
  double below_m2 = 0;
  for (std::size_t k = 0; k < bins_m2_.size(); ++k) {
    if (bins_m2_[k] > 0 && below_m2 + bins_m2_[k] >= share * area_m2_) {
      const double within = std::max(0.0, share * area_m2_ - below_m2) / bins_m2_[k];
      const double low = edge_rad(k), high = std::min(edge_rad(k + 1), largest_rad_);
      return std::min(low + within * (high - low), largest_rad_);
    }
    below_m2 += bins_m2_[k];
  }
  return largest_rad_;
}

double angle_between(const glm::dvec3& a, const glm::dvec3& b) noexcept {
  return math::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

}  // namespace groundray
