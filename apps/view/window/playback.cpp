#include "apps/view/window/playback.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/view/layers/line_layer.h"
#include "apps/view/layers/scene_layers.h"
#include "apps/view/load_input.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;
constexpr glm::u8vec3 trail_rgb{255, 158, 41};
constexpr std::size_t most_triangles = 200'000;  // limit per moving object

const RecordedLidar* lidar_named(const RecordedDataset& dataset, const std::string& name) {
  const auto found = std::ranges::find(dataset.lidars, name, &RecordedLidar::name);
  return found == dataset.lidars.end() ? nullptr : &*found;
}

// Adds the sensors at their poses at a time.
void add_sensors(std::vector<Layer>& layers, const Timeline& timeline, nanoseconds time,
                 const std::string& prefix) {
  RecordedRun now{.georeference = timeline.georeference(), .sensors = {}, .names = {}};
  for (std::size_t i = 0; i < timeline.sensors().size(); ++i) {
    RecordedSensor sensor = timeline.sensors()[i];
    sensor.X_DS = Trajectory({{time, timeline.pose_at(i, time)}});
    now.sensors.push_back(std::move(sensor));
  }
  for (Layer& layer : sensor_layers(now)) {
    if (layer.kind != LayerKind::Sensors) continue;
    layer.name = prefix + layer.name;
    layers.push_back(std::move(layer));
  }
}

// Adds the moving objects of a scene at their poses at a time.
void add_moving(std::vector<Layer>& layers, const Simulation& simulation, nanoseconds time,
                const std::string& prefix) {
  for (const MovingThing& thing : moving_things(simulation)) {
    const auto& groups = simulation.scene_objects.groups;
    const auto group = std::ranges::find(groups, thing.name, &SceneObjects::Group::name);
    layers.push_back(object_layer(simulation, static_cast<std::size_t>(group - groups.begin()),
                                  time, place_of(simulation, thing, time).p_DO, most_triangles));
    layers.back().name = prefix + layers.back().name;
  }
}

}  // namespace

Playback::Playback(View& view, Hooks hooks) : view_(view), hooks_(std::move(hooks)) {}

void Playback::open(Recording recording) {
  close();
  recording_ = std::move(recording);
  time_ = recording_.timeline->begin();
  camera_.clear();
}

void Playback::close() {
  job_.abandon();
  is_stale_ = false;
  recording_ = {};
  scans_.clear();
  frames_.clear();
}

void Playback::set_world(std::shared_ptr<const Simulation> simulation, const std::string& prefix) {
  simulation_ = std::move(simulation);
  world_prefix_ = prefix;
}

void Playback::go_to(nanoseconds time) {
  if (!is_open()) return;
  time_ = time;
  show_image();
  if (job_.is_running()) {
    is_stale_ = true;
  } else {
    begin_step();
  }
}

void Playback::set_trail(bool on) {
  has_trail_ = on;
  if (on) excluded_.erase(recording_.prefix + "trail");
  if (is_open()) go_to(time_);
}

void Playback::set_camera(const std::string& name) {
  camera_ = name;
  if (is_open()) show_image();
}

void Playback::exclude(const std::string& layer) { excluded_.insert(layer); }

void Playback::include_again(const std::string& prefix) {
  std::erase_if(excluded_, [&](const std::string& name) { return name.starts_with(prefix); });
}

std::optional<std::pair<std::size_t, std::size_t>> Playback::camera_frame() const {
  if (!is_open() || recording_.dataset == nullptr || camera_.empty()) return std::nullopt;
  const std::size_t sensor = recording_.timeline->sensor_named(camera_);
  const auto frame = recording_.timeline->current(sensor, time_);
  if (!frame) return std::nullopt;
  return std::pair(sensor, *frame);
}

std::optional<nanoseconds> Playback::first_image() const {
  if (!is_open() || recording_.dataset == nullptr || camera_.empty()) return std::nullopt;
  const Timeline& timeline = *recording_.timeline;
  const RecordedSensor& camera = timeline.sensors()[timeline.sensor_named(camera_)];
  return camera.frames.empty() ? std::nullopt : std::optional(camera.frames.front().stamp);
}

