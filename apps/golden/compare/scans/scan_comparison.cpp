#include "apps/golden/compare/scans/scan_comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <string>
#include <vector>

#include "apps/golden/compare/error_figures.h"
#include "apps/golden/compare/scans/scan_errors.h"
#include "apps/golden/compare/scans/scan_pictures.h"
#include "apps/golden/compare/scans/scan_scope.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

constexpr const char* equal_labels = "share of equal labels";

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// Fraction of the reference's returns, of those compared, that are missing; likewise for extra
/// ones.
double missing_share(const Pairs& pairs) {
  return share(pairs.missing.size(), pairs.missing.size() + pairs.returns.size());
}
double extra_share(const Pairs& pairs) {
  return share(pairs.extra.size(), pairs.extra.size() + pairs.returns.size());
}

/// Checks a figure if it has a limit, else only reports it.
void tell_or_hold(Section& section, std::string name, double value, std::string unit,
                  const std::optional<double>& limit) {
  if (limit) {
    hold(section, std::move(name), value, std::move(unit), *limit, "limit set by the user");
  } else {
    tell(section, std::move(name), value, std::move(unit));
  }
}

std::string pairing_text(const Scan& reference, const Scan& other, const Pairs& pairs) {
  const bool is_by_time = pairs.rule == PairingRule::RingTime;
  std::string text = fmt::format("Pulses were paired by {}", name_of(pairs.rule));
  if (pairs.rule != PairingRule::Pulse) {
    text +=
        fmt::format(", nearest first, within {:.4g} {}", pairs.tolerance, is_by_time ? "s" : "rad");
  }
  text += fmt::format(", their returns {}: ",
                      pairs.is_by_return_index ? "by their index" : "in order of range");
  text += fmt::format(
      "{:.2f} % of the reference's {} pulses and {:.2f} % of the other's {}, {:.2f} % and {:.2f} % "
      "of their returns. ",
      100 * share(pairs.paired_pulses, pairs.reference_pulses), pairs.reference_pulses,
      100 * share(pairs.paired_pulses, pairs.other_pulses), pairs.other_pulses,
      100 * share(pairs.returns.size(), reference.p_S.size()),
      100 * share(pairs.returns.size(), other.p_S.size()));
  text +=
      "Ranges are distances of x, y, z from the sensor's origin, as reported, in both scans; "
      "errors are the other's ranges minus the reference's.";
  return text;
}

void add_sentences(std::string& text, const std::vector<std::string>& sentences) {
  for (const std::string& sentence : sentences) text += (text.empty() ? "" : " ") + sentence;
}

Table table_of_files(const Scan& reference, const Scan& other) {
  Table table{
      .title = "What is in the files",
      .columns = {"", "file", "form", "rows", "returns", "beyond range (+inf)", "too near (-inf)",
                  "invalid (NaN)", "at the origin (0, 0, 0)", "columns not used"},
      .rows = {}};
  for (const Scan* scan : {&reference, &other}) {
    const NoReturns& none = scan->no_returns;
    table.rows.push_back({scan == &reference ? "reference" : "other", scan->name, scan->form,
                          std::to_string(scan->rows), std::to_string(scan->p_S.size()),
                          std::to_string(none.beyond), std::to_string(none.near),
                          std::to_string(none.invalid), std::to_string(none.zero),
                          fmt::format("{}", fmt::join(scan->unused, ", "))});
  }
  return table;
}

Table table_of_columns(const Scan& reference, const Scan& other) {
  Table table{.title = "How columns were read",
              .columns = {"", "column of the file", "read as", "note"},
              .rows = {}};
  for (const Scan* scan : {&reference, &other}) {
    for (const ReadColumn& column : scan->read) {
      table.rows.push_back(
          {scan == &reference ? "reference" : "other", column.theirs, column.ours, column.note});
    }
  }
  return table;
}

