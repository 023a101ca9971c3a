#include "apps/view/rendering/view.h"

#include <vtkAutoInit.h>
#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkNew.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <utility>

#include "apps/view/rendering/legend.h"
#include "apps/view/rendering/moving_detail.h"
#include "apps/view/rendering/shown_layer.h"
#include "core/error.h"

// VTK's object factories. vtk_module_autoinit would define a macro with the path of the build tree,
// which would keep clones in other folders from sharing objects in the compiler cache.
VTK_MODULE_INIT(vtkRenderingOpenGL2)
VTK_MODULE_INIT(vtkRenderingFreeType)

namespace groundray {
namespace {

constexpr double near_px = 6, view_angle_deg = 40;
constexpr int tile_px = 4096;
constexpr glm::dvec3 sky{0.40, 0.50, 0.62}, haze{0.80, 0.83, 0.86};  // upper and lower background

bool is_surface(const Layer& layer) {
  return layer.kind == LayerKind::Terrain || layer.kind == LayerKind::Mesh;
}

// Sun in the north-west, as in shaded maps, with light from the sky and from the eye.
void add_lights(vtkRenderer& renderer) {
  renderer.AutomaticLightCreationOff();
  const auto add = [&](glm::dvec3 from, double strength, const glm::dvec3& colour) {
    vtkNew<vtkLight> light;
    light->SetLightTypeToSceneLight();
    light->PositionalOff();
    light->SetPosition(from.x, from.y, from.z);
    light->SetFocalPoint(0, 0, 0);
    light->SetIntensity(strength);
    light->SetColor(colour.x, colour.y, colour.z);
    renderer.AddLight(light);
  };
  add({-0.60, 0.45, 0.70}, 0.74, {1.0, 0.97, 0.91});
  add({0.1, -0.2, 1}, 0.22, {0.85, 0.92, 1.0});
  vtkNew<vtkLight> eye;
  eye->SetLightTypeToHeadlight();
  eye->SetIntensity(0.40);
  renderer.AddLight(eye);
}

// Copies the window's pixels into a rectangle of a picture.
void read_pixels(vtkRenderWindow& window, glm::ivec2 first_px, glm::ivec2 size_px, Image8& into) {
  vtkNew<vtkUnsignedCharArray> bytes;
  window.GetPixelData(0, 0, size_px.x - 1, size_px.y - 1, 1, bytes, 0);
  const auto row = static_cast<std::size_t>(size_px.x) * 3;
  for (int y = 0; y < size_px.y; ++y) {
    const auto from = static_cast<std::size_t>(size_px.y - 1 - y) * row;
    std::copy_n(bytes->GetPointer(0) + from, row, into.at(first_px.x, first_px.y + y).data());
  }
}

}  // namespace

struct View::Impl {
  vtkSmartPointer<vtkRenderWindow> window;
  vtkSmartPointer<vtkRenderer> renderer = vtkSmartPointer<vtkRenderer>::New();
  std::vector<std::unique_ptr<ShownLayer>> layers;
  std::unique_ptr<Legend> legend;
  std::string legend_layer;  // layer whose legend is shown
  std::optional<glm::dvec3> origin_w_m;
  bool is_moving = false, is_legend_visible = true;
  MovingDetail detail;

