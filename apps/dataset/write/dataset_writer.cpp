#include "apps/dataset/write/dataset_writer.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <fstream>
#include <system_error>
#include <utility>

#include "apps/dataset/dataset_reader.h"
#include "apps/dataset/dataset_text.h"
#include "apps/dataset/file_sum.h"
#include "apps/dataset/write/frame_files.h"
#include "apps/dataset/write/run_text.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/folder_names.h"
#include "core/io/file_io.h"
#include "core/io/open_file.h"
#include "core/io/tum_io.h"
#include "core/progress.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view aside = ".part";  // suffix of temporary files

// Returns the convergence that a scan's header states; empty if there is none.
std::string convergence_of(const fs::path& scan) {
  std::ifstream file = open_stream(scan);
  const std::string begin = fmt::format("comment {}", convergence_comment);
  for (std::string line; next_line(file, line) && line != "end_header";) {
    if (line.starts_with(begin)) return line.substr(begin.size());
  }
  return {};
}

// Returns the contents of an image's file with its exposure as a mapping on one line.
std::string exposure_of(const fs::path& file) {
  std::string mapping;
  std::ifstream lines = open_stream(file);
  for (std::string line; next_line(lines, line);) mapping += (mapping.empty() ? "" : ", ") + line;
  return fmt::format("{{{}}}", mapping);
}

// Returns true if a name is that of a temporary file of a frame, with one of the suffixes.
bool is_aside(const std::string& name, const std::vector<std::string>& suffixes) {
  const std::size_t digits = std::min(name.find_first_not_of("0123456789"), name.size());
  return digits >= 6 && std::ranges::any_of(suffixes, [&](const std::string& suffix) {
           return name.substr(digits) == fmt::format("{}{}", suffix, aside);
         });
}

void remove_asides(const fs::path& folder, const std::vector<std::string>& suffixes) {
  std::error_code ignored;
  for (const std::string& name : names_in(folder, ignored))
    if (is_aside(name, suffixes)) fs::remove(folder / name, ignored);
}

std::string words_for(const std::optional<Shard>& shard, const FrameChoice& choice) {
  if (shard) return fmt::format("shard {}", text_of(*shard));
  const std::string text = text_of(choice);
  return text.empty() ? "all frames" : fmt::format("the frames of {}", text);
}

std::vector<RunSensor> sensors_of(const Simulation& simulation) {
  std::vector<RunSensor> sensors;
  for (const PlacedLidar& lidar : simulation.lidars)
    sensors.push_back({lidar.spec.name, lidar.sweeps});
  for (const PlacedCamera& camera : simulation.cameras)
    sensors.push_back({camera.spec.name, std::ssize(camera.begins)});
  return sensors;
}

}  // namespace

Exposed exposed(const Simulation& simulation, std::uint32_t sensor, std::int64_t frame) {
  const std::size_t lidars = simulation.lidars.size();
  return sensor < lidars ? exposed(simulation.lidars[sensor], frame)
                         : exposed(simulation.cameras[sensor - lidars], frame);
}

// Check of one frame.
struct DatasetWriter::Check {
  std::uint32_t sensor = 0;
  std::int64_t frame = 0;
  std::string text;                 // its entry; after a successful check, as this run writes it
  std::vector<std::string> faults;  // empty if all files are intact
};

