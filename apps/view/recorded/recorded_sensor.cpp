#include "apps/view/recorded/recorded_sensor.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

#include "apps/dataset/dataset_text.h"
#include "apps/dataset/recorded_calibration.h"
#include "apps/scene/readers/readers.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/tum_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using std::chrono::nanoseconds;
using yaml::Need;

// Parts of the scene file that concern a dataset. It may name files that no longer exist, so it is
// not loaded as a scene.
class SceneText {
 public:
  SceneText(const std::string& text, const fs::path& path) : path_(path), faults_(path) {
    if (!text.empty()) node_ = yaml::parse(text, path);
  }

  // Applies the scene's changes to a lidar; returns false if they cannot be read.
  bool change(const std::string& name, LidarSpec& lidar) {
    for (const yaml::Node& node : list("lidars")) {
      yaml::Faults faults(path_);
      yaml::Map entry(node, "lidars", faults);
      std::string found;
      entry.read_text("name", Need::Required, found);
      if (found != name) continue;
      try {
        LidarSpec changed = lidar;
        change_lidar(entry, path_, changed, faults);
        faults.throw_if_any();
        lidar = std::move(changed);
        return true;
      } catch (const Error&) {
        return false;
      }
    }
    return false;
  }

  struct Ground {
    std::uint16_t label = 1;
    std::vector<std::pair<std::uint16_t, std::string>> cover;  // labels and materials
  };
  std::optional<Ground> ground() {
    if (node_.kind != yaml::Node::Kind::Map) return std::nullopt;
    auto terrain = yaml::Map(node_, "", faults_).map("terrain", Need::Optional);
    if (!terrain) return std::nullopt;
    Ground ground;
    terrain->read_whole("label", Need::Optional, ground.label);
    for (const yaml::Node& node : terrain->list("cover", Need::Optional)) {
      yaml::Map layer(node, "cover", faults_);
      std::uint16_t label = ground.label;
      std::string material = "cover";
      layer.read_whole("label", Need::Optional, label);
      layer.read_text("material", Need::Optional, material);
      if (label != ground.label) ground.cover.emplace_back(label, material);
    }
    return ground;
  }

 private:
  std::span<const yaml::Node> list(const char* key) {
    if (node_.kind != yaml::Node::Kind::Map) return {};
    return yaml::Map(node_, "", faults_).list(key, Need::Optional);
  }

  fs::path path_;
  yaml::Node node_;
  yaml::Faults faults_;  // discarded: errors in the scene's text are not reported
};

void read_lidar(const fs::path& path, SceneText& scene, RecordedSensor& sensor) {
  yaml::Faults faults(path);
  const yaml::Node node = yaml::parse(yaml::read_file(path), path);
  yaml::Map root(node, "", faults);
  root.read_text("model", Need::Optional, sensor.model);
  root.read_choice(
      "points", Need::Optional, sensor.points,
      {{"as_fired", LidarSpec::Points::AsFired}, {"at_stamp", LidarSpec::Points::AtStamp}});
  sensor.X_BS = read_mount(root, "X_BS", faults);
  std::string file;
  root.read_text("lidar_file", Need::Optional, file);
  root.close_partly();
  faults.throw_if_any();
  if (file.empty()) return;
  try {
    LidarFacts facts{parse_lidar(file, path), false};
    facts.is_whole = scene.change(sensor.name, facts.spec);
    sensor.lasts = time_of(1 / ScanPattern(facts.spec.pattern).sweep_rate_hz());
    sensor.lidar = std::move(facts);
  } catch (const Error&) {
    return;  // the spec may name files that no longer exist; scans can be shown without it
  }
}

void read_camera(const fs::path& path, RecordedSensor& sensor) {
  RecordedCalibration told = read_camera_calibration(path);
  sensor.model = std::move(told.model);
  sensor.X_BS = told.X_BC;
  sensor.lasts = time_of(told.exposure_s + told.row_s * (told.size_px.y - 1));
  sensor.camera =
      CameraFacts{Lens(std::move(told.lens), told.size_px), told.exposure_s, told.row_s};
}

RecordedSensor read_sensor(const fs::path& dataset, const std::string& name, SensorKind kind,
                           const DatasetListing& listing, SceneText& scene) {
  RecordedSensor sensor{
      .name = name, .kind = kind, .X_DS = read_tum(dataset / "poses" / (name + ".tum"))};
  DatasetListing::Frames frames = listing.frames_of(name);
  sensor.frames = std::move(frames.done);
  sensor.pending = frames.pending;
  const bool is_lidar = kind == SensorKind::Lidar;
  for (RecordedFrame& frame : sensor.frames) {
    frame.file = dataset / (is_lidar ? "lidar" : "camera") / name /
                 fmt::format("{:06}{}", frame.number, is_lidar ? scan_suffix : "");
  }
  const fs::path calibration = dataset / "calibration" / (name + ".yaml");
  is_lidar ? read_lidar(calibration, scene, sensor) : read_camera(calibration, sensor);
  return sensor;
}

void name_label(std::uint32_t label, const std::string& name, RecordedNames& names) {
  std::string& text = names.labels[label];
  text += text.empty() ? name : ", " + name;
}

void name_labels(SceneText& scene, RecordedNames& names) {
  if (const auto ground = scene.ground()) {
    name_label(ground->label, "ground", names);
    for (const auto& [label, material] : ground->cover) name_label(label, material, names);
  }
  for (const RecordedNames::Objects& objects : names.objects) {
    if (objects.label != 0) name_label(objects.label, objects.name, names);
  }
}

}  // namespace

nanoseconds CameraFacts::middle_of_row(double row_px) const {
  return time_of(exposure_s / 2 + row_s * row_px);
}

RecordedRun read_recorded_run(const fs::path& dataset) {
  const DatasetListing listing = read_listing(dataset, HeadUse::Names);
  const DatasetHead& head = listing.head;
  RecordedRun run{.georeference = head.georeference,
                  .sensors = {},
                  .names = {.materials = head.materials, .objects = head.objects, .labels = {}}};
  SceneText scene(head.scene, dataset / dataset_file);
  name_labels(scene, run.names);
  for (const std::string& name : head.names_of("lidar"))
    run.sensors.push_back(read_sensor(dataset, name, SensorKind::Lidar, listing, scene));
  for (const std::string& name : head.names_of("camera"))
    run.sensors.push_back(read_sensor(dataset, name, SensorKind::Camera, listing, scene));
  return run;
}

}  // namespace groundray
