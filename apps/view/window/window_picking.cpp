#include <fmt/format.h>

#include <QAction>
#include <QComboBox>
#include <QDockWidget>
#include <QLabel>
#include <glm/geometric.hpp>

#include "apps/view/layers/line_layer.h"
#include "apps/view/recorded/pixel_ray.h"
#include "apps/view/window/panels/picture_area.h"
#include "apps/view/window/widgets.h"
#include "apps/view/window/window.h"

namespace groundray {
namespace {

constexpr double viewpoint_above_m = 2;
constexpr double eye_step = 0.05;  // fraction of the distance to the target; less has no effect
constexpr double platform_step_m = 0.5;
constexpr double scan_point_px = 3;  // same as for scans of datasets
constexpr double ray_of_sky_m = 500;
constexpr glm::u8vec3 viewpoint_rgb{255, 89, 217}, ray_rgb{89, 217, 255};

}  // namespace

const ShownScan* Window::scan_of(const std::string& layer) const {
  const auto here = scans_here_.find(layer);
  return here != scans_here_.end() ? &here->second : playback_->scan(layer);
}

// Shows the legend of the layer that was selected last.
void Window::show_legend_of(const std::string& layer) {
  const Layer* found = view().find(layer);
  const LayerColumn* column = found == nullptr ? nullptr : found->find(found->coloured_by);
  if (column == nullptr || column->is_rgb) return;
  view().colour_by(layer, found->coloured_by);
  canvas_->draw();
}

void Window::click(glm::ivec2 at_px, Qt::KeyboardModifiers keys) {
  canvas_->makeCurrent();
  if (measures_->isChecked() && keys == Qt::NoModifier) return measure_to(at_px);
  const auto picked = view().pick(at_px.x, at_px.y);
  if (!picked) return picker_->clear();
  if ((keys & Qt::ControlModifier) != 0 && tracker_->is_open()) {
    return put_viewpoint(picked->p_w_m);
  }
  docks_.at(picked_->parentWidget())->show();
  docks_.at(picked_->parentWidget())->raise();
  layers_->select(picked->layer);
  show_legend_of(picked->layer);
  picker_->pick(*picked, scan_of(picked->layer));
}

void Window::follow_eye() {
  const Look look = view().current_look();
  tracker_->set_place(TerrainTracker::Follows::Eye, look.from_w_m,
                      eye_step * glm::distance(look.from_w_m, look.at_w_m));
}

// Fixes the terrain's viewpoint at eye height above a point.
void Window::put_viewpoint(const glm::dvec3& p_w_m) {
  const glm::dvec3 eye_w_m = p_w_m + glm::dvec3(0, 0, viewpoint_above_m);
  const double tall_m = 0.05 * glm::distance(view().current_look().from_w_m, p_w_m);
  LineDrawing flag;
  flag.add({glm::dvec3(0), {0, 0, tall_m}}, viewpoint_rgb);
  add_box(flag, {0, 0, tall_m}, glm::dvec3(0.1 * tall_m), viewpoint_rgb);
  view().add(line_layer("viewpoint", LayerKind::Sensors, p_w_m, flag, 2.5));
  follows_->setCurrentIndex(static_cast<int>(TerrainTracker::Follows::Place));
  tracker_->set_place(TerrainTracker::Follows::Place, eye_w_m, 0);
  if (tracker_->follows() != TerrainTracker::Follows::Place) {
    tracker_->set_follows(TerrainTracker::Follows::Place);
  }
  changed();
}

void Window::take_place(glm::ivec2 at_px, glm::ivec2 towards_px) {
  canvas_->makeCurrent();
  const auto at = view().pick(at_px.x, at_px.y);
  if (!at) return fault("There is no ground at that place: press on the terrain.");
  const auto towards = at_px == towards_px ? at : view().pick(towards_px.x, towards_px.y);
  scan_->place_at(at->p_w_m, towards ? towards->p_w_m : at->p_w_m);
}

void Window::go_to(std::chrono::nanoseconds time) {
  const auto before_w_m = playback_->platform_w_m();
  playback_->go_to(time);
  const auto now_w_m = playback_->platform_w_m();
  if (!now_w_m) return;
  tracker_->set_place(TerrainTracker::Follows::Platform, *now_w_m, platform_step_m);
  if (!timeline_->rides_along() || !before_w_m) return;
  const Look look = view().current_look();
  const glm::dvec3 moved_m = *now_w_m - *before_w_m;
  canvas_->look({look.from_w_m + moved_m, look.at_w_m + moved_m, look.up});
}

// Shows a pixel's values, its ray and the surface point that it sees; only the values for a picture
// without a sensor.
void Window::click_pixel(glm::ivec2 pixel) {
  FactTable::Facts facts;
  const auto image = images_->image();
  const ImageSource& source = *images_->shown();
  for (const PixelValue& value : image->values_at(pixel)) {
    facts.emplace_back(value.channel, value.text);
  }
  picked_title_->setText(text_of("pixel ({}, {}) of {}", pixel.x, pixel.y, source.title));
  view().remove("picked/ray");
  if (source.timeline != nullptr) {
    const Timeline& timeline = *source.timeline;
    const RecordedSensor& camera = timeline.sensors()[source.sensor];
    const auto seen =
        seen_pixel(camera, camera.frames[source.frame], glm::dvec2(pixel), image.get());
    if (seen) {
      const glm::dvec3 end_m =
          seen->p_D_m.value_or(seen->origin_m + ray_of_sky_m * seen->direction);
      const glm::dvec3 origin_w_m = timeline.georeference().origin_w_m;
      LineDrawing lines;
      lines.add({seen->origin_m, end_m}, ray_rgb);
      add_box(lines, end_m, glm::dvec3(0.01 * glm::distance(seen->origin_m, end_m)), ray_rgb);
      view().add(line_layer("picked/ray", LayerKind::Sensors, origin_w_m, lines));
      const glm::dvec3 p_w_m = origin_w_m + end_m;
      facts.emplace_back(seen->p_D_m ? "surface" : "sky",
                         fmt::format("{:.3f}, {:.3f}, {:.3f} m", p_w_m.x, p_w_m.y, p_w_m.z));
      facts.emplace_back("ray's direction", fmt::format("{:.5f}, {:.5f}, {:.5f}", seen->direction.x,
                                                        seen->direction.y, seen->direction.z));
    }
  }
  picked_->show_facts(facts);
  changed();
}

// Marks the position of the echo in the displayed image, if it is imaged there.
void Window::mark_in_image(const EchoBeam& beam, const glm::dvec3& origin_w_m) {
  const std::optional<ImageSource>& source = images_->shown();
  if (!source || source->timeline == nullptr) return;
  const Timeline& timeline = *source->timeline;
  const RecordedSensor& camera = timeline.sensors()[source->sensor];
  const glm::dvec3 p_D_m = beam.reported_m + (origin_w_m - timeline.georeference().origin_w_m);
  images_->mark(pixel_of(camera, camera.frames[source->frame], p_D_m));
}

void Window::take_scan(FinishedScan made) {
  const std::string name = made.layer.name;
  scans_here_[name] = std::move(made.scan);
  if (made.layer.find("intensity") != nullptr) made.layer.coloured_by = "intensity";
  made.layer.point_size_px = scan_point_px;
  view().add(std::move(made.layer));
  changed();
  layers_->select(name);
  show_legend_of(name);
}

void Window::take_comparison(const Comparison& comparison, const Layer& measured) {
  const Layer* layer = view().find(comparison.layer);
  if (layer == nullptr || layer->data != measured.data) return;  // gone or replaced by now
  const std::string name = comparison.layer;
  view().add(coloured_by_deviation(*layer, comparison));
  view().colour_by(name, "deviation");
  layers_->refresh();
  layers_->select(name);
  canvas_->draw();
}

}  // namespace groundray
