#include "apps/view/rendering/layer.h"

#include <vtkCellData.h>
#include <vtkFloatArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace groundray {
namespace {

vtkDataSetAttributes* attributes(const Layer& layer, LayerColumn::Of of) {
  if (of == LayerColumn::Of::Points) return layer.data->GetPointData();
  return layer.data->GetCellData();
}

std::size_t rows(const Layer& layer, LayerColumn::Of of) {
  return static_cast<std::size_t>(of == LayerColumn::Of::Points ? layer.data->GetNumberOfPoints()
                                                                : layer.data->GetNumberOfCells());
}

void check_length(const Layer& layer, const LayerColumn& column, std::size_t values) {
  if (values == rows(layer, column.of)) return;
  throw Error("column '{}' of layer '{}' has {} rows, its data {}: both must have the same number",
              column.name, layer.name, values, rows(layer, column.of));
}

void put(Layer& layer, LayerColumn column) {
  std::erase_if(layer.columns, [&](const LayerColumn& old) { return old.name == column.name; });
  layer.columns.push_back(std::move(column));
}

}  // namespace

std::size_t Layer::points() const { return static_cast<std::size_t>(data->GetNumberOfPoints()); }

std::size_t Layer::triangles() const { return static_cast<std::size_t>(data->GetNumberOfPolys()); }

const LayerColumn* Layer::find(const std::string& column) const {
  const auto found = std::ranges::find(columns, column, &LayerColumn::name);
  return found == columns.end() ? nullptr : &*found;
}

double Layer::value(const LayerColumn& column, vtkIdType row) const {
  vtkDataArray* const array = attributes(*this, column.of)->GetArray(column.name.c_str());
  if (array == nullptr || row < 0 || row >= array->GetNumberOfTuples())
    return std::numeric_limits<double>::quiet_NaN();
  return array->GetComponent(row, 0);
}

glm::dvec3 Layer::p_w_m(vtkIdType point) const {
  glm::dvec3 p;
  data->GetPoint(point, &p.x);
  return p + origin_w_m;
}

void add_column(Layer& layer, LayerColumn column, std::span<const float> values) {
  check_length(layer, column, values.size());
  const auto array = make_array<vtkFloatArray>(column.name.c_str(), values.size());
  std::ranges::copy(values, array->GetPointer(0));
  attributes(layer, column.of)->AddArray(array);
  column.range = colour_range(values, column.scale);
  put(layer, std::move(column));
}

void add_colours(Layer& layer, LayerColumn column, std::span<const std::uint8_t> rgb) {
  check_length(layer, column, rgb.size() / 3);
  const auto array = make_array<vtkUnsignedCharArray>(column.name.c_str(), rgb.size() / 3, 3);
  std::ranges::copy(rgb, array->GetPointer(0));
  attributes(layer, column.of)->AddArray(array);
  column.is_rgb = true;
  column.range = {0, 255};
  put(layer, std::move(column));
}

void move_frame(Layer& layer, const glm::dvec3& origin_w_m) {
  if (!std::isfinite(origin_w_m.x + origin_w_m.y + origin_w_m.z))
    throw Error("layer '{}': the origin of its coordinates must be finite", layer.name);
  const glm::dvec3 by_m = origin_w_m - layer.frame_w_m;
  layer.frame_w_m = origin_w_m;
  layer.origin_w_m += by_m;
  layer.actor = nullptr;
  const LayerColumn* const height = layer.find("height");
  if (height == nullptr || height->of != LayerColumn::Of::Points || by_m.z == 0) return;
  LayerColumn column = *height;
  std::vector<float> values(layer.points());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double before_m = layer.value(column, static_cast<vtkIdType>(i));
    values[i] = static_cast<float>(before_m + by_m.z);
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();  // the old one may be in use elsewhere
  data->ShallowCopy(layer.data);
  layer.data = data;
  layer.coarse = nullptr;
  add_column(layer, std::move(column), values);
}

glm::dvec2 colour_range(std::span<const float> values, ColourScale scale) {
  std::vector<float> finite;
  finite.reserve(values.size());
  for (const float value : values) {
    if (std::isfinite(value)) finite.push_back(value);
  }
  if (finite.empty()) return {0, 1};
  const auto least_and_greatest = std::ranges::minmax(finite);
  double low = least_and_greatest.min, high = least_and_greatest.max;
  const auto quantile = [&](std::size_t rank) {
    std::ranges::nth_element(finite, finite.begin() + static_cast<std::ptrdiff_t>(rank));
    return static_cast<double>(finite[rank]);
  };
  const std::size_t few = finite.size() / 200;
  const double usual_low = quantile(few), usual_high = quantile(finite.size() - 1 - few);
  if (usual_high > usual_low && high - low > 2 * (usual_high - usual_low)) {
    low = usual_low;
    high = usual_high;
  }
  if (scale == ColourScale::Signed && low < 0 && high > 0) {
    high = std::max(high, -low);
    low = -high;
  }
  return {low, high};
}

vtkSmartPointer<vtkPolyData> make_points(std::size_t points) {
  auto places = vtkSmartPointer<vtkPoints>::New();
  places->SetNumberOfPoints(static_cast<vtkIdType>(points));
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(places);
  std::ranges::fill(coordinates(*data), 0.0f);
  return data;
}

std::span<float> coordinates(vtkPolyData& data) {
  auto* const array = vtkFloatArray::SafeDownCast(data.GetPoints()->GetData());
  if (array == nullptr) throw Error("a layer's points must be floats");
  return {array->GetPointer(0), static_cast<std::size_t>(array->GetNumberOfValues())};
}

vtkSmartPointer<vtkCellArray> make_cells(std::size_t cells, std::size_t corners) {
  auto made = vtkSmartPointer<vtkCellArray>::New();
  made->Use32BitStorage();
  made->AllocateExact(static_cast<vtkIdType>(cells), static_cast<vtkIdType>(corners));
  return made;
}

void set_triangles(vtkPolyData& data, std::span<const glm::uvec3> triangles) {
  const auto cells = make_cells(triangles.size(), 3 * triangles.size());
  for (const glm::uvec3& corner : triangles) cells->InsertNextCell({corner.x, corner.y, corner.z});
  data.SetPolys(cells);
}

void set_lines(vtkPolyData& data, std::span<const std::size_t> lengths) {
  const auto cells = make_cells(lengths.size(), 0);
  vtkIdType next = 0;
  for (const std::size_t length : lengths) {
    cells->InsertNextCell(static_cast<int>(length));
    for (std::size_t i = 0; i < length; ++i) cells->InsertCellPoint(next++);
  }
  data.SetLines(cells);
}

std::span<const std::int32_t> corners(vtkPolyData& data) {
  vtkCellArray* const polys = data.GetPolys();
  if (polys->GetNumberOfCells() == 0) return {};
  polys->ConvertTo32BitStorage();
  auto* const points = polys->GetConnectivityArray32();
  return {points->GetPointer(0), static_cast<std::size_t>(points->GetNumberOfValues())};
}

}  // namespace groundray