void tell_pairs(const Pairs& pairs, const ScanLimits& limits, Section& section) {
  const auto count = [](std::size_t value) { return static_cast<double>(value); };
  if (pairs.returns.empty() && pairs.missing.size() + pairs.extra.size() > 0) {
    fail(section, "pairs of returns", 0, "", "without a pair, no range is compared");
  } else {
    tell(section, "pairs of returns", count(pairs.returns.size()));
  }
  tell(section, "missing returns", count(pairs.missing.size()));
  tell_or_hold(section, "missing share of the reference's", missing_share(pairs), "",
               limits.missing_share);
  tell(section, "extra returns", count(pairs.extra.size()));
  tell_or_hold(section, "extra share of the other's", extra_share(pairs), "", limits.extra_share);
}

void tell_left_out(const LeftOut& left, const Pairs& pairs, const Scope& scope, Section& section) {
  const auto count = [](std::size_t value) { return static_cast<double>(value); };
  if (scope.has_box()) {
    const std::string name = ": outside the area and heights";
    tell(section, "reference" + name, count(left.outside_reference), "returns");
    tell(section, "other" + name, count(left.outside_other), "returns");
  }
  const std::size_t both = pairs.returns.size();
  tell_ignored(section, "reference", count(left.ignored_reference),
               count(left.ignored_reference + both + pairs.missing.size()), "returns", scope);
  tell_ignored(section, "other", count(left.ignored_other),
               count(left.ignored_other + both + pairs.extra.size()), "returns", scope);
}

void write_headline(const Pairs& pairs, const ScanErrors& errors, Section& section) {
  section.main = {"range error, mean", "range error, RMS",
                  "range error, 95th percentile of magnitudes", "missing share of the reference's",
                  "extra share of the other's"};
  const ErrorFigures figures = figures_of(errors.range_m);
  section.headline = figures.largest == 0
                         ? fmt::format("All {} pairs of returns have equal ranges", figures.count)
                         : fmt::format(
                               "The other's ranges differ from the reference's by {:.4g} m RMS and "
                               "{:.4g} m on average in {} pairs of returns",
                               figures.rms, figures.mean, figures.count);
  if (figures.count == 0) section.headline = "No returns are paired";
  section.headline += fmt::format(
      "; {:.2f} % of the reference's returns are missing, {:.2f} % of the other's are extra.",
      100 * missing_share(pairs), 100 * extra_share(pairs));
  const auto labels = std::ranges::find(section.measures, equal_labels, &Measure::name);
  if (labels == section.measures.end() || labels->value == 100) return;
  section.main[2] = equal_labels;
  section.headline += fmt::format(" {:.4g} % of the labels are equal.", labels->value);
}

double deviation_of(std::vector<double> values, double mean) {
  for (double& value : values) value -= mean;
  return figures_of(values).rms;
}

void tell_ranges(const ScanErrors& errors, const ScanLimits& limits, Section& section) {
  const ErrorFigures figures = figures_of(errors.range_m);
  const std::string name = "range error, ";
  tell(section, name + "mean", figures.mean, "m");
  if (limits.range_mean_m) {
    hold(section, name + "magnitude of the mean", std::abs(figures.mean), "m", *limits.range_mean_m,
         "limit set by the user");
  }
  tell_or_hold(section, name + "RMS", figures.rms, "m", limits.range_rms_m);
  tell(section, name + "standard deviation", deviation_of(errors.range_m, figures.mean), "m");
  tell(section, name + "median", figures.median, "m");
  tell(section, name + "95th percentile of magnitudes", figures.p95_size, "m");
  tell_or_hold(section, name + "99th percentile of magnitudes", figures.p99_size, "m",
               limits.range_p99_m);
  tell(section, name + "largest magnitude", figures.largest, "m");
}

