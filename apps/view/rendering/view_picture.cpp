// Pictures of a view.
#include <vtkCamera.h>
#include <vtkNew.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/trigonometric.hpp>

#include "apps/view/rendering/view_impl.h"
#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr int tile_px = 4096;

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

// Draws a rectangle of a picture with the corresponding part of the view frustum.
void View::Impl::draw_part(glm::ivec2 first_px, glm::ivec2 part_px, Image8& whole) {
  const glm::dvec2 size_px(whole.width(), whole.height());
  vtkCamera& camera = *renderer->GetActiveCamera();
  const double angle_deg = camera.GetViewAngle();
  const glm::dvec2 middle_px = glm::dvec2(first_px) + glm::dvec2(part_px) / 2.0 - size_px / 2.0;
  camera.SetViewAngle(
      2 * glm::degrees(math::atan(math::tan(glm::radians(angle_deg) / 2) * part_px.y / size_px.y)));
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
    copy.set_eye_dome(has_eye_dome());
    copy.set_clip(impl_->clip);
    if (impl_->label) copy.set_label(impl_->label);
    copy.impl_->renderer->GetActiveCamera()->DeepCopy(impl_->renderer->GetActiveCamera());
    return copy.picture(size_px);
  }
  impl_->place_label();
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

void View::set_exposure(double exposure_ev) {
  if (!std::isfinite(exposure_ev)) throw Error("the exposure of a view must be finite");
  if (exposure_ev == impl_->exposure_ev) return;
  impl_->exposure_ev = exposure_ev;
  for (const auto& shown : impl_->layers) {
    if (!shown->layer().exposed) continue;
    shown->layer().texture = shown->layer().exposed(exposure_ev);
    shown->restyle();
  }
}

double View::exposure_ev() const { return impl_->exposure_ev; }

}  // namespace groundray