DatasetWriter::DatasetWriter(fs::path folder, const Simulation& simulation, FolderUse use,
                             RunPart part, FolderMessages messages)
    : folder_(std::move(folder)),
      simulation_(simulation),
      part_(std::move(part)),
      messages_(std::move(messages)) {
  part_.choice = checked_choice(part_.choice, sensors_of(simulation));
  header_ = run_header(simulation, part_.choice);
  const auto add = [&](const char* kind, const std::string& name, std::vector<std::string> suffixes,
                       std::int64_t frames) {
    std::vector<std::uint64_t> no_entries(static_cast<std::size_t>(frames));
    sensors_.push_back(
        {name, folder_ / kind / name, std::move(suffixes), frames, std::move(no_entries)});
  };
  for (const PlacedLidar& lidar : simulation.lidars)
    add("lidar", lidar.spec.name, scan_suffixes(lidar.spec), lidar.sweeps);
  for (const PlacedCamera& camera : simulation.cameras)
    add("camera", camera.spec.name, image_suffixes(camera.spec), std::ssize(camera.begins));
  make_folder(folder_);
  lock_.emplace(folder_, FolderLock::Use::Write, messages_.warn);
  if (is_taken_up(use)) {
    take_up();
  } else {
    write_record();  // first, so that the folder can be resumed
    journal_.emplace(folder_ / journal_file);
  }
  write_sensors();
}

fs::path DatasetWriter::product_path(std::uint32_t sensor, std::int64_t frame,
                                     std::string_view suffix) const {
  return sensors_[sensor].folder / fmt::format("{:06}{}", frame, suffix);
}

bool DatasetWriter::has(std::uint32_t sensor, std::int64_t frame) const {
  return sensors_[sensor].entry_after[static_cast<std::size_t>(frame)] != 0;
}

bool DatasetWriter::lists_frame(std::uint32_t sensor, std::int64_t frame) const {
  return lists(sensor) && part_.choice.frames.contains(static_cast<std::size_t>(frame));
}

bool DatasetWriter::includes(std::uint32_t sensor, std::int64_t frame) const {
  return lists_frame(sensor, frame) &&
         (!part_.shard || part_.shard->has(sensor, frame, frames(sensor)));
}

// Compares shards and choices before what else differs: a choice changes the sensors that are
// listed.
void DatasetWriter::check_part(const DatasetText& before) const {
  if (text_of(before.choice()) == text_of(part_.choice) &&
      (before.shard() == part_.shard || before.header() != header_))
    return;
  throw Error(
      "{}: the folder contains {} of a run, but {} {} requested; use a separate folder for each "
      "with -o",
      folder_.string(), words_for(before.shard(), before.choice()),
      words_for(part_.shard, part_.choice), part_.shard ? "is" : "are");
}

// Returns true if the folder has a dataset of this run to resume; throws if it has anything else.
bool DatasetWriter::is_taken_up(FolderUse use) const {
  if (is_as_new(folder_)) return false;
  if (!fs::exists(folder_ / dataset_file)) {
    throw Error(
        "{}: the folder is not empty and contains no dataset.yaml; choose a new folder with -o",
        folder_.string());
  }
  const DatasetText before(folder_);
  check_part(before);
  if (before.header() != header_) {
    throw Error(
        "{}: the folder contains a dataset of another scene, DEM, trajectory, sensor, seed or "
        "version: {}; choose a new folder with -o or remove this one",
        (folder_ / dataset_file).string(), first_difference(before.header(), header_));
  }
  if (use == FolderUse::New) {
    throw Error(
        "{}: the folder already contains a dataset of this run; add --resume to check and continue "
        "it, or choose a new folder with -o",
        folder_.string());
  }
  return true;
}

void DatasetWriter::take_up() {
  std::error_code ignored;
  fs::remove(folder_ / fmt::format("{}{}", dataset_file, aside), ignored);
  for (const Sensor& sensor : sensors_) remove_asides(sensor.folder, sensor.suffixes);
  journal_.emplace(folder_ / fmt::format("{}{}", journal_file, aside));
  try {
    take_entries(*journal_);
    check_entries(*journal_);
    journal_->rename_to(folder_ / journal_file);
  } catch (...) {
    journal_->remove();  // the previous journal still exists
    throw;
  }
}

