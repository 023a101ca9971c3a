#include "apps/dataset/scan_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <glm/common.hpp>
#include <utility>

#include "apps/dataset/dataset_reader.h"
#include "apps/dataset/range_conf.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"
#include "core/folder_names.h"
#include "core/io/file_io.h"
#include "core/io/open_file.h"
#include "core/io/text_lines.h"
#include "core/io/tum_io.h"
#include "core/near_names.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using std::chrono::nanoseconds;

bool is_range_grid(const fs::path& path) {
  const std::string ending = file_ending(path);
  if (ending == ".gz") return true;  // as distributed by Stanford
  if (ending != ".ply") return false;
  std::ifstream file = open_stream(path);
  for (std::string line; next_line(file, line) && !line.starts_with("end_header");) {
    if (line.starts_with("element range_grid")) return true;
  }
  return false;
}

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

// ----- Stanford's .conf

ScanFiles scans_of_conf(const fs::path& path, double unit_m) {
  ScanFiles files;
  for (const ConfScan& named : parse_conf(read_text(path), path.string())) {
    fs::path file = path.parent_path() / named.file;
    const fs::path packed = file.string() + ".gz";
    if (!is_there(file) && is_there(packed)) file = packed;
    ScanFile scan{.name = named.file, .file = file, .X_DS = named.X_DS};
    scan.is_range_grid = is_range_grid(file);
    scan.X_DS.translation_m *= unit_m;
    files.scans.push_back(std::move(scan));
  }
  return files;
}

// ----- poses for scans

// Reads the time from a file's name: nanoseconds if it is a whole number of more than 10 digits,
// else seconds.
nanoseconds time_of_name(const fs::path& file) {
  constexpr std::int64_t ns_per_s = 1'000'000'000, most_s = 9'000'000'000;
  const std::string stem = file.stem().string();
  const std::size_t point = stem.find('.');
  const std::string_view whole = std::string_view(stem).substr(0, point);
  const auto before = number_of<std::int64_t>(whole);
  std::string digits = point == std::string::npos ? "" : stem.substr(point + 1, 9);
  const auto after = digits.empty() ? 0 : number_of<std::int64_t>(digits);
  constexpr std::size_t seconds_digits = 10, ns_digits = 19;
  const bool is_ns = point == std::string::npos && whole.size() > seconds_digits;
  if (!before || !after || *before < 0 || *after < 0 || whole.size() > ns_digits ||
      (!is_ns && *before > most_s)) {
    throw Error(
        "{}: with --pose-by name the file's name must be its stamp: seconds such as "
        "1317354879.123456789.pcd, or nanoseconds such as 1317354879123456789.pcd",
        file.string());
  }
  if (is_ns) return nanoseconds(*before);
  digits.resize(9, '0');
  return nanoseconds(*before * ns_per_s + number_of<std::int64_t>(digits).value_or(0));
}

void check_covers(const Trajectory& X_DS, nanoseconds stamp, const ScanFile& scan,
                  const fs::path& poses) {
  if (X_DS.begin_time() <= stamp && stamp <= X_DS.end_time()) return;
  const auto s = [](nanoseconds time) { return 1e-9 * static_cast<double>(time.count()); };
  throw Error("{}: its stamp, {:.9f} s, is outside the poses of {}, {:.9f} to {:.9f} s",
              scan.file.string(), s(stamp), poses.string(), s(X_DS.begin_time()),
              s(X_DS.end_time()));
}

// Assigns to each scan the pose on its line, or that of the trajectory at its stamp.
void pose_scans(const ScanChoice& choice, LidarSpec::Points points, ScanFiles& files) {
  std::vector<ScanFile>& scans = files.scans;
  const Trajectory X_DS = read_tum(*choice.poses);
  if (choice.order == PoseOrder::Line && X_DS.samples().size() != scans.size()) {
    throw Error(
        "{}: it has {} poses for {} scans; there must be one per scan, in order, or files named by "
        "their stamps (--pose-by name)",
        choice.poses->string(), X_DS.samples().size(), scans.size());
  }
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (choice.order == PoseOrder::Line) {
      scans[i].X_DS = X_DS.samples()[i].pose;
      continue;
    }
    const nanoseconds stamp = time_of_name(scans[i].file);
    check_covers(X_DS, stamp, scans[i], *choice.poses);
    scans[i].stamp = stamp;
    scans[i].X_DS = X_DS.pose_at(stamp);
    scans[i].path = 0;
    scans[i].points = points;
  }
  files.paths.push_back(X_DS);
}

// ----- datasets

void check_sensors(const ScanChoice& choice, const RecordedDataset& dataset) {
  std::vector<std::string> names;
  for (const RecordedLidar& lidar : dataset.lidars) names.push_back(lidar.name);
  for (const std::string& sensor : choice.sensors) {
    if (std::ranges::find(names, sensor) != names.end()) continue;
    throw Error("{}: it has no lidar '{}'; it has: {}{}", choice.inputs[0].string(), sensor,
                names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")),
                suggestion(sensor, names));
  }
}

