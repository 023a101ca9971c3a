#include "apps/view/compare/deviation.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "apps/scene/interruption.h"
#include "apps/view/layers/dem_layer.h"
#include "core/error.h"
#include "core/quantile.h"
#include "reconstruction/mesh/accuracy/accuracy.h"
#include "terrain/dem/dem_io.h"

namespace groundray {
namespace {

constexpr float not_measured = std::numeric_limits<float>::quiet_NaN();
constexpr std::size_t histogram_bins = 61;
constexpr const char* column_name = "deviation";
constexpr std::size_t block_places = 65'536;  // points between two checks of the stop token

// Computes one deviation for each point on all cores, with checks of the stop token in between.
// @param measure  called with the first index, the end index and the output array.
template <typename Measure>
Deviation measured(std::size_t count, const std::stop_token& stop, const ShareDone& progress,
                   const Measure& measure) {
  Deviation deviation{.signed_m = std::vector<float>(count, not_measured), .figures = {}};
  for (std::size_t begin = 0; begin < count; begin += block_places) {
    if (stop.stop_requested()) throw Interrupted{};
    if (progress) progress(static_cast<double>(begin) / static_cast<double>(count));
    const std::size_t end = std::min(begin + block_places, count);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 256),
                      [&](const tbb::blocked_range<std::size_t>& some) {
                        measure(some.begin(), some.end(), deviation.signed_m);
                      });
  }
  if (progress) progress(1);
  deviation.figures = figures_of(deviation.signed_m);
  return deviation;
}

std::vector<double> known(const std::vector<float>& signed_m) {
  std::vector<double> values;
  values.reserve(signed_m.size());
  for (const float value : signed_m) {
    if (std::isfinite(value)) values.push_back(value);
  }
  return values;
}

std::string length_text(double length_m) {
  return std::isnan(length_m) ? "none" : fmt::format("{:.4g} m", length_m);
}

std::vector<glm::dvec3> places_m(const Layer& layer, const glm::dvec3& origin_w_m) {
  std::vector<glm::dvec3> places(layer.points());
  for (std::size_t i = 0; i < places.size(); ++i) {
    places[i] = layer.p_w_m(static_cast<vtkIdType>(i)) - origin_w_m;
  }
  return places;
}

TriangleMesh mesh_of(const Layer& layer, const glm::dvec3& origin_w_m) {
  TriangleMesh mesh;
  mesh.vertices_m = places_m(layer, origin_w_m);
  const std::span<const std::int32_t> numbers = corners(*layer.data);
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
    mesh.triangles.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  }
  if (mesh.triangles.empty()) {
    throw Error("{}: has no triangle, so distances to it are undefined", layer.name);
  }
  return mesh;
}

std::vector<Agreement> agreements_of(const Layer& layer, const TriangleMesh& truth,
                                     const glm::dvec3& origin_w_m, double tolerance_m,
                                     const std::stop_token& stop) {
  if (tolerance_m <= 0 || layer.triangles() == 0) return {};
  const std::array<double, 1> tolerances_m{tolerance_m};
  return agreement_until(mesh_of(layer, origin_w_m), truth, tolerances_m, stop);
}

}  // namespace

Deviation deviation_from_ground(const std::vector<glm::dvec3>& places_m, const Ground& truth,
                                const std::stop_token& stop, const ShareDone& progress) {
  return measured(places_m.size(), stop, progress,
                  [&](std::size_t begin, std::size_t end, std::vector<float>& into) {
                    for (std::size_t i = begin; i < end; ++i) {
                      const glm::dvec3& p = places_m[i];
                      if (!std::isfinite(p.x + p.y + p.z)) continue;
                      if (const auto ground_m = truth.height_m_at(glm::dvec2(p)))
                        into[i] = static_cast<float>(p.z - *ground_m);
                    }
                  });
}

Deviation deviation_from_mesh(const std::vector<glm::dvec3>& places_m, const TrueMesh& truth,
                              const std::stop_token& stop, const ShareDone& progress) {
  return measured(places_m.size(), stop, progress,
                  [&](std::size_t begin, std::size_t end, std::vector<float>& into) {
                    std::uint32_t near = 0;
                    for (std::size_t i = begin; i < end; ++i) {
                      into[i] = static_cast<float>(truth.signed_distance_m(places_m[i], near));
                    }
                  });
}

// The weight function is called for every sample of the surface, so it can throw on a stop request.
std::vector<Agreement> agreement_until(const TriangleMesh& mesh, const TriangleMesh& truth,
                                       std::span<const double> tolerances_m,
                                       const std::stop_token& stop) {
  const SurfaceWeight all_alike = [&](std::uint32_t, const glm::dvec3&) {
    if (stop.stop_requested()) throw Interrupted{};
    return 1.0;
  };
  const auto precision = MeshDistance(mesh, truth).within(tolerances_m, {}, all_alike);
  const auto completeness = MeshDistance(truth, mesh).within(tolerances_m, {}, all_alike);
  std::vector<Agreement> all;
  for (std::size_t k = 0; k < tolerances_m.size(); ++k)
    all.push_back({tolerances_m[k], precision[k], completeness[k]});
  return all;
}