  glm::dvec3 origin() const { return origin_w_m.value_or(glm::dvec3(0)); }
  ShownLayer* find(const std::string& name) const {
    const auto found = std::ranges::find_if(
        layers, [&](const auto& shown) { return shown->layer().name == name; });
    return found == layers.end() ? nullptr : found->get();
  }
  ShownLayer& at(const std::string& name) const {
    if (ShownLayer* const shown = find(name)) return *shown;
    throw Error("the view has no layer '{}'", name);
  }
  void update_legend() {
    legend->show(find(legend_layer) ? &find(legend_layer)->layer() : nullptr);
  }
  void set_detail();
  void fit(const std::array<double, 6>& bounds);
  glm::dvec2 size_px() const { return {window->GetSize()[0], window->GetSize()[1]}; }
  PickRay ray(int x_px, int y_px) const;
  void draw_part(glm::ivec2 first_px, glm::ivec2 part_px, Image8& whole);
};

// Distributes the detail permitted during motion among the layers, in proportion to their sizes.
void View::Impl::set_detail() {
  double points = 0, triangles = 0;
  for (const auto& shown : layers) {
    if (!shown->layer().visible) continue;
    if (shown->layer().kind == LayerKind::Cloud) points += static_cast<double>(shown->elements());
    if (is_surface(shown->layer())) triangles += static_cast<double>(shown->elements());
  }
  for (const auto& shown : layers) {
    const bool is_cloud = shown->layer().kind == LayerKind::Cloud;
    const double all = is_cloud ? points : triangles;
    const auto most = static_cast<double>(is_cloud ? detail.points() : detail.triangles());
    if (!is_moving || !shown->layer().visible || all <= most ||
        (!is_cloud && !is_surface(shown->layer()))) {
      shown->draw_full();
    } else {
      shown->thin_to(static_cast<std::size_t>(most / all * static_cast<double>(shown->elements())));
    }
  }
}

void View::Impl::fit(const std::array<double, 6>& bounds) {
  if (bounds[0] > bounds[1]) return;
  vtkCamera& camera = *renderer->GetActiveCamera();
  camera.SetFocalPoint(0, 0, 0);
  camera.SetPosition(-0.35, -1, 0.75);
  camera.SetViewUp(0, 0, 1);
  renderer->ResetCamera(bounds.data());
  camera.Dolly(1.35);  // wide, flat layers leave most of their bounding sphere empty
}

PickRay View::Impl::ray(int x_px, int y_px) const {
  vtkCamera& camera = *renderer->GetActiveCamera();
  glm::dvec3 from, at, up;
  camera.GetPosition(&from.x);
  camera.GetFocalPoint(&at.x);
  camera.GetViewUp(&up.x);
  const glm::dvec3 ahead = glm::normalize(at - from);
  const glm::dvec3 right = glm::normalize(glm::cross(ahead, up));
  const glm::dvec3 down = glm::cross(ahead, right);
  const glm::dvec2 size = size_px();
  const double focal_px = size.y / 2 / std::tan(glm::radians(camera.GetViewAngle()) / 2);
  const glm::dvec2 centre = size / 2.0;
  const glm::dvec2 pixel(x_px + 0.5, y_px + 0.5);
  const glm::dvec2 off = (pixel - centre) / focal_px;
  PickRay ray{.from_w_m = from + origin(),
              .direction = glm::normalize(ahead + off.x * right + off.y * down),
              .pixel = pixel};
  const glm::dvec3 x = focal_px * right + centre.x * ahead;
  const glm::dvec3 y = focal_px * down + centre.y * ahead;
  ray.to_pixels = glm::transpose(glm::dmat3(x, y, ahead));
  return ray;
}

// Draws a rectangle of a picture with the corresponding part of the view frustum.
void View::Impl::draw_part(glm::ivec2 first_px, glm::ivec2 part_px, Image8& whole) {
  const glm::dvec2 size_px(whole.width(), whole.height());
  vtkCamera& camera = *renderer->GetActiveCamera();
  const double angle_deg = camera.GetViewAngle();
  const glm::dvec2 middle_px = glm::dvec2(first_px) + glm::dvec2(part_px) / 2.0 - size_px / 2.0;
  camera.SetViewAngle(
      2 * glm::degrees(std::atan(std::tan(glm::radians(angle_deg) / 2) * part_px.y / size_px.y)));
  camera.SetWindowCenter(2 * middle_px.x / part_px.x, -2 * middle_px.y / part_px.y);
  const auto background = [&](double from_top) {
    return glm::mix(sky, haze, from_top / size_px.y);
  };
  const glm::dvec3 upper = background(first_px.y), lower = background(first_px.y + part_px.y);
  renderer->SetBackground2(upper.x, upper.y, upper.z);
  renderer->SetBackground(lower.x, lower.y, lower.z);
  legend->fit_to({whole.width(), whole.height()},
                 {first_px.x, whole.height() - first_px.y - part_px.y});
  window->SetSize(part_px.x, part_px.y);
  window->Render();
  read_pixels(*window, first_px, part_px, whole);
  camera.SetViewAngle(angle_deg);
  camera.SetWindowCenter(0, 0);
  renderer->SetBackground2(sky.x, sky.y, sky.z);
  renderer->SetBackground(haze.x, haze.y, haze.z);
}

View::View(const vtkSmartPointer<vtkRenderWindow>& window) : impl_(std::make_unique<Impl>()) {
  impl_->window = window;
  vtkRenderer& renderer = *impl_->renderer;
  renderer.GradientBackgroundOn();
  renderer.SetBackground(haze.x, haze.y, haze.z);
  renderer.SetBackground2(sky.x, sky.y, sky.z);
  renderer.SetNearClippingPlaneTolerance(2e-4);
  add_lights(renderer);
  renderer.GetActiveCamera()->SetViewAngle(view_angle_deg);
  impl_->window->AddRenderer(impl_->renderer);
  impl_->window->SetMultiSamples(0);
  impl_->legend = std::make_unique<Legend>(renderer);
  look({{-1, -1, 1}, {0, 0, 0}, {0, 0, 1}});
}

View::~View() { impl_->window->RemoveRenderer(impl_->renderer); }

Layer& View::add(Layer layer) {
  if (!impl_->origin_w_m) {
    const Look before = current_look();
    impl_->origin_w_m = layer.origin_w_m;
    look(before);
  }
  ShownLayer* const before = impl_->find(layer.name);
  if (before != nullptr) {
    const Layer& old = before->layer();
    if (old.coloured_by.empty() || layer.find(old.coloured_by) != nullptr)
      layer.coloured_by = old.coloured_by;
    layer.visible = old.visible;
    layer.opacity = old.opacity;
    layer.wireframe = old.wireframe;
    layer.point_size_px = old.point_size_px;
  }
  auto shown = std::make_unique<ShownLayer>(std::move(layer), impl_->origin());
  impl_->renderer->AddActor(shown->layer().actor);
  ShownLayer& added = *shown;
  if (before != nullptr) {
    impl_->renderer->RemoveActor(before->layer().actor);
    *std::ranges::find_if(impl_->layers, [&](const auto& one) { return one.get() == before; }) =
        std::move(shown);
  } else {
    impl_->layers.push_back(std::move(shown));
  }
  const bool has_no_legend = impl_->find(impl_->legend_layer) == nullptr;
  if (!added.layer().coloured_by.empty() && has_no_legend) impl_->legend_layer = added.layer().name;
  impl_->update_legend();
  impl_->set_detail();
  return added.layer();
}

void View::remove(const std::string& name) {
  ShownLayer* const shown = impl_->find(name);
  if (shown == nullptr) return;
  impl_->renderer->RemoveActor(shown->layer().actor);
  std::erase_if(impl_->layers, [&](const auto& one) { return one.get() == shown; });
  impl_->update_legend();
}

const Layer* View::find(const std::string& name) const {
  const ShownLayer* const shown = impl_->find(name);
  return shown == nullptr ? nullptr : &shown->layer();
}

std::vector<const Layer*> View::layers() const {
  std::vector<const Layer*> all;
  for (const auto& shown : impl_->layers) all.push_back(&shown->layer());
  return all;
}

void View::colour_by(const std::string& layer, const std::string& column) {
  ShownLayer& shown = impl_->at(layer);
  if (!column.empty() && shown.layer().find(column) == nullptr)
    throw Error("layer '{}' has no column '{}' to be coloured by", layer, column);
  shown.layer().coloured_by = column;
  shown.restyle();
  impl_->legend_layer = layer;
  impl_->update_legend();
}

void View::set_range(const std::string& layer, const std::string& column, glm::dvec2 range) {
  ShownLayer& shown = impl_->at(layer);
  const auto found = std::ranges::find(shown.layer().columns, column, &LayerColumn::name);
  if (found == shown.layer().columns.end())
    throw Error("layer '{}' has no column '{}' to set the range of", layer, column);
  if (!(range.x <= range.y))
    throw Error("the range of colours [{}, {}] is empty: are its limits swapped?", range.x,
                range.y);
  found->range = range;
  shown.restyle();
  impl_->update_legend();
}

void View::set_visible(const std::string& layer, bool visible) {
  impl_->at(layer).layer().visible = visible;
  impl_->at(layer).restyle();
  impl_->update_legend();
  impl_->set_detail();
}

void View::set_opacity(const std::string& layer, double opacity) {
  impl_->at(layer).layer().opacity = std::clamp(opacity, 0.0, 1.0);
  impl_->at(layer).restyle();
}

void View::set_wireframe(const std::string& layer, bool wireframe) {
  impl_->at(layer).layer().wireframe = wireframe;
  impl_->at(layer).restyle();
}

void View::set_point_size(const std::string& layer, double size_px) {
  impl_->at(layer).layer().point_size_px = std::clamp(size_px, 1.0, 32.0);
  impl_->at(layer).restyle();
}

void View::set_moving(bool moving) {
  if (impl_->is_moving == moving) return;
  impl_->is_moving = moving;
  if (moving) impl_->detail.begin();
  impl_->set_detail();
}

void View::set_legend_visible(bool visible) {
  impl_->is_legend_visible = visible;
  impl_->legend->set_visible(visible);
}

void View::fit() {
  std::array<double, 6> bounds{};
  impl_->renderer->ComputeVisiblePropBounds(bounds.data());
  impl_->fit(bounds);
}

void View::fit(const std::string& layer) {
  std::array<double, 6> bounds{};
  impl_->at(layer).layer().actor->GetBounds(bounds.data());
  impl_->fit(bounds);
}

void View::look(const Look& look) {
  const glm::dvec3 from = look.from_w_m - impl_->origin(), at = look.at_w_m - impl_->origin();
  vtkCamera& camera = *impl_->renderer->GetActiveCamera();
  camera.SetPosition(from.x, from.y, from.z);
  camera.SetFocalPoint(at.x, at.y, at.z);
  camera.SetViewUp(look.up.x, look.up.y, look.up.z);
}

Look View::current_look() const {
  Look look;
  vtkCamera& camera = *impl_->renderer->GetActiveCamera();
  camera.GetPosition(&look.from_w_m.x);
  camera.GetFocalPoint(&look.at_w_m.x);
  camera.GetViewUp(&look.up.x);
  look.from_w_m += impl_->origin();
  look.at_w_m += impl_->origin();
  return look;
}

std::optional<Picked> View::pick(int x_px, int y_px) const {
  return groundray::pick(layers(), impl_->ray(x_px, y_px), near_px);
}

std::pair<glm::dvec3, glm::dvec3> View::line_of_sight(int x_px, int y_px) const {
  const PickRay ray = impl_->ray(x_px, y_px);
  return {ray.from_w_m, ray.direction};
}

void View::render() {
  impl_->legend->fit_to({impl_->window->GetSize()[0], impl_->window->GetSize()[1]});
  impl_->renderer->ResetCameraClippingRange();
  const auto begin = std::chrono::steady_clock::now();
  impl_->window->Render();
  if (!impl_->is_moving) return;
  impl_->window->WaitForCompletion();
  impl_->detail.drawn(
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
}

Image8 View::picture(glm::ivec2 size_px) {
  if (size_px.x < 1 || size_px.y < 1 || size_px.x > 65535 || size_px.y > 65535)
    throw Error("a picture of {} x {} px: 1 x 1 to 65535 x 65535 px can be drawn", size_px.x,
                size_px.y);
  if (!is_offscreen(impl_->window)) {
    View copy(make_offscreen_window(size_px));
    copy.impl_->origin_w_m = impl_->origin_w_m;
    for (const auto& shown : impl_->layers) copy.add(shown->layer());
    copy.impl_->legend_layer = impl_->legend_layer;
    copy.impl_->update_legend();
    copy.set_legend_visible(impl_->is_legend_visible);
    copy.impl_->renderer->GetActiveCamera()->DeepCopy(impl_->renderer->GetActiveCamera());
    return copy.picture(size_px);
  }
  const glm::ivec2 tiles = (size_px - 1) / tile_px + 1;
  const glm::ivec2 tile = (size_px - 1) / tiles + 1;
  impl_->renderer->ResetCameraClippingRange();
  Image8 whole(size_px.x, size_px.y, 3);
  for (int y = 0; y < size_px.y; y += tile.y) {
    for (int x = 0; x < size_px.x; x += tile.x)
      impl_->draw_part({x, y}, glm::min(tile, size_px - glm::ivec2(x, y)), whole);
  }
  impl_->legend->fit_to(size_px);
  return whole;
}

vtkRenderer* View::renderer() const { return impl_->renderer; }

vtkRenderWindow* View::window() const { return impl_->window; }

}  // namespace groundray