void add_scans(RecordedLidar lidar, const ScanChoice& choice, ScanFiles& files) {
  if (lidar.pending > 0)
    files.notes.push_back(fmt::format("{}: {} frames are pending", lidar.name, lidar.pending));
  for (const RecordedFrame& frame : lidar.frames) {
    if (!choice.frames.contains(static_cast<std::size_t>(frame.number))) continue;
    ScanFile scan{.name = fmt::format("{}/{:06}", lidar.name, frame.number),
                  .file = frame.file,
                  .path = files.paths.size(),
                  .stamp = frame.stamp,
                  .points = choice.points.value_or(lidar.points),
                  .range_noise_sigma_m = lidar.range_noise_sigma_m};
    if (choice.poses) check_covers(lidar.X_DS, frame.stamp, scan, *choice.poses);
    scan.X_DS = lidar.X_DS.pose_at(frame.stamp);
    files.scans.push_back(std::move(scan));
  }
  files.paths.push_back(std::move(lidar.X_DS));
}

ScanFiles scans_of_dataset(const ScanChoice& choice) {
  const fs::path& folder = choice.inputs[0];
  if (choice.need == ScanNeed::None)
    return {.georeference = read_listing(folder).head.georeference};
  RecordedDataset dataset = read_dataset(folder);
  if (dataset.lidars.empty() && (choice.need == ScanNeed::Some || choice.poses))
    throw Error("{}: the dataset has no lidar; `reconstruct dem` can use its stereo pairs",
                (folder / "dataset.yaml").string());
  check_sensors(choice, dataset);
  std::erase_if(dataset.lidars, [&](const RecordedLidar& lidar) {
    return !choice.sensors.empty() &&
           std::ranges::find(choice.sensors, lidar.name) == choice.sensors.end();
  });
  if (choice.poses) {
    if (dataset.lidars.size() > 1)
      throw Error("--poses: the poses belong to one sensor: select it by --sensor");
    dataset.lidars[0].X_DS = read_tum(*choice.poses);
  }
  ScanFiles files{.georeference = std::move(dataset.georeference)};
  for (RecordedLidar& lidar : dataset.lidars) add_scans(std::move(lidar), choice, files);
  return files;
}

// Reports that scans are requested from a dataset's lidars, but none exists.
[[noreturn]] void refuse_no_scan(const ScanChoice& choice, const ScanFiles& files) {
  std::string rest;
  for (const std::string& note : files.notes) rest += "; " + note;  // about pending frames
  if (choice.need == ScanNeed::IfThere) rest += "; --no-lidar uses only stereo pairs";
  throw Error("{}: there is no scan among the requested frames{}", choice.inputs[0].string(), rest);
}

// ----- files

ScanFiles scans_of_files(const ScanChoice& choice) {
  if (!choice.poses) {
    if (choice.inputs.size() > 1) {
      throw Error(
          "{} scans and no poses: give a pose for each by --poses FILE.tum, or a dataset folder or "
          "a .conf, which have them",
          choice.inputs.size());
    }
  }
  ScanFiles files;
  for (const fs::path& path : choice.inputs) {
    files.scans.push_back(
        {.name = path.filename().string(), .file = path, .is_range_grid = is_range_grid(path)});
  }
  if (choice.poses) {
    pose_scans(choice, choice.points.value_or(LidarSpec::Points::AtStamp), files);
  } else {
    files.are_posed = false;
  }
  return files;
}

// ----- the origin

Pose moved(const Pose& X_WS, const glm::dvec3& origin_m) {
  return {.rotation = X_WS.rotation, .translation_m = X_WS.translation_m - origin_m};
}

// Keeps coordinates small enough for single precision.
void choose_origin(ScanFiles& files) {
  constexpr double far_m = 10'000;
  const glm::dvec3 first_m = files.scans.front().X_DS.translation_m;
  if (glm::length(first_m) <= far_m) return;
  const glm::dvec3 origin_m = glm::round(first_m);
  files.georeference.origin_w_m = origin_m;
  for (ScanFile& scan : files.scans) scan.X_DS = moved(scan.X_DS, origin_m);
  for (Trajectory& path : files.paths) {
    auto samples = path.samples();
    for (Trajectory::Sample& sample : samples) sample.pose = moved(sample.pose, origin_m);
    path = Trajectory(std::move(samples));
  }
}

void keep_frames(const FrameRange& frames, std::vector<ScanFile>& scans) {
  std::vector<ScanFile> kept;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (frames.contains(i)) kept.push_back(std::move(scans[i]));
  }
  scans = std::move(kept);
}

enum class InputKind { Dataset, Conf, Files };

