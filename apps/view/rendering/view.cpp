#include "apps/view/rendering/view.h"

#include <vtkAutoInit.h>
#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkNew.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <utility>

#include "apps/view/rendering/eye_dome.h"
#include "apps/view/rendering/view_impl.h"
#include "core/error.h"
#include "core/math.h"

// VTK's object factories. vtk_module_autoinit would define a macro with the path of the build tree,
// which would keep clones in other folders from sharing objects in the compiler cache.
VTK_MODULE_INIT(vtkRenderingOpenGL2)
VTK_MODULE_INIT(vtkRenderingFreeType)

namespace groundray {
namespace {

constexpr double near_px = 6, view_angle_deg = 40;

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

}  // namespace

ShownLayer* View::Impl::find(const std::string& name) const {
  const auto found =
      std::ranges::find_if(layers, [&](const auto& shown) { return shown->layer().name == name; });
  return found == layers.end() ? nullptr : found->get();
}

ShownLayer& View::Impl::at(const std::string& name) const {
  if (ShownLayer* const shown = find(name)) return *shown;
  throw Error("the view has no layer '{}'", name);
}

void View::Impl::update_legend() {
  legend->show(find(legend_layer) ? &find(legend_layer)->layer() : nullptr);
}

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
  const double focal_px = size.y / 2 / math::tan(glm::radians(camera.GetViewAngle()) / 2);
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

View::View(const vtkSmartPointer<vtkRenderWindow>& window) : impl_(std::make_unique<Impl>()) {
  impl_->window = window;
  vtkRenderer& renderer = *impl_->renderer;
  renderer.GradientBackgroundOn();
  renderer.SetBackground(Impl::haze.x, Impl::haze.y, Impl::haze.z);
  renderer.SetBackground2(Impl::sky.x, Impl::sky.y, Impl::sky.z);
  renderer.SetNearClippingPlaneTolerance(2e-4);
  add_lights(renderer);
  renderer.GetActiveCamera()->SetViewAngle(view_angle_deg);
  impl_->window->AddRenderer(impl_->renderer);
  impl_->window->SetMultiSamples(0);
  impl_->legend = std::make_unique<Legend>(renderer);
  look({{-1, -1, 1}, {0, 0, 0}, {0, 0, 1}});
}

View::~View() {
  // The renderer releases the resources of the passes that it has.
  if (impl_->eye_dome != nullptr) impl_->renderer->SetPass(impl_->eye_dome);
  impl_->window->RemoveRenderer(impl_->renderer);
}

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
    layer.is_clipped = old.is_clipped;
  }
  if (layer.exposed && impl_->exposure_ev != 0) layer.texture = layer.exposed(impl_->exposure_ev);
  auto shown = std::make_unique<ShownLayer>(std::move(layer), impl_->origin());
  shown->clip(impl_->clip);
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

void View::set_eye_dome(bool on) {
  if (on && impl_->eye_dome == nullptr) impl_->eye_dome = make_eye_dome_pass();
  impl_->renderer->SetPass(on ? impl_->eye_dome.Get() : nullptr);
}

bool View::has_eye_dome() const { return impl_->renderer->GetPass() != nullptr; }

void View::set_clip(const std::optional<ClipBox>& box) {
  if (box && !glm::all(glm::lessThan(box->low_w_m, box->high_w_m)))
    throw Error("the clipping box is empty: are its limits swapped?");
  impl_->clip = box;
  for (const auto& shown : impl_->layers) shown->clip(box);
}

const std::optional<ClipBox>& View::clip() const { return impl_->clip; }

std::optional<ClipBox> View::bounds() const {
  std::optional<ClipBox> all;
  for (const Layer* const layer : layers()) {
    if (!layer->visible || layer->kind == LayerKind::Sensors || layer->kind == LayerKind::Trail)
      continue;
    std::array<double, 6> of{};
    layer->data->GetBounds(of.data());
    if (of[0] > of[1]) continue;
    const glm::dvec3 low = layer->origin_w_m + glm::dvec3(of[0], of[2], of[4]);
    const glm::dvec3 high = layer->origin_w_m + glm::dvec3(of[1], of[3], of[5]);
    all = all ? ClipBox{glm::min(all->low_w_m, low), glm::max(all->high_w_m, high)}
              : ClipBox{low, high};
  }
  return all;
}

void View::set_clipped(const std::string& layer, bool clipped) {
  impl_->at(layer).layer().is_clipped = clipped;
  impl_->at(layer).clip(impl_->clip);
}

void View::set_label(const std::optional<ViewLabel>& label) {
  if (impl_->label_actor == nullptr) {
    impl_->label_actor = vtkSmartPointer<vtkTextActor>::New();
    impl_->label_actor->GetPositionCoordinate()->SetCoordinateSystemToWorld();
    vtkTextProperty& style = *impl_->label_actor->GetTextProperty();
    style.SetFontSize(16);
    style.BoldOn();
    style.SetColor(1, 1, 1);
    style.SetBackgroundColor(0.1, 0.11, 0.14);
    style.SetBackgroundOpacity(0.8);
    style.SetJustificationToCentered();
    style.SetVerticalJustificationToBottom();
    impl_->renderer->AddActor2D(impl_->label_actor);
  }
  impl_->label = label;
  impl_->label_actor->SetInput(label ? label->text.c_str() : "");
  impl_->place_label();
}

// Labels behind the eye would appear mirrored in the picture.
void View::Impl::place_label() {
  if (label_actor == nullptr) return;
  glm::dvec3 from, ahead;
  renderer->GetActiveCamera()->GetPosition(&from.x);
  renderer->GetActiveCamera()->GetDirectionOfProjection(&ahead.x);
  const glm::dvec3 place = label ? label->p_w_m - origin() : from;
  label_actor->GetPositionCoordinate()->SetValue(place.x, place.y, place.z);
  label_actor->SetVisibility(glm::dot(place - from, ahead) > 0 ? 1 : 0);
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
  return groundray::pick(layers(), impl_->ray(x_px, y_px), near_px, impl_->clip);
}

std::optional<Picked> View::pick_vertex(int x_px, int y_px) const {
  const PickRay ray = impl_->ray(x_px, y_px);
  const auto picked = groundray::pick(layers(), ray, near_px, impl_->clip);
  return picked ? near_vertex(*find(picked->layer), *picked, ray, near_px) : picked;
}

std::pair<glm::dvec3, glm::dvec3> View::line_of_sight(int x_px, int y_px) const {
  const PickRay ray = impl_->ray(x_px, y_px);
  return {ray.from_w_m, ray.direction};
}

void View::render() {
  impl_->legend->fit_to({impl_->window->GetSize()[0], impl_->window->GetSize()[1]});
  impl_->renderer->ResetCameraClippingRange();
  impl_->place_label();
  const auto begin = std::chrono::steady_clock::now();
  impl_->window->Render();
  if (!impl_->is_moving) return;
  impl_->window->WaitForCompletion();
  impl_->detail.drawn(
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
}

vtkRenderer* View::renderer() const { return impl_->renderer; }

vtkRenderWindow* View::window() const { return impl_->window; }

}  // namespace groundray