// Copies the entries of an earlier run to the journal; the last entry of a frame is valid.
void DatasetWriter::take_entries(Journal& journal) {
  const auto take = [&](const std::string& text) {
    const auto entry = parse_entry(text);
    if (!entry) return false;
    const auto sensor = std::ranges::find(sensors_, entry->sensor, &Sensor::name);
    if (sensor == sensors_.end() || entry->frame >= sensor->frames) return false;
    if (entry->is_done)
      sensor->entry_after[static_cast<std::size_t>(entry->frame)] = 1 + journal.add(text);
    return true;
  };
  DatasetText text(folder_);
  while (const auto entry = text.next_entry()) {
    if (!take(*entry)) {
      faults_.push_back(
          fmt::format("{}:{}: changed since it was written; its frame is created again",
                      dataset_file, text.line()));
    }
  }
  if (!text.is_intact())
    faults_.push_back(fmt::format("{}: changed since it was written, or truncated", dataset_file));
  if (fs::exists(folder_ / journal_file)) {
    const std::size_t torn =
        read_journal(folder_ / journal_file, [&](const std::string& entry) { take(entry); });
    if (torn > 0)
      faults_.push_back(fmt::format("{}: {} damaged {}; frames are created again", journal_file,
                                    torn, torn == 1 ? "line" : "lines"));
  }
  for (const NamedSum& file : text.files()) {
    if (const auto fault = fault_of(folder_ / file.path, file.sum))
      faults_.push_back(fmt::format("{}: {}; it is written again", file.path, *fault));
  }
}

// Keeps the intact frames, with their entries as this run writes them.
void DatasetWriter::check_entries(Journal& journal) {
  constexpr std::size_t block = 64;  // number of frames in memory at a time
  std::size_t total = 0, done = 0;
  for (const Sensor& sensor : sensors_)
    total += sensor.entry_after.size() -
             static_cast<std::size_t>(std::ranges::count(sensor.entry_after, 0u));
  if (total == 0) return;
  Progress progress(messages_.progress, "frames checked", total);
  std::vector<Check> checks;
  const auto flush = [&] {
    tbb::parallel_for(std::size_t{0}, checks.size(), [&](std::size_t i) {
      stop_if_interrupted();
      check(checks[i]);
    });
    for (Check& each : checks) {
      auto& after = sensors_[each.sensor].entry_after[static_cast<std::size_t>(each.frame)];
      if (!each.faults.empty())
        after = 0;
      else if (journal.at(after - 1) != each.text)
        after = 1 + journal.add(each.text);
      std::ranges::move(each.faults, std::back_inserter(faults_));
    }
    progress.update(done += checks.size());
    checks.clear();
  };
  for (std::uint32_t sensor = 0; sensor < sensor_count(); ++sensor) {
    for (std::int64_t frame = 0; frame < frames(sensor); ++frame) {
      if (!has(sensor, frame)) continue;
      const auto after = sensors_[sensor].entry_after[static_cast<std::size_t>(frame)];
      checks.push_back({sensor, frame, journal.at(after - 1), {}});
      if (checks.size() == block) flush();
    }
  }
  flush();
}

void DatasetWriter::check(Check& check) const {
  const Sensor& sensor = sensors_[check.sensor];
  auto entry = parse_entry(check.text);
  std::vector<std::string> listed;
  for (const ProductSum& file : entry->files) listed.push_back(file.suffix);
  if (listed != sensor.suffixes) {
    check.faults.push_back(fmt::format("{}, frame {}: not all files are listed; created again",
                                       sensor.name, check.frame));
    return;
  }
  for (const ProductSum& file : entry->files) {
    const fs::path path = product_path(check.sensor, check.frame, file.suffix);
    if (const auto fault = fault_of(path, file.sum)) {
      check.faults.push_back(fmt::format(
          "{}: {}; created again", path.lexically_relative(folder_).generic_string(), *fault));
    }
  }
  if (check.faults.empty())
    check.text = done_text(check.sensor, check.frame, std::move(entry->files));
}

