#include "apps/groundray/run/expected_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/dataset/dataset_text.h"
#include "core/io/text_lines.h"

namespace groundray {
namespace {

constexpr std::string_view no_file = "not a file of the dataset";

}  // namespace

ExpectedFiles::ExpectedFiles(const DatasetSummary& dataset)
    : dataset_(dataset), runs_(dataset.sensors.size()) {
  files_.emplace(dataset_file);
  for (const DatasetSummary::Sensor& sensor : dataset.sensors)
    add_folders(fmt::format("{}/{}/", sensor.kind, sensor.name));
}

// Adds all folders in a path.
void ExpectedFiles::add_folders(const std::string& path) {
  for (std::size_t slash = path.find('/'); slash != std::string::npos;
       slash = path.find('/', slash + 1))
    folders_.insert(path.substr(0, slash));
}

bool ExpectedFiles::add(const FrameEntry& frame) {
  const auto sensor =
      std::ranges::find(dataset_.sensors, frame.sensor, &DatasetSummary::Sensor::name);
  if (sensor == dataset_.sensors.end() || frame.frame >= sensor->frames) return false;
  std::vector<Run>& runs = runs_[static_cast<std::size_t>(sensor - dataset_.sensors.begin())];
  if (!runs.empty() && frame.frame < runs.back().end) return false;
  Suffixes suffixes;
  for (const ProductSum& file : frame.files) suffixes.insert(file.suffix);
  const Suffixes* const kind = &*kinds_.insert(std::move(suffixes)).first;
  if (!runs.empty() && runs.back().end == frame.frame && runs.back().suffixes == kind)
    ++runs.back().end;
  else
    runs.push_back({frame.frame, frame.frame + 1, kind});
  return true;
}

void ExpectedFiles::add(const NamedSum& file) {
  files_.insert(file.path);
  add_folders(file.path);
}

std::optional<std::string> ExpectedFiles::fault_of(std::string_view path) const {
  if (files_.contains(path)) return std::nullopt;
  const std::size_t slash = path.rfind('/');
  if (slash == std::string_view::npos) return std::string(no_file);
  const std::string_view folder = path.substr(0, slash), name = path.substr(slash + 1);
  const auto sensor = std::ranges::find_if(dataset_.sensors, [&](const auto& each) {
    return folder == fmt::format("{}/{}", each.kind, each.name);
  });
  const std::size_t digits = std::min(name.find_first_not_of("0123456789"), name.size());
  const auto number = number_of<std::int64_t>(name.substr(0, digits));
  if (sensor == dataset_.sensors.end() || !number || *number >= sensor->frames ||
      fmt::format("{:06}", *number) != name.substr(0, digits))
    return std::string(no_file);
  const std::vector<Run>& runs = runs_[static_cast<std::size_t>(sensor - dataset_.sensors.begin())];
  const auto run = std::ranges::upper_bound(runs, *number, {}, &Run::end);
  if (run == runs.end() || *number < run->begin)
    return "of an unfinished frame; --resume of `groundray generate`, or of `groundray merge` if "
           "that was interrupted, continues with it";
  if (run->suffixes->contains(name.substr(digits))) return std::nullopt;
  return std::string(no_file);
}

}  // namespace groundray
