#include "apps/golden/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/io/file_io.h"

namespace groundray::golden {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Measure& measure) {
  return {{"name", measure.name},       {"value", measure.value},
          {"unit", measure.unit},       {"limit", measure.limit ? Json(*measure.limit) : Json()},
          {"because", measure.because}, {"verdict", word_of(measure.verdict)}};
}

Json json_of(const Table& table) {
  return {{"title", table.title}, {"columns", table.columns}, {"rows", table.rows}};
}

Json json_of(const Histogram& histogram) {
  return {{"title", histogram.title}, {"unit", histogram.unit},      {"low", histogram.low},
          {"high", histogram.high},   {"counts", histogram.counts},  {"below", histogram.below},
          {"above", histogram.above}, {"counted", histogram.counted}};
}

Json json_of(const Section& section);

template <typename T>
Json json_of(const std::vector<T>& all) {
  Json array = Json::array();
  for (const T& each : all) array.push_back(json_of(each));
  return array;
}

Json json_of(const Section& section) {
  return {{"title", section.title},
          {"verdict", word_of(section.verdict)},
          {"headline", section.headline},
          {"main", section.main},
          {"text", section.text},
          {"measures", json_of(section.measures)},
          {"tables", json_of(section.tables)},
          {"histograms", json_of(section.histograms)}};
}

/// Returns the verdict as a sentence; empty if nothing had a limit.
std::string verdict_sentence(const Section& section) {
  const auto is_failed = [](const Measure& m) { return m.verdict == Verdict::Failed; };
  const auto failures = std::ranges::count_if(section.measures, is_failed);
  const auto held =
      failures + std::ranges::count(section.measures, Verdict::Passed, &Measure::verdict);
  if (held == 0) return {};
  if (failures == 0)
    return held == 1 ? "Passed: the limit is met."
                     : fmt::format("Passed: all {} limits are met.", held);
  const Measure& first = *std::ranges::find_if(section.measures, is_failed);
  const std::string unit = first.unit.empty() ? "" : " " + first.unit;
  std::string text = fmt::format("Failed: {} is {:.4g}{}", first.name, first.value, unit);
  text += first.limit ? fmt::format(", but may be at most {:.4g}{}", *first.limit, unit)
                      : fmt::format(" ({})", first.because);
  return text + (failures == 1 ? "." : fmt::format("; {} of {} checks failed.", failures, held));
}

}  // namespace

const char* word_of(Verdict verdict) {
  constexpr std::array words{"passed", "failed", "told"};
  return words[static_cast<std::size_t>(verdict)];
}

Verdict verdict_of(const std::vector<Measure>& measures) {
  const auto any = [&](Verdict verdict) {
    return std::ranges::find(measures, verdict, &Measure::verdict) != measures.end();
  };
  if (any(Verdict::Failed)) return Verdict::Failed;
  return any(Verdict::Passed) ? Verdict::Passed : Verdict::Told;
}

std::string first_words(const Section& section) {
  const std::string verdict = verdict_sentence(section);
  if (verdict.empty()) return section.headline + " No limit was given, so there is no verdict.";
  return section.headline.empty() ? verdict : verdict + " " + section.headline;
}

std::vector<Measure> main_measures(const Section& section) {
  std::vector<Measure> result;
  for (const std::string& name : section.main) {
    const auto found = std::ranges::find(section.measures, name, &Measure::name);
    if (found != section.measures.end()) result.push_back(*found);
  }
  return result;
}

void tell(Section& into, std::string name, double value, std::string unit) {
  into.measures.push_back({std::move(name), value, std::move(unit), {}, {}, Verdict::Told});
}

void hold(Section& into, std::string name, double value, std::string unit, double limit,
          std::string because) {
  into.measures.push_back({std::move(name), value, std::move(unit), limit, std::move(because),
                           value <= limit ? Verdict::Passed : Verdict::Failed});
}

void fail(Section& into, std::string name, double value, std::string unit, std::string because) {
  into.measures.push_back(
      {std::move(name), value, std::move(unit), {}, std::move(because), Verdict::Failed});
}

Histogram histogram_of(std::string title, std::string unit, const std::vector<double>& values,
                       double low, double high, std::size_t bins) {
  Histogram histogram{.title = std::move(title),
                      .unit = std::move(unit),
                      .low = low,
                      .high = high,
                      .counts = std::vector<std::uint64_t>(bins)};
  const bool has_steps = bins > 0 && high > low && std::isfinite(high - low);
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    if (value < low) {
      ++histogram.below;
    } else if (value > high || !has_steps) {
      ++histogram.above;
    } else {  // the last step includes its upper limit
      const double place = (value - low) / (high - low) * static_cast<double>(bins);
      ++histogram.counts[std::min(static_cast<std::size_t>(place), bins - 1)];
    }
  }
  return histogram;
}

void check_report_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (std::filesystem::exists(folder / "dataset.yaml", ignored))
    throw Error("{}: it is a dataset; choose another folder with -o", folder.string());
}

void write_json(const std::filesystem::path& path, const Report& report) {
  Json facts = Json::array();
  for (const auto& fact : report.facts)
    facts.push_back({{"name", fact.first}, {"value", fact.second}});
  const Json whole{
      {"title", report.title}, {"facts", std::move(facts)}, {"sections", json_of(report.sections)}};
  // File names may be invalid UTF-8.
  write_text(path, whole.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace groundray::golden
