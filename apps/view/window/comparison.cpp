#include "apps/view/window/comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "apps/view/layers/dem_layer.h"
#include "core/error.h"
#include "terrain/dem/dem_io.h"

namespace groundray {
namespace {

constexpr std::size_t bins = 61;
constexpr const char* column_name = "deviation";

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

Comparison compare(const Layer& layer, const Truth& truth, double tolerance_m,
                   const std::stop_token& stop, const ShareDone& progress) {
  Comparison comparison;
  comparison.layer = layer.name;
  comparison.truth = truth.name;
  if (const auto* simulation = std::get_if<std::shared_ptr<const Simulation>>(&truth.what)) {
    const Terrain& terrain = (*simulation)->terrain;
    comparison.deviation = deviation_from_ground(places_m(layer, terrain.header().origin_w_m),
                                                 terrain.ground(), glm::dvec3(0), stop, progress);
  } else if (const auto* file = std::get_if<Truth::DemFile>(&truth.what)) {
    const Dem dem = load_dem(file->path, options_for(file->path));
    comparison.deviation = deviation_from_ground(places_m(layer, dem.origin_w_m), dem.grid,
                                                 glm::dvec3(0), stop, progress);
  } else {
    const Layer& surface = std::get<Layer>(truth.what);
    const TriangleMesh mesh = mesh_of(surface, surface.origin_w_m);
    comparison.deviation = deviation_from_mesh(places_m(layer, surface.origin_w_m), TrueMesh(mesh),
                                               glm::dvec3(0), stop, progress);
    comparison.agreements = agreements_of(layer, mesh, surface.origin_w_m, tolerance_m, stop);
  }
  if (comparison.deviation.figures.count == 0) {
    throw Error("{} has no point near {}: are both in the same frame?", layer.name, truth.name);
  }
  comparison.histogram = histogram_of(comparison.deviation.signed_m, bins);
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
