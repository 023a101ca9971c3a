#include "apps/view/rendering/shown_layer.h"

#include <vtkCellData.h>
#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkPlane.h>
#include <vtkPointData.h>
#include <vtkProperty.h>

#include "apps/view/rendering/coarse_layer.h"
#include "apps/view/rendering/colour_table.h"
#include "core/error.h"

namespace groundray {
namespace {

// Returns points with a single VTK cell that contains all of them.
vtkSmartPointer<vtkPolyData> with_vertices(vtkPolyData& points) {
  const vtkIdType count = points.GetNumberOfPoints();
  const auto cells = make_cells(1, static_cast<std::size_t>(count));
  if (count > 0) cells->InsertNextCell(static_cast<int>(count));
  for (vtkIdType i = 0; i < count; ++i) cells->InsertCellPoint(i);
  auto drawn = vtkSmartPointer<vtkPolyData>::New();
  drawn->SetPoints(points.GetPoints());
  drawn->GetPointData()->ShallowCopy(points.GetPointData());
  drawn->SetVerts(cells);
  return drawn;
}

void check(const Layer& layer) {
  if (layer.data == nullptr || layer.data->GetPoints() == nullptr)
    throw Error("layer '{}' has no data: a layer must have points", layer.name);
  for (const LayerColumn& column : layer.columns) {
    vtkDataSetAttributes* const of =
        column.of == LayerColumn::Of::Points
            ? static_cast<vtkDataSetAttributes*>(layer.data->GetPointData())
            : layer.data->GetCellData();
    if (of->GetArray(column.name.c_str()) == nullptr)
      throw Error("layer '{}' lists a column '{}' that its data does not have", layer.name,
                  column.name);
  }
}

vtkSmartPointer<vtkPolyDataMapper> make_mapper(const Layer& layer, vtkPolyData& data) {
  auto mapper = vtkSmartPointer<vtkPolyDataMapper>::New();
  mapper->SetInputData(layer.kind == LayerKind::Cloud ? with_vertices(data).Get() : &data);
  return mapper;
}

bool is_lit(LayerKind kind) { return kind == LayerKind::Terrain || kind == LayerKind::Mesh; }

}  // namespace

ShownLayer::ShownLayer(Layer layer, const glm::dvec3& origin_w_m)
    : layer_(std::move(layer)), view_origin_w_m_(origin_w_m) {
  check(layer_);
  full_ = make_mapper(layer_, *layer_.data);
  layer_.actor = vtkSmartPointer<vtkActor>::New();
  const glm::dvec3 place = layer_.origin_w_m - origin_w_m;
  layer_.actor->SetPosition(place.x, place.y, place.z);
  layer_.actor->SetMapper(full_);
  restyle();
}

// A texture replaces an RGB column, since it shows the same in more detail.
bool ShownLayer::is_textured(vtkPolyDataMapper& mapper) const {
  const LayerColumn* const column = layer_.find(layer_.coloured_by);
  return layer_.texture != nullptr && (column == nullptr || column->is_rgb) &&
         mapper.GetInput()->GetPointData()->GetTCoords() != nullptr;
}

bool ShownLayer::is_cut(vtkPolyDataMapper& mapper) const {
  return layer_.mask != nullptr && mapper.GetInput()->GetPointData()->GetTCoords() != nullptr;
}

void ShownLayer::paint(vtkPolyDataMapper& mapper) const {
  const LayerColumn* const column = layer_.find(layer_.coloured_by);
  const bool is_coloured = column != nullptr && !is_textured(mapper);
  mapper.SetScalarVisibility(is_coloured ? 1 : 0);
  if (!is_coloured) return;
  mapper.SetScalarMode(column->of == LayerColumn::Of::Points ? VTK_SCALAR_MODE_USE_POINT_FIELD_DATA
                                                             : VTK_SCALAR_MODE_USE_CELL_FIELD_DATA);
  mapper.SelectColorArray(column->name.c_str());
  if (column->is_rgb) {
    mapper.SetColorModeToDirectScalars();
    return;
  }
  mapper.SetColorModeToMapScalars();
  mapper.SetLookupTable(make_colour_table(*column));
  mapper.UseLookupTableScalarRangeOn();
  // Categories have no intermediate values; and VTK would look colours up in a texture, whose
  // coordinates would replace those of a mask.
  mapper.SetInterpolateScalarsBeforeMapping(column->categories.empty() && !is_cut(mapper) ? 1 : 0);
}

void ShownLayer::restyle() {
  paint(*full_);
  if (thin_ != nullptr) paint(*thin_);
  vtkActor& actor = *layer_.actor;
  vtkProperty& property = *actor.GetProperty();
  property.SetOpacity(layer_.opacity);
  property.SetPointSize(static_cast<float>(layer_.point_size_px));
  property.SetLineWidth(static_cast<float>(layer_.line_width_px));
  property.SetLighting(is_lit(layer_.kind) && !layer_.wireframe);
  // Colours that represent values match the legend where the surface is lit most brightly.
  const LayerColumn* const column = layer_.find(layer_.coloured_by);
  const bool is_legend = column != nullptr && !column->is_rgb;
  property.SetAmbient(!property.GetLighting() ? 0.0 : is_legend ? 0.25 : 0.17);
  property.SetDiffuse(is_legend && property.GetLighting() ? 0.62 : 1.0);
  property.SetSpecular(0);
  property.SetInterpolationToPhong();
  property.SetRepresentation(layer_.wireframe ? VTK_WIREFRAME : VTK_SURFACE);
  actor.SetVisibility(layer_.visible ? 1 : 0);
  draw(vtkPolyDataMapper::SafeDownCast(actor.GetMapper()));
}

void ShownLayer::clip(const std::optional<ClipBox>& box) {
  planes_ = nullptr;
  if (box && layer_.is_clipped) {
    planes_ = vtkSmartPointer<vtkPlaneCollection>::New();
    const glm::dvec3 low = box->low_w_m - view_origin_w_m_, high = box->high_w_m - view_origin_w_m_;
    for (glm::length_t k = 0; k < 3; ++k) {
      for (const auto& [corner, sign] : {std::pair(low, 1.0), {high, -1.0}}) {
        glm::dvec3 inwards(0);
        inwards[k] = sign;
        const vtkNew<vtkPlane> plane;
        plane->SetOrigin(corner.x, corner.y, corner.z);
        plane->SetNormal(inwards.x, inwards.y, inwards.z);
        planes_->AddItem(plane);
      }
    }
  }
  full_->SetClippingPlanes(planes_);
  if (thin_ != nullptr) thin_->SetClippingPlanes(planes_);
}

std::size_t ShownLayer::elements() const {
  return layer_.kind == LayerKind::Cloud ? layer_.points() : layer_.triangles();
}

void ShownLayer::thin_to(std::size_t elements) {
  if (elements >= this->elements() || layer_.wireframe) {
    draw_full();
    return;
  }
  if (thin_ == nullptr || thinned_to_ != elements) {
    const bool is_cloud = layer_.kind == LayerKind::Cloud;
    const bool serves = layer_.coarse != nullptr &&
                        static_cast<std::size_t>(layer_.coarse->GetNumberOfPolys()) <= elements;
    const auto thin = is_cloud ? thin_points(layer_, elements)
                      : serves ? layer_.coarse
                               : thin_triangles(layer_, elements);
    // Clustered vertices no longer match their texture coordinates.
    if (!is_cloud && !serves && thin != layer_.data) thin->GetPointData()->SetTCoords(nullptr);
    thin_ = make_mapper(layer_, *thin);
    thin_->SetClippingPlanes(planes_);
    thinned_to_ = elements;
    paint(*thin_);
  }
  draw(thin_);
}

void ShownLayer::draw_full() { draw(full_); }

void ShownLayer::draw(vtkPolyDataMapper* mapper) {
  vtkActor& actor = *layer_.actor;
  actor.SetMapper(mapper);
  const bool textured = is_textured(*mapper);
  const bool cut = is_cut(*mapper);
  actor.SetTexture(textured ? layer_.texture.Get() : cut ? layer_.mask.Get() : nullptr);
  // Without this, VTK would blend surfaces with alpha, in an arbitrary order.
  actor.SetForceOpaque(cut && layer_.opacity >= 1);
  const glm::vec3 colour = textured ? glm::vec3(1) : layer_.colour;
  actor.GetProperty()->SetColor(colour.r, colour.g, colour.b);
}

}  // namespace groundray
