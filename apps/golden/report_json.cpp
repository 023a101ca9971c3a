#include <nlohmann/json.hpp>
#include <string>

#include "apps/golden/report.h"
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
  return {{"title", histogram.title}, {"unit", histogram.unit},     {"low", histogram.low},
          {"high", histogram.high},   {"counts", histogram.counts}, {"below", histogram.below},
          {"above", histogram.above}};
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
          {"text", section.text},
          {"measures", json_of(section.measures)},
          {"tables", json_of(section.tables)},
          {"histograms", json_of(section.histograms)}};
}

}  // namespace

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
