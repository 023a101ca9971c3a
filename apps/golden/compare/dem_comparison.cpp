#include "apps/golden/compare/dem_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/golden/compare/dem_pair.h"
#include "apps/golden/compare/error_figures.h"
#include "apps/golden/compare/images/difference_picture.h"
#include "apps/golden/compare/images/image_file.h"
#include "core/error.h"
#include "core/geometry/cell.h"
#include "core/math.h"

namespace groundray::golden {
namespace {

constexpr std::string_view nmad_name = "height: NMAD, 1.4826 times the median of |error - median|";
constexpr double no_height = std::numeric_limits<double>::quiet_NaN();

/// Returns the reference's slope along x and y of D by central differences, one-sided next to holes
/// and edges; NaN if neither neighbour has a height.
glm::dvec2 gradient(const DemPair& pair, int column, int row) {
  const auto along = [&](int dx, int dy, double step_m) {
    const auto height_at = [&](int times) {
      const int x = column + times * dx, y = row + times * dy;
      const bool is_in = x >= 0 && y >= 0 && x < pair.samples().x && y < pair.samples().y;
      return is_in ? pair.reference(x, y) : no_height;
    };
    const double before = height_at(-1), here = height_at(0), after = height_at(1);
    if (std::isnan(before)) return (after - here) / step_m;
    return std::isnan(after) ? (here - before) / step_m : (after - before) / (2 * step_m);
  };
  return {along(1, 0, pair.frame.step_m.x), along(0, 1, pair.frame.step_m.y)};
}

/// Sample with a height in both DEMs.
struct Sample {
  int column = 0, row = 0;
  double error_m = 0;
  glm::dvec2 slope{0};  // gradient of the reference
};

std::vector<Sample> samples_of(const DemPair& pair) {
  std::vector<Sample> samples;
  for (int row = 0; row < pair.samples().y; ++row) {
    for (int column = 0; column < pair.samples().x; ++column) {
      const double error_m = pair.other(column, row) - pair.reference(column, row);
      if (std::isnan(error_m) || !pair.has(column, row)) continue;
      samples.push_back({column, row, error_m, gradient(pair, column, row)});
    }
  }
  return samples;
}

std::vector<double> height_errors(const std::vector<Sample>& samples) {
  std::vector<double> errors_m(samples.size());
  std::ranges::transform(samples, errors_m.begin(), &Sample::error_m);
  return errors_m;
}

void tell_vertical(const DemPair& pair, const glm::dvec3& origin_w_m,
                   const std::vector<Sample>& samples, Section& into) {
  const std::vector<double> errors_m = height_errors(samples);
  const ErrorFigures figures = figures_of(errors_m);
  tell_errors(into, "height", "m", errors_m);
  tell(into, "height: median error", figures.median, "m");
  tell(into, std::string(nmad_name), figures.nmad, "m");
  if (figures.largest == 0) return;
  const Sample& worst = samples[figures.worst];
  const glm::dvec2 p_W = pair.frame.to_D({worst.column, worst.row}) + glm::dvec2(origin_w_m);
  into.text += fmt::format(
      "The largest height error is in column {}, row {} (east {:.3f} m, north {:.3f} m): {:.6g} m "
      "where the reference has {:.6g} m.\n",
      worst.column, worst.row, p_W.x, p_W.y, pair.other(worst.column, worst.row) + origin_w_m.z,
      pair.reference(worst.column, worst.row) + origin_w_m.z);
}

void tell_by_slope(const std::vector<Sample>& samples, Section& into) {
  constexpr std::array limits_deg{5.0, 10.0, 20.0, 30.0, 45.0, 90.0};
  std::array<std::vector<double>, limits_deg.size()> classes;
  for (const Sample& sample : samples) {
    const double slope_deg = glm::degrees(math::atan(glm::length(sample.slope)));
    for (std::size_t i = 0; i < limits_deg.size(); ++i) {
      if (slope_deg > limits_deg[i]) continue;
      classes[i].push_back(sample.error_m);
      break;
    }
  }
  Table table{"errors of height by the reference's slope (central differences)",
              {"slope, deg", "samples", "mean, m", "RMS, m", "NMAD, m", "95 % below, m"},
              {}};
  double from_deg = 0;
  for (std::size_t i = 0; i < limits_deg.size(); from_deg = limits_deg[i++]) {
    if (classes[i].empty()) continue;
    const ErrorFigures figures = figures_of(classes[i]);
    table.rows.push_back({fmt::format("{} to {}", from_deg, limits_deg[i]),
                          fmt::format("{}", figures.count), fmt::format("{:.5g}", figures.mean),
                          fmt::format("{:.5g}", figures.rms), fmt::format("{:.5g}", figures.nmad),
                          fmt::format("{:.5g}", figures.p95_size)});
  }
  into.tables.push_back(std::move(table));
}

/// Compares the normals of both triangles of each cell that both surfaces have.
void tell_slopes(const DemPair& pair, Section& into) {
  std::vector<double> angles_deg, slopes_deg;
  const GridFrame& frame = pair.frame;
  for (int row = 0; row + 1 < pair.samples().y; ++row) {
    for (int column = 0; column + 1 < pair.samples().x; ++column) {
      if (!pair.has_cell(column, row)) continue;
      const Cell of_reference = pair.reference.cell(column, row);
      const Cell of_other = pair.other.cell(column, row);
      for (const Half half : {Half::Near, Half::Far}) {
        const glm::dvec3 a = frame.normal(of_reference.plane(half));
        const glm::dvec3 b = frame.normal(of_other.plane(half));
        if (std::isnan(a.z) || std::isnan(b.z)) continue;
        angles_deg.push_back(
            glm::degrees(math::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b))));
        const auto slope = [](glm::dvec3 n) { return math::atan2(math::hypot(n.x, n.y), n.z); };
        slopes_deg.push_back(glm::degrees(slope(b) - slope(a)));
      }
    }
  }
  tell_errors(into, "slope of triangles", "deg", slopes_deg);
  tell_sizes(into, "angle between triangles", "deg", angles_deg);
}

