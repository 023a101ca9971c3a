#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/golden/compare/dem_comparison.h"
#include "apps/golden/compare/images/image_comparison.h"
#include "apps/golden/compare/mesh_comparison.h"
#include "apps/golden/compare/scans/scan_comparison.h"
#include "apps/golden/compare/subject.h"
#include "apps/python/binding/arrays.h"
#include "apps/python/binding/bind.h"
#include "apps/python/binding/enum_from_text.h"
#include "apps/python/binding/long_call.h"
#include "apps/python/binding/mesh.h"
#include "apps/python/binding/points.h"
#include "apps/python/terrain_model.h"
#include "core/error.h"

namespace groundray::python {
namespace {

using golden::Section;
using golden::Subject;
using nb::literals::operator""_a;

nb::dict dict_of(const golden::Histogram& histogram) {
  nb::dict all;
  all["title"] = histogram.title;
  all["unit"] = histogram.unit;
  all["low"] = histogram.low;
  all["high"] = histogram.high;
  all["counts"] = histogram.counts;
  all["below"] = histogram.below;
  all["above"] = histogram.above;
  return all;
}

// Returns a section as in report.json, but with figures keyed by name.
nb::dict dict_of(const Section& section) {
  nb::dict figures, units, failed;
  for (const golden::Measure& measure : section.measures) {
    const nb::str name(measure.name.c_str());
    figures[name] = measure.value;
    units[name] = measure.unit;
    if (measure.verdict == golden::Verdict::Failed) failed[name] = measure.because;
  }
  nb::list tables, histograms;
  for (const golden::Table& table : section.tables) {
    nb::dict one;
    one["title"] = table.title;
    one["columns"] = table.columns;
    one["rows"] = table.rows;
    tables.append(one);
  }
  for (const golden::Histogram& histogram : section.histograms)
    histograms.append(dict_of(histogram));
  nb::dict all;
  all["title"] = section.title;
  all["verdict"] = word_of(section.verdict);
  all["text"] = section.text;
  all["figures"] = figures;
  all["units"] = units;
  all["failed"] = failed;
  all["tables"] = tables;
  all["histograms"] = histograms;
  return all;
}

template <typename Compare>
nb::dict compared(const Compare& compare) {
  return dict_of(without_gil([&](const StopRequest&) { return compare(); }));
}

nb::dict compare_files(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const std::optional<std::string>& subject,
                       const std::vector<double>& within_m) {
  const Subject what = subject ? chosen<Subject>("subject", *subject,
                                                 {{"scan", Subject::Scan},
                                                  {"image", Subject::Image},
                                                  {"dem", Subject::Dem},
                                                  {"mesh", Subject::Mesh}})
                               : golden::subject_of(reference, other);
  if (what != Subject::Mesh && !within_m.empty())
    throw Error(
        "compare: within_m requires meshes, but {} and {} are not: omit it, or give subject = "
        "'mesh' if they are",
        reference.string(), other.string());
  return compared([&]() -> Section {
    switch (what) {
      case Subject::Scan:
        return golden::compare_scans(reference, other, golden::ScanOptions{});
      case Subject::Image:
        return golden::compare_images(reference, other);
      case Subject::Dem:
        return golden::compare_dems(reference, other);
      case Subject::Mesh:
        break;
    }
    return golden::compare_meshes(reference, other, {.within_m = within_m});
  });
}

Scan scan_of_points(const Points& points, const char* name) {
  return scan_of({.form = "points in memory", .cloud = points.cloud}, name, {});
}

constexpr const char* compare_doc = R"(Compares data with a reference that is taken as true.

Both are scans, meshes, terrains, or paths of files of scans, images, DEMs or meshes of any origin;
`subject` ("scan", "image", "dem", "mesh") gives the kind of files if their names do not.
  within_m  tolerances for precision, completeness and F1 of meshes

Returns what `groundray-golden compare` reports (docs/reference/golden.md): figures by name and their units,
text with likely misreadings, tables, histograms, and the verdict with the figures that failed.
Raises groundray.Error if the two have nothing in common.)";

}  // namespace

void bind_golden(nb::module_& module) {
  const auto within_m = std::vector<double>{};
  module.def(
      "compare",
      [](const Points& reference, const Points& other) {
        return compared([&] {
          return golden::compare_scans(scan_of_points(reference, "reference"),
                                       scan_of_points(other, "other"), golden::ScanOptions{});
        });
      },
      "reference"_a, "other"_a, compare_doc);
  module.def(
      "compare",
      [](const Mesh& reference, const Mesh& other, const std::vector<double>& within) {
        return compared([&] {
          return golden::compare_meshes(reference.measured.shape, other.measured.shape, "meshes",
                                        {.within_m = within});
        });
      },
      "reference"_a, "other"_a, nb::kw_only(), "within_m"_a = within_m, compare_doc);
  module.def(
      "compare",
      [](const TerrainModel& reference, const TerrainModel& other) {
        return compared(
            [&] { return golden::compare_dems(reference.dem(), other.dem(), "terrains"); });
      },
      "reference"_a, "other"_a, compare_doc);
  module.def("compare", &compare_files, "reference"_a, "other"_a, nb::kw_only(),
             "subject"_a = nb::none(), "within_m"_a = within_m, compare_doc);
}

}  // namespace groundray::python