/// Fails all limits of the range error, for scans without pairs.
void fail_ranges(const ScanLimits& limits, Section& section) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  for (const auto& limit : {limits.range_mean_m, limits.range_rms_m, limits.range_p99_m}) {
    if (limit) hold(section, "range error", unknown, "m", *limit, "limit set by the user");
  }
}

void tell_directions(const ScanErrors& errors, const std::optional<glm::dvec3>& turn_rad,
                     Section& section) {
  const ErrorFigures angle = figures_of(errors.angle_rad);
  tell(section, "angle between directions, median", angle.median, "rad");
  tell(section, "angle between directions, RMS", angle.rms, "rad");
  tell(section, "angle between directions, largest", angle.largest, "rad");
  if (turn_rad) tell(section, "turn of the other as a whole", glm::length(*turn_rad), "rad");
  const ErrorFigures lateral = figures_of(errors.lateral_m);
  tell(section, "distance from the reference's beam, RMS", lateral.rms, "m");
  tell(section, "distance from the reference's beam, 95th percentile", lateral.p95_size, "m");
  tell(section, "distance from the reference's beam, largest", lateral.largest, "m");
}

/// Reports the ratio and correlation of intensities, if both scans have them.
void tell_intensities(const Scan& reference, const Scan& other, const Pairs& pairs,
                      Section& section) {
  const auto* const ours = reference.find(Quantity::Intensity);
  const auto* const theirs = other.find(Quantity::Intensity);
  if (ours == nullptr || theirs == nullptr) return;
  std::vector<std::pair<double, double>> both;
  double a_sum = 0, b_sum = 0;
  for (const auto& [i, j] : pairs.returns) {
    const double a = (*ours)[i], b = (*theirs)[j];
    if (!std::isfinite(a) || !std::isfinite(b)) continue;
    both.emplace_back(a, b);
    a_sum += a;
    b_sum += b;
  }
  const auto count = static_cast<double>(both.size());
  double aa = 0, ab = 0, bb = 0, squares = 0, products = 0;
  for (const auto& [a, b] : both) {
    const double da = a - a_sum / count, db = b - b_sum / count;
    aa += da * da;
    ab += da * db;
    bb += db * db;
    squares += a * a;
    products += a * b;
  }
  if (squares > 0) tell(section, "intensity, best factor to the reference's", products / squares);
  if (aa > 0 && bb > 0) tell(section, "intensity, correlation", ab / std::sqrt(aa * bb));
}

/// Reports the share of pairs with equal labels, if both scans have them.
void tell_labels(const Scan& reference, const Scan& other, const Pairs& pairs, Section& section) {
  const auto* const ours = reference.find(Quantity::Label);
  const auto* const theirs = other.find(Quantity::Label);
  if (ours == nullptr || theirs == nullptr) return;
  const auto equal = std::ranges::count_if(pairs.returns, [&](const auto& pair) {
    return (*ours)[pair.first] == (*theirs)[pair.second];
  });
  tell(section, equal_labels, 100 * share(static_cast<std::size_t>(equal), pairs.returns.size()),
       "%");
}

/// Returns a histogram centred on the median; its half-width is the 99th percentile of the
/// deviations from it.
Histogram histogram_of_errors(std::string title, std::string unit,
                              const std::vector<double>& errors) {
  const double median = quantile(errors, 0.5);
  std::vector<double> sizes;
  sizes.reserve(errors.size());
  for (const double error : errors) sizes.push_back(std::abs(error - median));
  double half = quantile(std::move(sizes), 0.99);
  if (!(half > std::abs(median) * 1e-9)) half = std::max(std::abs(median) / 2, 1e-9);  // all equal
  return histogram_of(std::move(title), std::move(unit), errors, median - half, median + half);
}

void add_classes(const Scan& reference, const Scan& other, const Pairs& pairs,
                 const ScanErrors& errors, Section& section) {
  section.tables.push_back(table_by_range(reference, other, pairs, errors));
  if (auto table = table_by_incidence(reference, pairs, errors)) {
    section.tables.push_back(std::move(*table));
  }
  if (auto table = table_by_label(reference, pairs, errors)) {
    section.tables.push_back(std::move(*table));
  }
}

