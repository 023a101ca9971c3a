#include "apps/golden/compare/scans/scan_doubts.h"

#include <fmt/format.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "apps/golden/compare/error_figures.h"

namespace groundray::golden {
namespace {

std::vector<double> ranges_of(const Scan& scan) {
  std::vector<double> ranges_m;
  ranges_m.reserve(scan.p_S.size());
  for (const glm::dvec3& p : scan.p_S) ranges_m.push_back(glm::length(p));
  return ranges_m;
}

glm::dvec3 median_point(const Scan& scan) {
  glm::dvec3 middle(0);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(scan.p_S.size());
    for (const glm::dvec3& p : scan.p_S) values.push_back(p[axis]);
    middle[axis] = quantile(std::move(values), 0.5);
  }
  return middle;
}

/// Rounds to thousandths for messages, and turns -0 into 0.
glm::dvec3 thousandths(const glm::dvec3& v) { return glm::round(v * 1e3) / 1e3 + 0.; }

bool is_near(double ratio, double of, double tolerance) {
  return ratio > of * (1 - tolerance) && ratio < of * (1 + tolerance);
}

/// Returns a hint on the unit that would reconcile the median ranges; empty if there is none.
std::string unit_doubt(const std::string& other, double ratio) {
  constexpr double feet_per_m = 1 / 0.3048;
  if (is_near(ratio, 1000, 0.5)) {
    return fmt::format("Is {} in millimetres? Then give its unit (--unit-m 0.001).", other);
  }
  if (is_near(ratio, 0.001, 0.5)) {
    return fmt::format(
        "Is {} in kilometres, or the reference in millimetres? Then give the unit "
        "(--unit-m 1000, --reference-unit-m 0.001).",
        other);
  }
  if (is_near(ratio, 100, 0.5)) {
    return fmt::format("Is {} in centimetres? Then give its unit (--unit-m 0.01).", other);
  }
  if (is_near(ratio, feet_per_m, 0.02)) {
    return fmt::format("Is {} in feet? Then give its unit (--unit-m 0.3048).", other);
  }
  if (ratio > 10 || ratio < 0.1) {
    return "Units or frames differ: give its unit (--unit-m) or the sensor's pose (--sensor-pose).";
  }
  return "";
}

}  // namespace

std::vector<std::string> doubts_about(const Scan& reference, const Scan& other) {
  std::vector<std::string> doubts;
  if (reference.p_S.empty() || other.p_S.empty()) return doubts;
  const double reference_m = quantile(ranges_of(reference), 0.5);
  const double other_m = quantile(ranges_of(other), 0.5);
  if (const std::string unit = unit_doubt(other.name, other_m / reference_m); !unit.empty()) {
    doubts.push_back(fmt::format(
        "WARNING: the median range of {} is {:.4g} m, that of the reference {:.4g} m. {}",
        other.name, other_m, reference_m, unit));
    return doubts;
  }
  const double offset_m = glm::distance(median_point(reference), median_point(other));
  const double extent_m = quantile(ranges_of(reference), 0.9);
  if (offset_m > extent_m) {
    doubts.push_back(
        fmt::format("WARNING: the median point of {} is {:.4g} m from the reference's, farther "
                    "than 90 % of the reference's ranges. Are the points in the world frame? Then "
                    "give the pose of the sensor (--sensor-pose).",
                    other.name, offset_m));
  }
  return doubts;
}

std::vector<std::string> doubts_about(const Pairs& pairs, const ScanErrors& errors,
                                      const std::optional<glm::dvec3>& turn_rad) {
  std::vector<std::string> doubts;
  if (errors.angle_rad.empty()) return doubts;
  const double angle_rad = quantile(errors.angle_rad, 0.5);
  if (pairs.rule == PairingRule::Direction) {
    if (angle_rad > pairs.tolerance / 20) {
      doubts.push_back(
          fmt::format("The scans have different beams: the median angle between pairs is {:.3g} "
                      "rad, and range errors include the relief of the surface between the beams.",
                      angle_rad));
    }
  } else if (angle_rad > pairs.spacing_rad / 2) {
    doubts.push_back(fmt::format(
        "WARNING: the median angle between pairs is {:.4g} rad, more than half of the spacing of "
        "the beams: the sensors are rotated or move differently, or number rings, times or pulses "
        "differently. To check, pair by direction (--pair-by direction).",
        angle_rad));
  }
  constexpr double least_rad = 1e-6;
  if (turn_rad && glm::length(*turn_rad) > angle_rad / 2 && angle_rad > least_rad) {
    const glm::dvec3 axis = thousandths(glm::normalize(*turn_rad));
    doubts.push_back(
        fmt::format("The directions agree best if the other is rotated back by {:.4g} rad about "
                    "({:g}, {:g}, {:g}).",
                    glm::length(*turn_rad), axis.x, axis.y, axis.z));
  }
  return doubts;
}

std::vector<std::string> doubts_about_ranges(const Scan& scan) {
  const auto* const ranges = scan.find(Quantity::Range);
  if (ranges == nullptr || ranges->empty()) return {};
  std::vector<double> ratios;
  for (std::size_t i = 0; i < ranges->size(); ++i) {
    ratios.push_back((*ranges)[i] / glm::length(scan.p_S[i]));
  }
  const double ratio = quantile(ratios, 0.5);
  constexpr double rounding = 1e-3;
  if (is_near(ratio, 1, rounding)) return {};
  return {
      fmt::format("The range column of {} is {:.6g} times the distances of its points at the "
                  "median; the points were used.",
                  scan.name, ratio)};
}

}  // namespace groundray::golden
