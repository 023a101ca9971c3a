#include <fmt/format.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <filesystem>
#include <glm/vec3.hpp>
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
  all["counted"] = histogram.counted;
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
  all["headline"] = section.headline;
  all["main"] = section.main;
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

using GivenArea = std::optional<std::array<double, 4>>;
using GivenHeights = std::optional<std::array<double, 2>>;
using GivenPixels = std::optional<std::array<int, 4>>;
using GivenOrigin = std::optional<std::array<double, 3>>;

golden::Scope scope_of(const GivenArea& area_m, const GivenHeights& heights_m,
                       const std::optional<double>& ignore_beyond_m) {
  golden::Scope scope;
  if (area_m) {
    scope.low_m = {(*area_m)[0], (*area_m)[1], scope.low_m.z};
    scope.high_m = {(*area_m)[2], (*area_m)[3], scope.high_m.z};
  }
  if (heights_m) {
    scope.low_m.z = (*heights_m)[0];
    scope.high_m.z = (*heights_m)[1];
  }
  scope.ignore_beyond_m = ignore_beyond_m.value_or(scope.ignore_beyond_m);
  return scope;
}

std::optional<glm::dvec3> vector_of(const GivenOrigin& origin) {
  if (!origin) return std::nullopt;
  return glm::dvec3((*origin)[0], (*origin)[1], (*origin)[2]);
}

/// Arguments of the comparison of files.
struct FileArguments {
  std::vector<double> within_m;
  golden::Scope scope;
  std::optional<golden::PixelBox> pixels;
  std::optional<glm::dvec3> origin_w_m, reference_origin_w_m;
};

/// @throws Error naming an argument that the kind of the files does not have.
void check_arguments(Subject what, const FileArguments& given, const std::string& files) {
  const auto refuse = [&](const char* argument, const char* kinds) {
    throw Error("compare: {} requires {}, but {} are not: omit it, or give subject if they are",
                argument, kinds, files);
  };
  const bool is_image = what == Subject::Image;
  const bool is_placed = what == Subject::Scan || what == Subject::Mesh;
  if (!given.within_m.empty() && what != Subject::Mesh) refuse("within_m", "meshes");
  if (is_image && given.scope.has_box()) refuse("area_m, heights_m", "scans, DEMs or meshes");
  if (is_image && given.scope.ignores()) refuse("ignore_beyond_m", "scans, DEMs or meshes");
  if (!is_image && given.pixels) refuse("pixels", "images");
  if (!is_placed && given.origin_w_m) refuse("origin_w_m", "scans or meshes");
  if (!is_placed && given.reference_origin_w_m) refuse("reference_origin_w_m", "scans or meshes");
}

Section section_of_files(const std::filesystem::path& reference, const std::filesystem::path& other,
                         Subject what, const FileArguments& given) {
  switch (what) {
    case Subject::Scan: {
      golden::ScanOptions options{.scope = given.scope};
      options.reference.origin_w_m = given.reference_origin_w_m.value_or(glm::dvec3(0));
      options.other.origin_w_m = given.origin_w_m.value_or(glm::dvec3(0));
      return golden::compare_scans(reference, other, options);
    }
    case Subject::Image:
      return golden::compare_images(reference, other, {.pixels = given.pixels});
    case Subject::Dem:
      return golden::compare_dems(reference, other, {}, given.scope);
    case Subject::Mesh:
      break;
  }
  return golden::compare_meshes(reference, other, {.within_m = given.within_m}, given.scope,
                                {given.reference_origin_w_m, given.origin_w_m});
}

nb::dict compare_files(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const std::optional<std::string>& subject, const FileArguments& given) {
  const Subject what = subject ? chosen<Subject>("subject", *subject,
                                                 {{"scan", Subject::Scan},
                                                  {"image", Subject::Image},
                                                  {"dem", Subject::Dem},
                                                  {"mesh", Subject::Mesh}})
                               : golden::subject_of(reference, other);
  check_arguments(what, given, fmt::format("{} and {}", reference.string(), other.string()));
  return compared([&] { return section_of_files(reference, other, what, given); });
}

Scan scan_of_points(const Points& points, const char* name) {
  return scan_of({.form = "points in memory", .cloud = points.cloud}, name, {});
}

constexpr const char* compare_doc = R"(Compares data with a reference that is taken as true.

