#include "apps/golden/compare/scans/scan_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <map>
#include <numbers>
#include <numeric>

#include "apps/golden/compare/error_figures.h"
#include "apps/golden/compare/scans/direction_tree.h"

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
  return digits[static_cast<std::size_t>(step - 3 * decade)] * std::pow(10., decade);
}

int range_step(double range_m) {
  int step = 3 * static_cast<int>(std::floor(std::log10(range_m)));
  while (start_of(step) > range_m) --step;
  while (start_of(step + 1) <= range_m) ++step;
  return std::max(step, -1);  // all ranges below 1 m form one class
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

}  // namespace groundray::golden
