#include <fmt/format.h>
#include <fmt/ranges.h>

#include <QDockWidget>
#include <QDragEnterEvent>
#include <QLabel>
#include <QMimeData>
#include <QProgressBar>
#include <QPushButton>
#include <QStatusBar>
#include <QUrl>
#include <algorithm>
#include <utility>

#include "apps/scene/interruption.h"
#include "apps/view/layers/scene_layers.h"
#include "apps/view/window/widgets.h"
#include "apps/view/window/window.h"

namespace groundray {
namespace {

std::vector<std::string> camera_names(const Timeline& timeline) {
  std::vector<std::string> names;
  for (const RecordedSensor& sensor : timeline.sensors()) {
    if (sensor.camera) names.push_back(sensor.name);
  }
  return names;
}

}  // namespace

void Window::dragEnterEvent(QDragEnterEvent* event) {
  if (event->mimeData()->hasUrls()) event->acceptProposedAction();
}

void Window::dropEvent(QDropEvent* event) {
  for (const QUrl& url : event->mimeData()->urls()) {
    if (url.isLocalFile()) open(url.toLocalFile().toStdString());
  }
  event->acceptProposedAction();
}

void Window::open(const std::filesystem::path& path) {
  queue_.push_back(path);
  if (!opening_.is_running()) open_next();
}

void Window::open_next() {
  show_documents();
  if (queue_.empty()) return report_unmatched();
  const std::filesystem::path path = queue_.front();
  queue_.pop_front();
  const auto work = [path, limits = start_.limits](const std::stop_token& stop, const auto&) {
    Loaded loaded{open_any(path, limits, stop), nullptr};
    if (stop.stop_requested()) throw Interrupted();
    if (loaded.opened.run != nullptr) {
      loaded.timeline = std::make_shared<const Timeline>(*loaded.opened.run);
    } else if (loaded.opened.simulation != nullptr) {
      loaded.timeline = std::make_shared<const Timeline>(run_of(*loaded.opened.simulation));
    }
    return loaded;
  };
  opening_.start(work, [this](Loaded loaded) { take(std::move(loaded)); },
                 {.failed = [this](const std::string& message) { fault(message); },
                  .ended = [this] { open_next(); }});
  busy_->show();
  cancel_->show();
  message_->setText(text_of("opening {} ...", path.string()));
  show_hint(path);
}

void Window::cancel_opening() {
  queue_.clear();
  opening_.abandon();
  show_documents();
}

// Reports the options of the program that no layer has satisfied.
void Window::report_unmatched() {
  if (unmatched_.empty()) return;
  const std::string message =
      fmt::format("{}: no layer has that name or column; see the layer tree and \"Colour by\"",
                  fmt::join(unmatched_, ", "));
  unmatched_.clear();
  fault(message);
}

std::string Window::name_for(const std::filesystem::path& path) const {
  const std::filesystem::path file =
      path.filename().empty() ? path.parent_path().filename() : path.filename();
  const auto is_taken = [&](const std::string& name) {
    return std::ranges::find(documents_, name, &Document::name) != documents_.end();
  };
  std::string name = file.string();
  std::ranges::replace(name, '/', '_');
  for (int i = 2; is_taken(name); ++i) name = fmt::format("{} ({})", file.string(), i);
  return name;
}

// A document's only layer has the document's name; several are below it in the tree.
void Window::name_layers(std::vector<Layer>& layers, const std::string& document) {
  for (Layer& layer : layers) {
    if (layer.kind == LayerKind::Terrain) layer.name = "terrain";
    const std::string own_name = layer.name;
    layer.name = layers.size() == 1 ? document : fmt::format("{}/{}", document, own_name);
    apply_options(layer, own_name);
  }
}

// Applies the program's options to a layer.
// @param own_name  name within the document.
void Window::apply_options(Layer& layer, const std::string& own_name) {
  for (const std::string& request : start_.view.colour_by) {
    const std::size_t equals = request.rfind('=');
    const bool is_of_all = equals == std::string::npos;
    const std::string of = is_of_all ? "" : request.substr(0, equals);
    const std::string column = is_of_all ? request : request.substr(equals + 1);
    if (!is_of_all && of != layer.name && of != own_name) continue;
    if (layer.find(column) == nullptr) continue;
    layer.coloured_by = column;
    unmatched_.erase("--colour-by " + request);
  }
  for (const std::string& request : start_.view.hide) {
    for (const std::string& name : {layer.name, own_name}) {
      if (name != request && !name.starts_with(request + "/")) continue;
      layer.visible = false;
      unmatched_.erase("--hide " + request);
    }
  }
  layer.point_size_px = start_.view.point_size_px.value_or(layer.point_size_px);
  layer.wireframe = layer.wireframe || (start_.view.is_wireframe && layer.triangles() > 0);
}

void Window::take(Loaded loaded) {
  Opened& opened = loaded.opened;
  const auto again = std::ranges::find(documents_, opened.path, &Document::path);
  if (again != documents_.end()) forget(again->name);  // reopened inputs are read again
  Document document{.path = opened.path,
                    .kind = opened.kind,
                    .name = name_for(opened.path),
                    .follower = opened.follower,
                    .terrain = "",
                    .has_one_band = opened.follower != nullptr,
                    .simulation = opened.simulation,
                    .dataset = opened.dataset,
                    .timeline = loaded.timeline};
  for (const FrameOrigin& origin : start_.view.origins) {
    if (place_input(opened, origin)) unmatched_.erase("--origin " + origin.text);
  }
  name_layers(opened.layers, document.name);
  std::vector<std::string> names;
  for (Layer& layer : opened.layers) {
    names.push_back(layer.name);
    if (layer.kind == LayerKind::Terrain) document.terrain = layer.name;
    view().add(std::move(layer));
  }
  // After the first layer, whose origin is that of the view: the box may be far from it.
  if (start_.view.clip) clip_->set_box(*start_.view.clip);
  start_.view.clip.reset();
  documents_.push_back(document);
  recent_.add(opened.path);
  playback_->include_again(document.name + "/");
  if (!opened.notes.empty()) {
    statusBar()->showMessage(text_of("{}", fmt::join(opened.notes, "; ")), 15000);
  }
  changed();
  first_look(opened, names);
  use(document);
  offer_ground();
  // During playback of a dataset, a scene's sensors would be shown at their initial poses.
  const bool is_played = playback_->is_open() && playback_->recording().dataset != nullptr;
  if (document.timeline != nullptr && is_played) hide_sensors_of_scenes();
  offer_comparisons();
}

void Window::first_look(const Opened& opened, const std::vector<std::string>& layers) {
  if (has_looked_ && documents_.size() > 1) return;
  has_looked_ = true;
  if (opened.look) {
    view().look(*opened.look);
  } else {
    view().fit();
  }
  const Look look = requested_look(view().current_look(), start_.view);
  if (look.from_w_m != look.at_w_m) view().look(look);
  if (!layers.empty()) layers_->select(layers.front());
  canvas_->look(view().current_look());
}

// Makes a document the current one, whose terrain is followed and whose timeline is played.
void Window::use(const Document& document) {
  if (document.simulation != nullptr)
    playback_->set_world(document.simulation, document.name + "/");
  if (document.follower != nullptr) {
    tracker_->open(document.follower, document.terrain);
    follow_eye();
  }
  // Recorded data take precedence over a scene's simulated run.
  const bool is_recorded_elsewhere = document.dataset == nullptr && playback_->is_open() &&
                                     playback_->recording().dataset != nullptr;
  if (document.timeline != nullptr && !is_recorded_elsewhere) play(document);
  if (document.kind == InputKind::Picture) {
    show_images();
    images_->show_image({.title = document.name, .file = document.path, .is_frame = false});
  }
}

void Window::play(const Document& document) {
  playback_->open({document.dataset, document.timeline, document.name + "/"});
  const std::vector<std::string> cameras = camera_names(*document.timeline);
  docks_.at(timeline_)->show();
  const bool has_images = document.dataset != nullptr && !cameras.empty();
  if (has_images) show_images();
  images_->set_cameras(has_images ? cameras : std::vector<std::string>());
  timeline_->show_timeline(document.timeline);
}

// Offers the scene opened last for scanning; if there is none, the DEM opened last.
void Window::offer_ground() {
  const Document* scene = nullptr;
  const Document* dem = nullptr;
  for (const Document& each : documents_) {
    if (each.simulation != nullptr) scene = &each;
    if (each.kind == InputKind::Dem && each.has_one_band) dem = &each;
  }
  if (scene == nullptr && dem != nullptr) return scan_->set_dem(dem->path);
  scan_->set_world(scene == nullptr ? nullptr : scene->simulation);
}

void Window::hide_sensors_of_scenes() {
  std::vector<std::string> sensors;
  for (const Layer* layer : view().layers()) {
    const bool may_be = layer->kind == LayerKind::Sensors || layer->kind == LayerKind::Trail;
    const auto of = std::ranges::find(documents_, document_of(layer->name), &Document::name);
    if (may_be && layer->visible && of != documents_.end() && of->simulation != nullptr)
      sensors.push_back(layer->name);
  }
  for (const std::string& name : sensors) view().set_visible(name, false);
  hidden_sensors_.insert(hidden_sensors_.end(), sensors.begin(), sensors.end());
  layers_->refresh();
  canvas_->draw();
}

void Window::show_hidden_sensors() {
  for (const std::string& name : std::exchange(hidden_sensors_, {})) {
    if (view().find(name) != nullptr) view().set_visible(name, true);
  }
  layers_->refresh();
  canvas_->draw();
}

void Window::report_no_image(std::optional<std::chrono::nanoseconds> first) {
  if (!first) return images_->clear("this camera has no image");
  images_->clear(text_of("no image yet: the first is at {:.3f} s",
                         std::chrono::duration<double>(*first).count()));
}

void Window::show_images() {
  QDockWidget* const images = docks_.at(images_);
  images->show();
  QList<QDockWidget*> docks{images};
  QList<int> heights_px{height() * 45 / 100};
  for (QDockWidget* tab : {docks_.at(picked_->parentWidget()), docks_.at(scan_),
                           docks_.at(compare_), docks_.at(clip_)}) {
    docks << tab;
    heights_px << height() * 45 / 100;
  }
  resizeDocks(docks, heights_px, Qt::Vertical);
}

void Window::remove_layer(const std::string& name) {
  view().remove(name);
  scans_here_.erase(name);
  // Otherwise it would reappear as soon as the eye moves.
  if (tracker_->is_open() && tracker_->layer() == name) tracker_->close();
}

// Removes a document with all of its layers, and the display of the last click.
void Window::forget(const std::string& document) {
  picker_->clear();
  view().remove("picked/ray");
  std::vector<std::string> layers;
  for (const Layer* layer : view().layers()) {
    if (document_of(layer->name) == document) layers.push_back(layer->name);
  }
  for (const std::string& layer : layers) remove_layer(layer);
  const auto found = std::ranges::find(documents_, document, &Document::name);
  if (found == documents_.end()) return;
  const Document gone = std::move(*found);
  documents_.erase(found);
  if (gone.follower != nullptr) tracker_->close();
  if (gone.simulation != nullptr) playback_->set_world(nullptr, "");
  const std::optional<ImageSource>& shown = images_->shown();
  if (gone.kind == InputKind::Picture && shown && shown->file == gone.path) images_->clear();
  if (gone.timeline != nullptr) {
    timeline_->show_timeline(nullptr);
    playback_->close();
    images_->set_cameras({});
    images_->clear();
    docks_.at(timeline_)->hide();
  }
  for (const Document& each : documents_) {
    if ((gone.follower != nullptr && each.follower != nullptr) ||
        (gone.simulation != nullptr && each.simulation != nullptr) ||
        (gone.timeline != nullptr && each.timeline != nullptr)) {
      use(each);
    }
  }
  const bool is_played = playback_->is_open() && playback_->recording().dataset != nullptr;
  if (gone.dataset != nullptr && !is_played) show_hidden_sensors();
  offer_ground();
  show_documents();
}

void Window::close_all() {
  cancel_opening();
  picker_->clear();
  while (!documents_.empty()) forget(Document(documents_.back()).name);
  std::vector<std::string> rest;
  for (const Layer* layer : view().layers()) rest.push_back(layer->name);
  for (const std::string& layer : rest) remove_layer(layer);
  has_looked_ = false;
  ruler_->clear();
  changed();
  offer_comparisons();
  show_documents();
}

// Offers the most sensible pairs first. Layers of scenes are no measurements.
void Window::offer_comparisons() {
  std::vector<Truth> truths;
  std::set<std::string> scenes;
  for (const Document& document : documents_) {
    if (document.simulation == nullptr) continue;
    scenes.insert(document.name);
    truths.push_back({"ground of " + document.name, document.simulation, document.terrain});
  }
  for (const Document& document : documents_) {
    if (document.kind == InputKind::Dem)
      truths.push_back(
          {"heights of " + document.name, Truth::DemFile{document.path}, document.name});
  }
  std::vector<std::string> measured, surfaces;
  std::ptrdiff_t others = 0;  // number of surfaces that are no objects of scenes
  for (const LayerKind kind : {LayerKind::Cloud, LayerKind::Mesh, LayerKind::Terrain}) {
    for (const Layer* layer : view().layers()) {
      if (layer->kind != kind) continue;
      const bool is_of_scene = scenes.contains(document_of(layer->name));
      if (!is_of_scene || kind == LayerKind::Cloud) measured.push_back(layer->name);
      if (kind == LayerKind::Cloud) continue;
      // Objects of scenes come last: they are many, and few are measured alone.
      surfaces.insert(
          is_of_scene && kind == LayerKind::Mesh ? surfaces.end() : surfaces.begin() + others++,
          layer->name);
    }
  }
  for (const std::string& name : surfaces)
    truths.push_back({"surface of " + name, Layer{.name = name}, name});
  compare_->offer(measured, std::move(truths));
}

void Window::show_documents() {
  QStringList names;
  for (const Document& document : documents_) names << QString::fromStdString(document.name);
  setWindowTitle(names.empty() ? "groundray view" : names.join(", ") + " - groundray view");
  message_->setText(names.empty() ? "F1: mouse and keys" : names.join(", "));
  show_hint({});
  busy_->hide();
  cancel_->hide();
}

}  // namespace groundray