void tell_holes(const DemPair& pair, const Scope& scope, std::size_t compared, Section& into) {
  std::size_t only_reference = 0, only_other = 0, both = 0;
  for (std::size_t i = 0; i < pair.other.m.values().size(); ++i) {
    if (pair.is_left_out[i]) continue;
    const bool is_hole = std::isnan(pair.reference.m.values()[i]),
               is_hole_of_other = std::isnan(pair.other.m.values()[i]);
    both += is_hole && is_hole_of_other ? 1 : 0;
    only_reference += is_hole && !is_hole_of_other ? 1 : 0;
    only_other += !is_hole && is_hole_of_other ? 1 : 0;
  }
  tell(into, "holes in the reference alone", static_cast<double>(only_reference), "samples");
  tell(into, "holes in the other alone, and what lies beyond it", static_cast<double>(only_other),
       "samples");
  tell(into, "holes in both", static_cast<double>(both), "samples");
  tell(into, "beyond the other's extent", static_cast<double>(pair.beyond), "samples");
  if (scope.has_box())
    tell(into, "outside the area and heights", static_cast<double>(pair.outside), "samples");
  tell_ignored(into, "", static_cast<double>(pair.ignored),
               static_cast<double>(pair.ignored + compared), "samples", scope);
}

/// Horizontal shift of the other DEM, fitted by least squares to e = c - slope . shift, and the
/// fraction of the errors' variance that it explains.
struct Shift {
  glm::dvec2 shift_m{0};
  double explained = 0;
};

