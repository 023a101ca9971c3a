#include "apps/groundray/dataset_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "apps/groundray/dataset.h"
#include "core/error.h"
#include "core/product_io.h"
#include "sensors/yaml_reader.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using yaml::Need;

constexpr yaml::Rule stamp_rule{[](double value) { return std::abs(value) < 9e9; },
                                "must be within 9e9 s"};  // what nanoseconds hold

// What a lidar's calibration says that its points cannot be used without. The rest is left alone.
void read_calibration(const fs::path& path, RecordedLidar& lidar) {
  yaml::Faults faults(path);
  const yaml::Node node = yaml::parse(yaml::read_file(path), path);
  yaml::Map root(node, "", faults);
  root.read_number("range_noise_sigma_m", Need::Required, lidar.range_noise_sigma_m,
                   yaml::not_negative);
  root.read_choice(
      "points", Need::Optional, lidar.points,
      {{"as_fired", LidarSpec::Points::AsFired}, {"at_stamp", LidarSpec::Points::AtStamp}});
  faults.throw_if_any();
}

class DatasetReader {
 public:
  explicit DatasetReader(fs::path folder)
      : folder_(std::move(folder)), path_(folder_ / "dataset.yaml"), faults_(path_) {}

  RecordedDataset read() {
    const yaml::Node node = yaml::parse(yaml::read_file(path_), path_);
    yaml::Map root(node, "", faults_);
    yaml::check_version(root, "groundray_dataset", faults_);
    read_georeference(root);
    for (const yaml::Node& sensor : root.list("sensors", Need::Required)) read_sensor(sensor);
    for (const yaml::Node& frame : root.list("frames", Need::Required)) read_frame(frame);
    faults_.throw_if_any();
    if (dataset_.lidars.empty()) throw Error("{}: the dataset has no lidar", path_.string());
    for (RecordedLidar& lidar : dataset_.lidars)
      std::ranges::sort(lidar.frames, {}, &RecordedLidar::Frame::number);
    return std::move(dataset_);
  }

 private:
  void read_georeference(yaml::Map& root) {
    std::array<double, 3> origin_m{};
    root.read_numbers("origin_w_m", Need::Required, origin_m);
    dataset_.georeference.origin_w_m = {origin_m[0], origin_m[1], origin_m[2]};
    const auto read_text = [&](const char* key, std::string& into) {
      if (const yaml::Node* node = root.find(key, Need::Optional)) into = node->text;  // or empty
    };
    read_text("crs", dataset_.georeference.crs_name);
    read_text("crs_wkt", dataset_.georeference.crs_wkt);
  }

  void read_sensor(const yaml::Node& node) {
    yaml::Map sensor(node, "sensors", faults_);
    std::string name, kind;
    sensor.read_text("name", Need::Required, name);
    sensor.read_text("kind", Need::Required, kind);
    if (kind != "lidar" || name.empty()) return;
    RecordedLidar lidar{.name = name, .X_DS = read_tum(folder_ / "poses" / (name + ".tum"))};
    read_calibration(folder_ / "calibration" / (name + ".yaml"), lidar);
    dataset_.lidars.push_back(std::move(lidar));
  }

  void read_frame(const yaml::Node& node) {
    yaml::Map frame(node, "frames", faults_);
    std::string sensor;
    std::uint64_t number = 0;
    double stamp_s = 0;
    bool is_done = false;
    frame.read_text("sensor", Need::Required, sensor);
    frame.read_whole("frame", Need::Required, number);
    frame.read_number("stamp_s", Need::Required, stamp_s, stamp_rule);
    frame.read_choice("state", Need::Required, is_done, {{"done", true}, {"pending", false}});
    const auto lidar = std::ranges::find(dataset_.lidars, sensor, &RecordedLidar::name);
    if (lidar == dataset_.lidars.end()) return;  // a camera's
    if (!is_done) {
      ++lidar->pending;
      return;
    }
    lidar->frames.push_back(
        {static_cast<std::int64_t>(number), std::chrono::nanoseconds(std::llround(stamp_s * 1e9)),
         folder_ / "lidar" / sensor / fmt::format("{:06}{}", number, scan_suffix)});
  }

  fs::path folder_, path_;
  yaml::Faults faults_;
  RecordedDataset dataset_;
};

}  // namespace

RecordedDataset read_dataset(const fs::path& folder) { return DatasetReader(folder).read(); }

}  // namespace groundray
