#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "apps/groundray/describe/file_facts.h"
#include "apps/scan/scan.h"
#include "core/io/ply_header.h"

namespace groundray {
namespace {

// Least and greatest of some values; NaN and infinite ones are only counted.
struct ValueRange {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  std::size_t not_finite = 0;

  void add(double value) {
    if (!std::isfinite(value)) {
      ++not_finite;
      return;
    }
    low = std::min(low, value);
    high = std::max(high, value);
  }
  std::string text() const {
    return low > high ? "no finite value" : fmt::format("{:.8g} to {:.8g}", low, high);
  }
};

std::string column_text(const PointCloud::Column& column, const Scan& scan) {
  ValueRange range;
  std::visit(
      [&](const auto& values) {
        for (const auto value : values) range.add(static_cast<double>(value));
      },
      column.values);
  std::string text = fmt::format("{}, {}, {}", column.name,
                                 ply_type_names[column.values.index()][1], range.text());
  if (range.not_finite > 0) text += fmt::format(", {} not finite", range.not_finite);
  const auto read = std::ranges::find(scan.read, column.name, &ReadColumn::theirs);
  if (read != scan.read.end() && read->ours != column.name) text += ": read as " + read->ours;
  return text;
}

void add_returns(const Scan& scan, Facts& facts) {
  const auto [beyond, near, invalid, zero] = scan.no_returns;
  facts.emplace_back("points",
                     fmt::format("{}, of which {} have a position", scan.rows, scan.p_S.size()));
  if (beyond + near + invalid + zero > 0)
    facts.emplace_back("others", fmt::format("{} beyond range, {} too near, {} NaN, {} at zero",
                                             beyond, near, invalid, zero));
  if (scan.p_S.empty()) return;
  glm::dvec3 low = scan.p_S.front(), high = low;
  ValueRange ranges;
  for (const glm::dvec3& p_S : scan.p_S) {
    low = glm::min(low, p_S);
    high = glm::max(high, p_S);
    ranges.add(glm::length(p_S));
  }
  facts.emplace_back("bounds", fmt::format("({:.8g}, {:.8g}, {:.8g}) to ({:.8g}, {:.8g}, {:.8g}) m",
                                           low.x, low.y, low.z, high.x, high.y, high.z));
  facts.emplace_back("ranges", ranges.text() + " m from the origin");
}

void add_quantities(const Scan& scan, Facts& facts) {
  if (const auto* times_s = scan.find(Quantity::Time)) {
    ValueRange range;
    for (const double time_s : *times_s) range.add(time_s);
    facts.emplace_back("times", range.text() + " s");
  }
  const auto count = [&](Quantity quantity, const char* name) {
    const auto* values = scan.find(quantity);
    if (values == nullptr) return;
    const std::size_t different = std::set(values->begin(), values->end()).size();
    facts.emplace_back(name, fmt::format("{} different", different));
  };
  count(Quantity::Ring, "rings");
  count(Quantity::Label, "labels");
}

}  // namespace

Facts cloud_facts(const std::filesystem::path& file) {
  const CloudFile cloud = read_cloud(file, {});
  const Scan scan = scan_of(cloud, file.string(), {});
  Facts facts{{"kind", "points, " + cloud.form}};
  add_returns(scan, facts);
  add_quantities(scan, facts);
  for (const PointCloud::Column& column : cloud.cloud.columns())
    facts.emplace_back("column", column_text(column, scan));
  for (const std::string& unread : cloud.unread) facts.emplace_back("not read", unread);
  for (const std::string& note : scan.notes) facts.emplace_back("note", note);
  return facts;
}

}  // namespace groundray