std::optional<Shift> fitted_shift(const std::vector<Sample>& samples) {
  glm::dmat3 normal(0);
  glm::dvec3 right(0);
  double squares = 0, sum = 0, count = 0;
  for (const Sample& sample : samples) {
    if (std::isnan(sample.slope.x) || std::isnan(sample.slope.y)) continue;
    const glm::dvec3 row(-sample.slope.x, -sample.slope.y, 1);
    normal += glm::outerProduct(row, row);
    right += row * sample.error_m;
    squares += sample.error_m * sample.error_m;
    sum += sample.error_m;
    ++count;
  }
  if (count < 10 || !(std::abs(glm::determinant(normal)) > 0)) return std::nullopt;
  const glm::dvec3 solution = glm::inverse(normal) * right;
  const double about_mean = squares - sum * sum / count;
  const double left = squares - glm::dot(solution, right);
  if (!(about_mean > 0)) return std::nullopt;
  return Shift{glm::dvec2(solution), 1 - left / about_mean};
}

void suspect_shift(const DemPair& pair, const std::vector<Sample>& samples, Section& into) {
  const auto fit = fitted_shift(samples);
  if (!fit || !(fit->explained > 0.5)) return;
  const glm::dvec2 cells = glm::abs(fit->shift_m * pair.frame.cells_per_m);
  const double most_cells = std::max(cells.x, cells.y);
  if (!(0.05 < most_cells && most_cells < 3)) return;
  into.text += fmt::format(
      "THE OTHER SEEMS TO BE SHIFTED: by {:.3g} m to the east and {:.3g} m to the north ({:.2g} "
      "and {:.2g} cells), which explains {:.0f} % of the errors' variance. Mistaking pixel centres "
      "for corners shifts by half a cell (GeoTIFF's PixelIsArea and PixelIsPoint).\n",
      fit->shift_m.x, fit->shift_m.y, cells.x, cells.y, 100 * fit->explained);
}

/// Draws both DEMs and their differences, with the positions of the edges in W.
void draw(const DemPair& pair, const glm::dvec3& origin_w_m, Section& into) {
  const ImageLayer reference{"height", LayerKind::Number, {"height"}, pair.reference.m};
  const ImageLayer other{"height", LayerKind::Number, {"height"}, pair.other.m};
  Image<double> differences = pair.other.m;
  for (int row = 0; row < pair.samples().y; ++row) {
    for (int column = 0; column < pair.samples().x; ++column) {
      double& difference = differences.at(column, row)[0];
      difference = pair.has(column, row) ? difference - pair.reference(column, row) : no_height;
    }
  }
  draw_layers(reference, other, differences, " m", into);
  const glm::dvec2 first =
      pair.frame.to_D({0, 0}) + glm::dvec2(origin_w_m) - pair.frame.step_m / 2.0;
  const glm::dvec2 end = first + pair.frame.step_m * glm::dvec2(pair.samples());
  for (Picture& picture : into.pictures) {
    picture.across = Axis{"east, m", first.x, end.x};
    picture.up = Axis{"north, m", end.y, first.y};
  }
}

void write_dem_headline(std::size_t samples, Section& into) {
  into.main = {"height: mean error", "height: RMS error", std::string(nmad_name),
               "height: 95th percentile of its size", "height: largest error"};
  const std::vector<Measure> found = main_measures(into);
  into.headline = fmt::format(
      "The other's heights differ from the reference's by {:.4g} m RMS and {:.4g} m on average, by "
      "{:.4g} m at most, at {} samples.",
      found[1].value, found[0].value, found[4].value, samples);
  if (found[4].value == 0)
    into.headline = fmt::format("The heights of all {} samples are equal.", samples);
}

void say_how(const DemPair& pair, const Dem& other, Section& into) {
  into.text +=
      fmt::format("{} x {} samples of the reference, {} x {} of the other; ", pair.samples().x,
                  pair.samples().y, other.grid.columns(), other.grid.rows());
  into.text += pair.interpolated == 0 ? "compared sample by sample.\n"
                                      : fmt::format(
                                            "at {} of the reference's samples the other's height "
                                            "is interpolated on its triangles.\n",
                                            pair.interpolated);
}

