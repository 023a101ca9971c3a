// Measuring, the clipping box, and echoes over images.
#include <fmt/format.h>

#include <QAction>
#include <QDockWidget>
#include <QLabel>

#include "apps/view/layers/line_layer.h"
#include "apps/view/recorded/echo_pixels.h"
#include "apps/view/window/widgets.h"
#include "apps/view/window/window.h"

namespace groundray {
namespace {

constexpr const char* box_layer = "clip box";
constexpr glm::u8vec3 box_rgb{255, 226, 64};

// Returns the echoes that the image shows, as its dataset lists them; if it lists none, the given
// points projected into it.
std::vector<EchoPixel> echoes_in(const ImageSource& source, const RecordedImage& image,
                                 const std::vector<glm::dvec3>& p_D_m) {
  const auto files = echo_files(source.file);
  const RecordedSensor& camera = source.timeline->sensors()[source.sensor];
  if (files.empty()) return echo_pixels(camera, camera.frames[source.frame], image, p_D_m);
  std::vector<EchoPixel> echoes;
  for (const auto& [lidar, file] : files) {
    const std::vector<EchoPixel> more = read_echo_pixels(file);
    echoes.insert(echoes.end(), more.begin(), more.end());
  }
  return echoes;
}

}  // namespace

void Window::build_clip_panel() {
  clip_ = new ClipPanel({.bounds = [this] { return view().bounds(); },
                         .changed = [this](const auto& box) { set_clip(box); }});
}

void Window::set_clip(const std::optional<ClipBox>& box) {
  view().set_clip(box);
  if (box) {
    LineDrawing edges;
    const glm::dvec3 half_m = (box->high_w_m - box->low_w_m) / 2.0;
    add_box(edges, glm::dvec3(0), half_m, box_rgb);
    Layer layer = line_layer(box_layer, LayerKind::Sensors, box->low_w_m + half_m, edges, 1.5);
    layer.is_clipped = false;
    view().add(std::move(layer));
  } else {
    view().remove(box_layer);
  }
  layers_->refresh();
  changed();
}

void Window::measure(bool on) {
  if (!on) {
    ruler_->clear();
    picked_->show_facts({});
    picked_title_->setText("Click an echo, a point or a triangle.");
  } else {
    picker_->clear();
  }
  show_measured();
  changed();
}

void Window::measure_to(glm::ivec2 at_px) {
  const auto picked = view().pick_vertex(at_px.x, at_px.y);
  if (!picked) return;
  ruler_->take(picked->p_w_m);
  docks_.at(picked_->parentWidget())->show();
  docks_.at(picked_->parentWidget())->raise();
  show_measured();
  changed();
}

void Window::show_measured() {
  if (!measures_->isChecked()) return show_documents();
  message_->setText(QString::fromStdString(ruler_->text()));
  picked_title_->setText("Distance (Escape ends measuring)");
  picked_->show_facts(ruler_->facts());
}

// Shows the echoes of the current scans over the displayed image, found in another thread.
void Window::update_echoes() {
  if (!images_->wants_echoes()) return;
  if (echoes_.is_running()) {
    are_echoes_stale_ = true;
    return;
  }
  are_echoes_stale_ = false;
  const ImageSource source = *images_->shown();
  const glm::dvec3 origin_w_m = source.timeline->georeference().origin_w_m;
  std::vector<glm::dvec3> p_D_m;
  for (const Layer* layer : view().layers()) {
    if (!layer->visible || playback_->scan(layer->name) == nullptr) continue;
    for (vtkIdType i = 0; i < static_cast<vtkIdType>(layer->points()); ++i)
      p_D_m.push_back(layer->p_w_m(i) - origin_w_m);
  }
  const auto work = [source, image = images_->image(), p_D_m = std::move(p_D_m)](
                        const auto&, const auto&) { return echoes_in(source, *image, p_D_m); };
  const auto done = [this, file = source.file](const std::vector<EchoPixel>& found) {
    if (images_->wants_echoes() && images_->shown()->file == file) images_->show_echoes(found);
  };
  echoes_.start(work, done,
                {.failed = [this](const std::string& message) { fault(message); },
                 .ended =
                     [this] {
                       if (are_echoes_stale_) update_echoes();
                     }});
}

}  // namespace groundray