void Playback::show_image() {
  if (camera_.empty()) return;
  const auto shown = camera_frame();
  if (!shown) {
    if (hooks_.no_image) hooks_.no_image(first_image());
    return;
  }
  const Timeline& timeline = *recording_.timeline;
  const RecordedFrame& frame = timeline.sensors()[shown->first].frames[shown->second];
  if (hooks_.image) {
    hooks_.image({.title = fmt::format("{} {:06}", camera_, frame.number),
                  .file = frame.file,
                  .is_frame = true,
                  .names = timeline.names(),
                  .timeline = recording_.timeline,
                  .sensor = shown->first,
                  .frame = shown->second});
  }
}

std::optional<glm::dvec3> Playback::platform_w_m() const {
  if (!is_open() || recording_.timeline->sensors().empty()) return std::nullopt;
  const Timeline& timeline = *recording_.timeline;
  return timeline.georeference().origin_w_m + timeline.pose_at(0, time_).translation_m;
}

// Builds everything for a time, except for scans that are already shown. Thread-safe.
Playback::Step Playback::step_to(const Request& request) {
  const Timeline& timeline = *request.recording.timeline;
  const std::string& prefix = request.recording.prefix;
  const glm::dvec3 origin_w_m = timeline.georeference().origin_w_m;
  Step step;
  add_sensors(step.layers, timeline, request.time, prefix);
  for (std::size_t i = 0; i < timeline.sensors().size(); ++i) {
    const RecordedSensor& sensor = timeline.sensors()[i];
    const auto current = timeline.current(i, request.time);
    const RecordedLidar* lidar = request.recording.dataset == nullptr
                                     ? nullptr
                                     : lidar_named(*request.recording.dataset, sensor.name);
    if (!current || lidar == nullptr) continue;
    const auto shown = request.frames.find(i);
    if (shown != request.frames.end() && shown->second == *current) continue;
    const RecordedFrame& frame = sensor.frames[*current];
    const std::string name = prefix + "lidar/" + sensor.name;
    step.layers.push_back(scan_layer(*request.recording.dataset, *lidar, frame, name));
    step.scans[name] = {std::make_shared<const RecordedSensor>(sensor), frame, nullptr,
                        timeline.names(), origin_w_m};
    step.frames[i] = *current;
  }
  if (request.has_trail && !timeline.sensors().empty()) {
    LineDrawing trail;
    trail.add(timeline.trail_m(0, request.time), trail_rgb);
    step.layers.push_back(line_layer(prefix + "trail", LayerKind::Trail, origin_w_m, trail, 2.5));
  }
  if (request.simulation != nullptr) {
    add_moving(step.layers, *request.simulation, request.time, request.world_prefix);
  }
  return step;
}

void Playback::begin_step() {
  is_stale_ = false;
  const Request request{recording_, simulation_, world_prefix_, frames_, time_, has_trail_};
  const auto ended = [this] {
    if (is_stale_ && is_open()) begin_step();
  };
  job_.start([request](const auto&, const auto&) { return step_to(request); },
             [this](Step step) { take(std::move(step)); },
             {.failed = hooks_.failed, .ended = ended});
}

void Playback::take(Step step) {
  if (!is_open()) return;
  for (Layer& layer : step.layers) {
    if (excluded_.contains(layer.name)) continue;
    // The colour range is kept from scan to scan.
    const Layer* before = view_.find(layer.name);
    const LayerColumn* column = before == nullptr ? nullptr : before->find(before->coloured_by);
    if (column != nullptr && !column->is_rgb) {
      for (LayerColumn& each : layer.columns) {
        if (each.name == column->name) each.range = column->range;
      }
    }
    view_.add(std::move(layer));
  }
  if (!has_trail_) view_.remove(recording_.prefix + "trail");
  for (auto& [name, scan] : step.scans) {
    if (!excluded_.contains(name)) scans_[name] = std::move(scan);
  }
  for (const auto& [sensor, frame] : step.frames) frames_[sensor] = frame;
  if (hooks_.changed) hooks_.changed();
}

const ShownScan* Playback::scan(const std::string& layer) const {
  const auto found = scans_.find(layer);
  return found == scans_.end() ? nullptr : &found->second;
}

}  // namespace groundray