[[noreturn]] void refuse(const Scan& reference, const Scan& other, const Pairs& pairs,
                         const std::vector<std::string>& doubts) {
  std::string message =
      fmt::format("{}: none of its {} returns could be paired with the {} of {} by {}", other.name,
                  other.p_S.size(), reference.p_S.size(), reference.name, name_of(pairs.rule));
  if (pairs.rule != PairingRule::Pulse) {
    message += fmt::format(" within {:.4g} {}", pairs.tolerance,
                           pairs.rule == PairingRule::RingTime ? "s" : "rad");
  }
  message += '.';
  add_sentences(message, pairs.notes);
  add_sentences(message, doubts);
  if (doubts.empty()) {
    message += " Do both show the same scene, in the sensor frame with x forward, y left, z up?";
  }
  throw Error("{}", message);
}

}  // namespace

Section compare_scans(const std::filesystem::path& reference, const std::filesystem::path& other,
                      const ScanOptions& options) {
  return compare_scans(read_scan(reference, options.reference), read_scan(other, options.other),
                       options);
}

Section compare_scans(const Scan& reference, const Scan& other, const ScanOptions& options) {
  check_scope(options.scope);
  Pairs pairs = pair_scans(reference, other, options.pairing);
  const std::vector<std::string> doubts = doubts_about(reference, other);
  if (pairs.returns.empty() && !reference.p_S.empty() && !other.p_S.empty()) {
    refuse(reference, other, pairs, doubts);
  }
  const std::string pairing = pairing_text(reference, other, pairs);
  const LeftOut left = leave_out(reference, other, options.scope, pairs);
  if (pairs.returns.empty() && left.outside_reference + left.ignored_reference > 0) {
    throw Error(
        "{}: no pair of returns with {} is left: {} of the reference's are outside the area and "
        "heights, and {} are ignored for their distance",
        other.name, reference.name, left.outside_reference, left.ignored_reference);
  }
  const ScanErrors errors = errors_of(reference, other, pairs);
  const auto turn_rad = turn_between(reference, other, pairs);
  Section section{.title = fmt::format("Scan {} against {}", other.name, reference.name)};
  add_sentences(section.text, doubts);
  add_sentences(section.text, doubts_about(pairs, errors, turn_rad));
  add_sentences(section.text, {pairing});
  const std::vector<std::string> frames{reference.frame, other.frame};
  for (const auto& notes : {pairs.notes, frames, reference.notes, other.notes,
                            doubts_about_ranges(reference), doubts_about_ranges(other)}) {
    add_sentences(section.text, notes);
  }
  if (options.scope.has_box() || options.scope.ignores())
    section.text += " " + scope_text(options.scope, "the frame of the reference's points");
  tell_pairs(pairs, options.limits, section);
  tell_left_out(left, pairs, options.scope, section);
  if (pairs.returns.empty()) {
    fail_ranges(options.limits, section);
  } else {
    tell_ranges(errors, options.limits, section);
    tell_directions(errors, turn_rad, section);
    tell_intensities(reference, other, pairs, section);
    tell_labels(reference, other, pairs, section);
    section.histograms.push_back(histogram_of_errors("Error of the range", "m", errors.range_m));
    section.histograms.back().counted = "pairs of returns";
  }
  add_classes(reference, other, pairs, errors, section);
  if (!pairs.returns.empty()) {
    section.tables.push_back(table_of_largest(reference, other, pairs, errors));
  }
  section.tables.push_back(table_of_files(reference, other));
  section.tables.push_back(table_of_columns(reference, other));
  draw_errors(reference, other, pairs, errors, section);
  write_headline(pairs, errors, section);
  section.verdict = verdict_of(section.measures);
  return section;
}

}  // namespace groundray::golden