void DatasetWriter::write_sensors() {
  for (const char* name : {"poses", "calibration"}) make_folder(folder_ / name);
  for (const Sensor& sensor : sensors_)
    if (part_.choice.has_sensor(sensor.name)) make_folder(sensor.folder);
  const auto note = [&](const std::string& path) {
    files_.push_back({path, sum_file(folder_ / path)});
  };
  const auto write_calibration = [&](const std::string& name, const Trajectory& X_DS,
                                     const char* comment, const std::string& text) {
    const std::string poses = fmt::format("poses/{}.tum", name);
    write_tum(folder_ / poses, X_DS, comment);
    note(poses);
    const std::string calibration = fmt::format("calibration/{}.yaml", name);
    write_text(folder_ / calibration, text);
    note(calibration);
  };
  for (const PlacedLidar& lidar : simulation_.lidars) {
    if (!part_.choice.has_sensor(lidar.spec.name)) continue;
    write_calibration(lidar.spec.name, lidar.X_DS, "sensor S in D: t [s] x y z [m] qx qy qz qw",
                      calibration_text(lidar));
  }
  for (const PlacedCamera& camera : simulation_.cameras) {
    const std::string& name = camera.spec.name;
    if (!part_.choice.has_sensor(name)) continue;
    write_calibration(name, camera.X_DC, "camera C in D: t [s] x y z [m] qx qy qz qw",
                      calibration_text(camera));
    for (const std::string& suffix :
         write_exchange_calibrations(folder_ / "calibration" / name, camera))
      note(fmt::format("calibration/{}{}", name, suffix));
  }
}

// Returns the entry of a frame that is not finished.
FrameEntry DatasetWriter::entry_of(std::uint32_t sensor, std::int64_t frame) const {
  const std::chrono::nanoseconds stamp = exposed(simulation_, sensor, frame).begin;
  return {.sensor = sensors_[sensor].name, .frame = frame, .stamp = stamp};
}

std::string DatasetWriter::done_text(std::uint32_t sensor, std::int64_t frame,
                                     std::vector<ProductSum> files) const {
  FrameEntry entry = entry_of(sensor, frame);
  entry.is_done = true;
  if (sensor < simulation_.lidars.size())
    entry.convergence = convergence_of(product_path(sensor, frame, scan_suffix));
  else if (std::ranges::count(sensors_[sensor].suffixes, exposure_suffix) > 0)
    entry.exposure = exposure_of(product_path(sensor, frame, exposure_suffix));
  entry.files = std::move(files);
  return text_of(entry);
}

std::uint64_t DatasetWriter::note(std::uint32_t sensor, std::int64_t frame) {
  std::vector<ProductSum> files;
  std::uint64_t bytes = 0;
  for (const std::string& suffix : sensors_[sensor].suffixes) {
    files.push_back({suffix, sum_file(product_path(sensor, frame, suffix))});
    bytes += files.back().sum.bytes;
  }
  sensors_[sensor].entry_after[static_cast<std::size_t>(frame)] =
      1 + journal_->add(done_text(sensor, frame, std::move(files)));
  return bytes;
}

void DatasetWriter::write_record() const {
  std::uint32_t sensor = 0;
  std::int64_t frame = 0;
  const auto next = [&]() -> std::optional<std::string> {
    while (sensor < sensor_count() && (frame == frames(sensor) || !lists_frame(sensor, frame))) {
      const bool is_last = frame == frames(sensor);
      sensor += is_last ? 1 : 0;
      frame = is_last ? 0 : frame + 1;
    }
    if (sensor == sensor_count()) return std::nullopt;
    const auto after = sensors_[sensor].entry_after[static_cast<std::size_t>(frame)];
    const std::int64_t number = frame++;
    return after > 0 ? journal_->at(after - 1) : text_of(entry_of(sensor, number));
  };
  write_dataset_text(folder_, header_, part_, next, files_);
}

void DatasetWriter::close() {
  write_record();
  journal_->remove();
}

}  // namespace groundray