Both are scans, meshes, terrains, or paths of files of scans, images, DEMs or meshes of any origin;
`subject` ("scan", "image", "dem", "mesh") gives the kind of files if their names do not.
  within_m         tolerances for precision, completeness and F1 of meshes
  area_m           west, south, east, north in world coordinates: compare only what is within
  heights_m        lowest and highest z in world coordinates: compare only what is between
  ignore_beyond_m  leave out what is farther than this from the other scan, terrain or mesh
  pixels           column, row, width, height: compare only these pixels of images
  origin_w_m, reference_origin_w_m  x, y, z in world coordinates of the origins of meshes or scans
                   whose files do not state them

Returns what `groundray-golden compare` reports (docs/reference/golden.md): figures by name and their units,
text with likely misreadings, tables, histograms, and the verdict with the figures that failed.
Raises groundray.Error if the two have nothing in common.)";

}  // namespace

void bind_golden(nb::module_& module) {
  const auto within_m = std::vector<double>{};
  module.def(
      "compare",
      [](const Points& reference, const Points& other, const GivenArea& area_m,
         const GivenHeights& heights_m, const std::optional<double>& ignore_beyond_m) {
        return compared([&] {
          return golden::compare_scans(
              scan_of_points(reference, "reference"), scan_of_points(other, "other"),
              golden::ScanOptions{.scope = scope_of(area_m, heights_m, ignore_beyond_m)});
        });
      },
      "reference"_a, "other"_a, nb::kw_only(), "area_m"_a = nb::none(), "heights_m"_a = nb::none(),
      "ignore_beyond_m"_a = nb::none(), compare_doc);
  module.def(
      "compare",
      [](const Mesh& reference, const Mesh& other, const std::vector<double>& within,
         const GivenArea& area_m, const GivenHeights& heights_m,
         const std::optional<double>& ignore_beyond_m) {
        return compared([&] {
          return golden::compare_meshes(reference.measured.shape, other.measured.shape, "meshes",
                                        {.within_m = within},
                                        scope_of(area_m, heights_m, ignore_beyond_m));
        });
      },
      "reference"_a, "other"_a, nb::kw_only(), "within_m"_a = within_m, "area_m"_a = nb::none(),
      "heights_m"_a = nb::none(), "ignore_beyond_m"_a = nb::none(), compare_doc);
  module.def(
      "compare",
      [](const TerrainModel& reference, const TerrainModel& other, const GivenArea& area_m,
         const GivenHeights& heights_m, const std::optional<double>& ignore_beyond_m) {
        return compared([&] {
          return golden::compare_dems(reference.dem(), other.dem(), "terrains",
                                      scope_of(area_m, heights_m, ignore_beyond_m));
        });
      },
      "reference"_a, "other"_a, nb::kw_only(), "area_m"_a = nb::none(), "heights_m"_a = nb::none(),
      "ignore_beyond_m"_a = nb::none(), compare_doc);
  module.def(
      "compare",
      [](const std::filesystem::path& reference, const std::filesystem::path& other,
         const std::optional<std::string>& subject, const std::vector<double>& within,
         const GivenArea& area_m, const GivenHeights& heights_m,
         const std::optional<double>& ignore_beyond_m, const GivenPixels& pixels,
         const GivenOrigin& origin_w_m, const GivenOrigin& reference_origin_w_m) {
        FileArguments given{.within_m = within,
                            .scope = scope_of(area_m, heights_m, ignore_beyond_m),
                            .pixels = {},
                            .origin_w_m = vector_of(origin_w_m),
                            .reference_origin_w_m = vector_of(reference_origin_w_m)};
        if (pixels)
          given.pixels =
              golden::PixelBox{{(*pixels)[0], (*pixels)[1]}, {(*pixels)[2], (*pixels)[3]}};
        return compare_files(reference, other, subject, given);
      },
      "reference"_a, "other"_a, nb::kw_only(), "subject"_a = nb::none(), "within_m"_a = within_m,
      "area_m"_a = nb::none(), "heights_m"_a = nb::none(), "ignore_beyond_m"_a = nb::none(),
      "pixels"_a = nb::none(), "origin_w_m"_a = nb::none(), "reference_origin_w_m"_a = nb::none(),
      compare_doc);
}

}  // namespace groundray::python
