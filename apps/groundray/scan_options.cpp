#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>
#include <string>
#include <string_view>

#include "apps/groundray/command.h"
#include "apps/scan/word_option.h"

namespace groundray {

CLI::Option* option_of(CLI::App& command, std::string_view name) {
  for (CLI::Option* option : command.get_options()) {
    for (const std::string& each : option->get_lnames())
      if (name == "--" + each) return option;
  }
  for (CLI::App* group : command.get_subcommands({})) {
    if (!group->get_name().empty()) continue;
    if (CLI::Option* option = option_of(*group, name)) return option;
  }
  return nullptr;
}

std::size_t machine_bytes() {
  const auto pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
  std::size_t bytes = std::numeric_limits<std::size_t>::max();
  if (pages > 0 && page_bytes > 0)
    bytes = static_cast<std::size_t>(pages) * static_cast<std::size_t>(page_bytes);
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    bytes = std::min<std::size_t>(bytes, limit.rlim_cur);
  return bytes;
}

ReportFacts facts_of(const std::string& command, std::span<const std::filesystem::path> inputs) {
  std::string all;
  for (const auto& input : inputs) all += (all.empty() ? "" : " ") + input.string();
  return {{"version", GROUNDRAY_VERSION}, {"command", command}, {"input", all}};
}

void ScanOptions::add(CLI::App* command) {
  CLI::App* scans = command->add_option_group("Scans");
  scans->add_option("--sensor", choice.sensors, "Lidars of a dataset (all)")->delimiter(',');
  scans->add_option("--frames", frames, "A:B:STEP: frames or files from A to before B");
  add_poses(scans);
  const Words<ReturnChoice> choices{{"last", ReturnChoice::Last},
                                    {"strongest", ReturnChoice::Strongest},
                                    {"first", ReturnChoice::First}};
  add_words(scans, "--returns", taking.returns, "Return of each pulse to use", choices);
  add_number(scans, "--range-sd-m", taking.range_sd_m, not_negative(),
             "Standard deviation of ranges, instead of the scans'");
  scans->add_flag("--no-labels", leaves_labels, "Omit semantic classes");
  columns.add(scans, "");
}

void ScanOptions::add_grid(CLI::App* command) {
  const Words<GridSource> grids{{"beams", GridSource::Beams}, {"file", GridSource::File}};
  add_words(command, "--grid", taking.grid,
            "Neighbours of points: by rings and azimuths, or by the file's own image", grids);
}

void ScanOptions::add_poses(CLI::App* scans) {
  scans->add_option(
      "--poses", choice.poses,
      "Poses of the sensor (TUM: t x y z qx qy qz qw) for files, or instead of the dataset's");
  const Words<PoseOrder> orders{{"line", PoseOrder::Line}, {"name", PoseOrder::Name}};
  add_words(scans, "--pose-by", choice.order,
            "Pose of each file: by line, or by the stamp in the file's name", orders);
  const Words<LidarSpec::Points> frames_of{{"as_fired", LidarSpec::Points::AsFired},
                                           {"at_stamp", LidarSpec::Points::AtStamp}};
  add_words(scans, "--points", choice.points,
            "Frame of the points: the sensor's when each was measured, or at the scan's stamp",
            frames_of);
}

void ScanOptions::close() {
  choice.frames = parse_frames(frames);
  taking.columns = columns.reading();
  choice.conf_unit_m = taking.columns.unit_m;
  if (leaves_labels) taking.labels = LabelUse::Leave;
}

}  // namespace groundray