InputKind kind_of(const std::vector<fs::path>& inputs) {
  const fs::path& first = inputs.at(0);
  std::error_code ignored;
  for (const fs::path& path : inputs) {
    if (!is_there(path)) throw Error("{}: {}", path.string(), why_no_file(path));
    const bool is_alone = fs::is_directory(path, ignored) || path.extension() == ".conf";
    if (is_alone && inputs.size() > 1) {
      throw Error("{}: a dataset folder or a .conf must be the only input; there are {}",
                  path.string(), inputs.size());
    }
  }
  if (fs::is_directory(first, ignored)) {
    if (!is_there(first / "dataset.yaml")) {
      throw Error(
          "{}: the folder contains no dataset.yaml; give a folder that `groundray generate` wrote, "
          "or the scans themselves",
          first.string());
    }
    return InputKind::Dataset;
  }
  return first.extension() == ".conf" ? InputKind::Conf : InputKind::Files;
}

// Returns the files that outputs must not overwrite.
std::vector<fs::path> files_read(const ScanChoice& choice, const ScanFiles& files, InputKind kind) {
  std::vector<fs::path> read;
  if (choice.poses) read.push_back(*choice.poses);
  for (const ScanFile& scan : files.scans) read.push_back(scan.file);
  if (kind == InputKind::Conf) read.push_back(choice.inputs[0]);
  if (kind != InputKind::Dataset) return read;
  read.push_back(choice.inputs[0] / "dataset.yaml");
  for (const char* folder : {"poses", "calibration"}) {
    std::error_code ignored;
    for (const std::string& name : names_in(choice.inputs[0] / folder, ignored))
      read.push_back(choice.inputs[0] / folder / name);
  }
  return read;
}

void check_options(const ScanChoice& choice, InputKind kind) {
  if (choice.need == ScanNeed::None) {
    if (kind != InputKind::Dataset)
      throw Error("--no-lidar: only a dataset has stereo pairs: give its folder");
    if (!choice.sensors.empty() || choice.poses)
      throw Error("--no-lidar: --sensor and --poses apply to lidars: omit one of them");
  }
  if (kind != InputKind::Dataset && !choice.sensors.empty())
    throw Error("--sensor: only datasets have sensors by name");
  if (kind == InputKind::Conf && choice.poses)
    throw Error("--poses: {} has poses of its own", choice.inputs[0].string());
  if (kind == InputKind::Dataset && choice.order == PoseOrder::Name)
    throw Error("--pose-by name: a dataset contains the stamps of its scans");
  if (choice.order == PoseOrder::Name && !choice.poses)
    throw Error("--pose-by name: it assigns poses to files: give the poses by --poses");
  if (choice.points == LidarSpec::Points::AsFired && kind != InputKind::Dataset &&
      choice.order != PoseOrder::Name) {
    throw Error(
        "--points as_fired: each point needs its own pose: give a trajectory by --poses, and files "
        "named by their stamps (--pose-by name)");
  }
}

}  // namespace

FrameRange parse_frames(std::string_view text, std::string_view option) {
  const auto fail = [&] {
    throw Error("{}: '{}' must be A:B:STEP, such as 0:10, 5: or ::2, or one number", option, text);
  };
  FrameRange range;
  const std::array<std::size_t*, 3> parts{&range.first, &range.end, &range.step};
  std::size_t count = 0;
  for (std::string_view rest = text;; ++count) {
    if (count == parts.size()) fail();
    const std::size_t colon = rest.find(':');
    const std::string_view word = rest.substr(0, colon);
    if (!word.empty()) {
      const auto number = number_of<std::size_t>(word);
      if (!number) fail();
      *parts[count] = *number;
    }
    if (colon == std::string_view::npos) break;
    rest.remove_prefix(colon + 1);
  }
  if (text.empty()) fail();
  if (count == 0) range.end = range.first + 1;
  if (range.step == 0) fail();
  if (range.first >= range.end)
    throw Error("{}: '{}' has no frame: in A:B:STEP, A must be less than B", option, text);
  return range;
}

ScanFiles find_scans(const ScanChoice& choice) {
  const InputKind kind = kind_of(choice.inputs);
  check_options(choice, kind);
  ScanFiles files;
  if (kind == InputKind::Dataset) files = scans_of_dataset(choice);
  if (kind == InputKind::Conf) files = scans_of_conf(choice.inputs[0], choice.conf_unit_m);
  if (kind == InputKind::Files) files = scans_of_files(choice);
  if (kind != InputKind::Dataset) keep_frames(choice.frames, files.scans);
  const bool is_of_pairs = kind == InputKind::Dataset && files.paths.empty();  // without lidars
  if (files.scans.empty() && !is_of_pairs) refuse_no_scan(choice, files);
  if (kind != InputKind::Dataset) choose_origin(files);
  files.read = files_read(choice, files, kind);
  return files;
}

}  // namespace groundray