DeviationFigures figures_of(const std::vector<float>& signed_m) {
  std::vector<double> values = known(signed_m);
  DeviationFigures figures{.count = values.size(), .beyond = signed_m.size() - values.size()};
  double sum_m = 0, sum2_m2 = 0;
  for (const double value : values) {
    sum_m += value;
    sum2_m2 += value * value;
  }
  const auto count = static_cast<double>(values.size());
  figures.mean_m = sum_m / count;
  figures.rms_m = std::sqrt(sum2_m2 / count);
  if (values.empty()) {
    figures.median_m = figures.nmad_m = figures.p95_m = figures.largest_m = figures.low_m =
        figures.high_m = not_measured;
    return figures;
  }
  const auto [low, high] = std::ranges::minmax(values);
  figures.low_m = low;
  figures.high_m = high;
  figures.largest_m = std::max(std::abs(low), std::abs(high));
  figures.median_m = median(values);
  figures.nmad_m = nmad(values);
  for (double& value : values) value = std::abs(value);
  figures.p95_m = quantile(std::move(values), 0.95);
  return figures;
}

DeviationHistogram histogram_of(const std::vector<float>& signed_m, std::size_t bins,
                                std::optional<std::pair<double, double>> range_m) {
  std::vector<double> values = known(signed_m);
  if (!range_m) {
    range_m = {-1e-3, 1e-3};
    if (!values.empty()) {
      const double low = std::min(quantile(values, 0.005), 0.0);
      const double high = std::max(quantile(values, 0.995), 0.0);
      if (low < high) range_m = {low, high};
    }
  }
  const auto [low, high] = *range_m;
  if (bins == 0 || !(low < high) || !std::isfinite(high - low))
    throw Error("a histogram of {} bins from {} to {} m is empty: are its limits swapped?", bins,
                low, high);
  DeviationHistogram histogram{low, high, std::vector<std::size_t>(bins), 0, 0};
  for (const double value : values) {
    if (value < low) {
      ++histogram.below;
    } else if (value > high) {
      ++histogram.above;
    } else {
      const auto bin =
          static_cast<std::size_t>((value - low) / (high - low) * static_cast<double>(bins));
      ++histogram.counts[std::min(bin, bins - 1)];
    }
  }
  return histogram;
}

std::vector<std::pair<std::string, std::string>> figure_texts(const DeviationFigures& figures) {
  return {{"points", fmt::format("{}", figures.count)},
          {"beyond the truth", fmt::format("{}", figures.beyond)},
          {"mean", length_text(figures.mean_m)},
          {"RMS", length_text(figures.rms_m)},
          {"median", length_text(figures.median_m)},
          {"NMAD", length_text(figures.nmad_m)},
          {"95 % within", length_text(figures.p95_m)},
          {"largest", length_text(figures.largest_m)},
          {"lowest", length_text(figures.low_m)},
          {"highest", length_text(figures.high_m)}};
}

std::vector<std::string> figure_lines(const DeviationFigures& figures) {
  std::vector<std::string> lines;
  for (const auto& [name, value] : figure_texts(figures)) {
    if (name != "beyond the truth" && name != "largest")
      lines.push_back(fmt::format("{} {}", name, value));
  }
  if (figures.beyond > 0)
    lines.push_back(fmt::format("{} points beyond the truth", figures.beyond));
  return lines;
}

std::vector<std::string> agreement_lines(const std::vector<Agreement>& agreements) {
  std::vector<std::string> lines;
  for (const Agreement& at : agreements) {
    lines.push_back(fmt::format("within {}: precision {:.2f} %, completeness {:.2f} %, F1 {:.2f} %",
                                length_text(at.tolerance_m), 100 * at.precision.value,
                                100 * at.completeness.value, 100 * at.f1().value));
  }
  return lines;
}

Comparison compare(const Layer& layer, const Truth& truth, double tolerance_m,
                   const std::stop_token& stop, const ShareDone& progress) {
  Comparison comparison;
  comparison.layer = layer.name;
  comparison.truth = truth.name;
  if (const auto* simulation = std::get_if<std::shared_ptr<const Simulation>>(&truth.what)) {
    const Terrain& terrain = (*simulation)->terrain;
    comparison.deviation = deviation_from_ground(places_m(layer, terrain.header().origin_w_m),
                                                 terrain.ground(), stop, progress);
  } else if (const auto* file = std::get_if<Truth::DemFile>(&truth.what)) {
    const Dem dem = load_dem(file->path, options_for(file->path));
    comparison.deviation =
        deviation_from_ground(places_m(layer, dem.origin_w_m), dem.grid, stop, progress);
  } else {
    const Layer& surface = std::get<Layer>(truth.what);
    const TriangleMesh mesh = mesh_of(surface, surface.origin_w_m);
    comparison.deviation =
        deviation_from_mesh(places_m(layer, surface.origin_w_m), TrueMesh(mesh), stop, progress);
    comparison.agreements = agreements_of(layer, mesh, surface.origin_w_m, tolerance_m, stop);
  }
  if (comparison.deviation.figures.count == 0) {
    throw Error("{} has no point near {}: are both in the same frame?", layer.name, truth.name);
  }
  comparison.histogram = histogram_of(comparison.deviation.signed_m, histogram_bins);
  return comparison;
}

Layer coloured_by_deviation(Layer layer, const Comparison& comparison) {
  const auto data = vtkSmartPointer<vtkPolyData>::New();
  data->ShallowCopy(layer.data);  // the view draws the old data until it receives this layer
  layer.data = data;
  layer.actor = nullptr;
  layer.coarse = nullptr;  // lacks the column
  std::erase_if(layer.columns, [](const LayerColumn& each) { return each.name == column_name; });
  add_column(layer, {.name = column_name, .unit = "m", .scale = ColourScale::Signed},
             comparison.deviation.signed_m);
  const DeviationFigures& figures = comparison.deviation.figures;
  if (figures.p95_m > 0) layer.columns.back().range = {-figures.p95_m, figures.p95_m};
  layer.coloured_by = column_name;
  return layer;
}

}  // namespace groundray
