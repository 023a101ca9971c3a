#include "apps/golden/compare/scans/scan_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <map>
#include <numbers>
#include <numeric>

#include "apps/golden/compare/error_figures.h"
#include "apps/golden/compare/scans/pulses.h"
#include "core/math.h"

namespace groundray::golden {
namespace {

/// Range errors and counts of the returns of one class.
struct Class {
  std::vector<double> errors_m;
  std::size_t missing = 0, extra = 0;

  std::size_t references() const { return errors_m.size() + missing; }
};

using Classes = std::map<int, Class>;

std::string share_of(std::size_t part, std::size_t whole) {
  if (whole == 0) return "";
  return fmt::format("{:.2f} %", 100 * static_cast<double>(part) / static_cast<double>(whole));
}

const std::vector<std::string> class_columns{"returns", "paired",    "mean error, m",
                                             "RMS, m",  "median, m", "missing"};

std::vector<std::string> cells_of(std::string name, const Class& members) {
  const ErrorFigures figures = figures_of(members.errors_m);
  const auto number = [&](double value) {
    return figures.count == 0 ? std::string() : fmt::format("{:.4g}", value);
  };
  return {std::move(name),
          std::to_string(members.references()),
          std::to_string(figures.count),
          number(figures.mean),
          number(figures.rms),
          number(figures.median),
          share_of(members.missing, members.references())};
}

/// Groups the reference's returns, paired and missing, by `class_of(return)`.
template <typename ClassOf>
Classes classes_by(const Pairs& pairs, const ScanErrors& errors, const ClassOf& class_of) {
  Classes classes;
  for (std::size_t k = 0; k < pairs.returns.size(); ++k) {
    classes[class_of(pairs.returns[k].first)].errors_m.push_back(errors.range_m[k]);
  }
  for (const std::uint32_t i : pairs.missing) ++classes[class_of(i)].missing;
  return classes;
}

Table table_of(std::string title, const std::string& what) {
  Table table{.title = std::move(title), .columns = {what}, .rows = {}};
  table.columns.insert(table.columns.end(), class_columns.begin(), class_columns.end());
  return table;
}

/// Returns the lower limit of a step of 1, 2, 5, 10, ... m; step 0 begins at 1 m.
double start_of(int step) {
  static constexpr std::array<double, 3> digits{1, 2, 5};
  const int decade = step >= 0 ? step / 3 : -((2 - step) / 3);
  return digits[static_cast<std::size_t>(step - 3 * decade)] * math::pow(10., decade);
}

int range_step(double range_m) {
  int step = 3 * static_cast<int>(std::floor(math::log10(range_m)));
  while (start_of(step) > range_m) --step;
  while (start_of(step + 1) <= range_m) ++step;
  return std::max(step, -1);  // all ranges below 1 m form one class
}

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

ScanErrors errors_of(const Scan& reference, const Scan& other, const Pairs& pairs) {
  ScanErrors errors;
  for (const auto& [i, j] : pairs.returns) {
    const glm::dvec3& p = reference.p_S[i];
    const glm::dvec3& q = other.p_S[j];
    errors.range_m.push_back(glm::length(q) - glm::length(p));
    errors.angle_rad.push_back(angle_between(p, q));
    errors.lateral_m.push_back(glm::length(glm::cross(glm::normalize(p), q)));
  }
  return errors;
}

std::optional<glm::dvec3> turn_between(const Scan& reference, const Scan& other,
                                       const Pairs& pairs) {
  // Minimises the sum of |d x (q - (d + w x d))|^2 over w; the rotation w maps d to q.
  glm::dmat3 normal(0);
  glm::dvec3 right(0);
  for (const auto& [i, j] : pairs.returns) {
    const glm::dvec3 d = glm::normalize(reference.p_S[i]);
    normal += glm::dmat3(1) - glm::outerProduct(d, d);
    right += glm::cross(d, glm::normalize(other.p_S[j]));
  }
  const auto count = static_cast<double>(pairs.returns.size());
  constexpr double least_determinant = 1e-9;  // nearly all beams are parallel
  if (count == 0 || glm::determinant(normal / count) < least_determinant) return std::nullopt;
  return glm::inverse(normal) * right;
}

Table table_by_range(const Scan& reference, const Scan& other, const Pairs& pairs,
                     const ScanErrors& errors) {
  Classes classes = classes_by(
      pairs, errors, [&](std::uint32_t i) { return range_step(glm::length(reference.p_S[i])); });
  for (const std::uint32_t j : pairs.extra) ++classes[range_step(glm::length(other.p_S[j]))].extra;
  Table table = table_of("By range", "range, m");
  table.columns.emplace_back("extra");
  for (const auto& [step, members] : classes) {
    table.rows.push_back(cells_of(
        fmt::format("{:g} - {:g}", step < 0 ? 0 : start_of(step), start_of(step + 1)), members));
    table.rows.back().push_back(std::to_string(members.extra));
  }
  return table;
}

std::optional<Table> table_by_incidence(const Scan& reference, const Pairs& pairs,
                                        const ScanErrors& errors) {
  const auto* const incidences = reference.find(Quantity::Incidence);
  if (incidences == nullptr) return std::nullopt;
  constexpr int step_deg = 15, none = 90 / step_deg;
  const Classes classes = classes_by(pairs, errors, [&](std::uint32_t i) {
    const double incidence_deg = (*incidences)[i] * 180 / std::numbers::pi;
    if (!(incidence_deg >= 0)) return none;
    return std::min(static_cast<int>(std::min(incidence_deg, 90.) / step_deg), none - 1);
  });
  Table table = table_of("By the reference's angle of incidence", "incidence, deg");
  for (const auto& [step, members] : classes) {
    table.rows.push_back(cells_of(
        step == none ? "none" : fmt::format("{} - {}", step * step_deg, (step + 1) * step_deg),
        members));
  }
  return table;
}

std::optional<Table> table_by_label(const Scan& reference, const Pairs& pairs,
                                    const ScanErrors& errors) {
  const auto* const labels = reference.find(Quantity::Label);
  if (labels == nullptr) return std::nullopt;
  constexpr double most = 1e9;
  const Classes classes = classes_by(pairs, errors, [&](std::uint32_t i) {
    const double label = (*labels)[i];
    return std::abs(label) <= most ? static_cast<int>(std::lround(label)) : -1;
  });
  std::vector<std::pair<int, const Class*>> shown;
  for (const auto& [label, members] : classes) shown.emplace_back(label, &members);
  std::ranges::stable_sort(shown, std::greater<>(),
                           [](const auto& entry) { return entry.second->references(); });
  constexpr std::size_t most_rows = 40;
  Table table = table_of("By the reference's label", "label");
  if (shown.size() > most_rows) {
    table.title += fmt::format(": the {} most frequent of {}", most_rows, shown.size());
    shown.resize(most_rows);
  }
  std::ranges::sort(shown, {}, [](const auto& entry) { return entry.first; });
  for (const auto& [label, members] : shown) {
    table.rows.push_back(cells_of(std::to_string(label), *members));
  }
  return table;
}

Table table_of_largest(const Scan& reference, const Scan& other, const Pairs& pairs,
                       const ScanErrors& errors) {
  constexpr std::size_t most_rows = 8;
  std::vector<std::size_t> order(pairs.returns.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto magnitude = [&](std::size_t k) { return std::abs(errors.range_m[k]); };
  std::ranges::stable_sort(order, std::greater<>(), magnitude);
  order.resize(std::min(order.size(), most_rows));
  Table table{.title = "Pairs whose ranges differ most",
              .columns = {"row of the reference", "row of the other", "range, m", "other's, m",
                          "error, m", "angle, rad"},
              .rows = {}};
  for (const std::size_t k : order) {
    const auto& [i, j] = pairs.returns[k];
    table.rows.push_back({std::to_string(reference.row[i]), std::to_string(other.row[j]),
                          fmt::format("{:.6g}", glm::length(reference.p_S[i])),
                          fmt::format("{:.6g}", glm::length(other.p_S[j])),
                          fmt::format("{:.4g}", errors.range_m[k]),
                          fmt::format("{:.4g}", errors.angle_rad[k])});
  }
  return table;
}

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