/// Returns the gdalwarp arguments that select the reference's CRS: its EPSG code if it has one,
/// else its WKT.
std::string warp_words(const Dem& reference, const std::string& file) {
  const std::size_t code = reference.crs_name.rfind("(EPSG:");
  if (code != std::string::npos && reference.crs_name.ends_with(')'))
    return "-t_srs " + reference.crs_name.substr(code + 1, reference.crs_name.size() - code - 2);
  return fmt::format("-t_srs \"$(gdalsrsinfo -o wkt2_2018 --single-line '{}')\"", file);
}

void check_dem_crs(const Dem& reference, const Dem& other, const std::string& reference_file,
                   const std::string& other_file) {
  if (reference.crs_wkt.empty() || other.crs_wkt.empty() || reference.crs_wkt == other.crs_wkt)
    return;
  const bool has_code = reference.crs_name.find("(EPSG:") != std::string::npos;
  if (has_code && reference.crs_name == other.crs_name) return;  // WKT differs between programs
  if (is_same_crs(reference.crs_wkt, other.crs_wkt)) return;
  throw Error(
      "{}: its reference system is {} and that of {} is {}; they must be the same; run\n"
      "  gdalwarp {} -r bilinear '{}' other_as_reference.tif",
      other_file, other.crs_name, reference_file, reference.crs_name,
      warp_words(reference, reference_file), other_file);
}

[[noreturn]] void refuse_dems(const Dem& reference, const Dem& other, const DemPair& pair) {
  if (pair.outside + pair.ignored > 0) {
    throw Error(
        "no sample that both have is left: {} of {} are outside the area and heights, and at {} "
        "the "
        "heights differ by more than the distance beyond which they are ignored",
        pair.outside, pair.is_left_out.size(), pair.ignored);
  }
  const glm::dvec2 from = reference.grid.origin_m() + glm::dvec2(reference.origin_w_m);
  const glm::dvec2 other_from = other.grid.origin_m() + glm::dvec2(other.origin_w_m);
  throw Error(
      "they do not overlap: the first sample of the reference is at east {} m, north {} m, that of "
      "the other at east {} m, north {} m",
      from.x, from.y, other_from.x, other_from.y);
}

}  // namespace

Section compare_dems(const std::filesystem::path& reference, const std::filesystem::path& other,
                     const DemReadings& readings, const Scope& scope) {
  const Dem of_reference = load_dem(reference, readings.reference);
  const Dem of_other = load_dem(other, readings.other);
  check_dem_crs(of_reference, of_other, reference.string(), other.string());
  Section section;
  try {
    section = compare_dems(of_reference, of_other,
                           fmt::format("{} against {}", other.string(), reference.string()), scope);
  } catch (const Error& fault) {
    throw Error("{} cannot be compared with {}: {}", other.string(), reference.string(),
                fault.what());
  }
  if (of_reference.crs_wkt.empty() != of_other.crs_wkt.empty()) {
    section.text +=
        fmt::format("The {} has no coordinate reference system: that of the {} is assumed.\n",
                    of_other.crs_wkt.empty() ? "other" : "reference",
                    of_other.crs_wkt.empty() ? "reference" : "other");
  }
  return section;
}

Section compare_dems(const Dem& reference, const Dem& other, const std::string& title,
                     const Scope& scope) {
  check_scope(scope);
  const DemPair pair = paired(reference, other, scope);
  const std::vector<Sample> samples = samples_of(pair);
  if (samples.empty()) refuse_dems(reference, other, pair);
  Section section;
  section.title = title;
  section.text = scope_text(scope, "W, the DEMs' coordinate reference system,");
  say_how(pair, other, section);
  tell(section, "samples that both have", static_cast<double>(samples.size()), "samples");
  tell_holes(pair, scope, samples.size(), section);
  tell_vertical(pair, reference.origin_w_m, samples, section);
  tell_by_slope(samples, section);
  tell_slopes(pair, section);
  suspect_shift(pair, samples, section);
  draw(pair, reference.origin_w_m, section);
  write_dem_headline(samples.size(), section);
  section.verdict = verdict_of(section.measures);
  return section;
}

}  // namespace groundray::golden
