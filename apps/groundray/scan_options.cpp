#include "apps/groundray/scan_options.h"

#include <CLI/CLI.hpp>

#include "apps/scan/word_option.h"

namespace groundray {
void ScanOptions::add(CLI::App* command) {
  CLI::App* scans = command->add_option_group("Scans");
  scans->add_option("--sensor", choice.sensors, "Lidars of a dataset; all without it")
      ->delimiter(',');
  scans->add_option("--frames", frames, "A:B:STEP, from A on to before B: frames, or files");
  add_poses(scans);
  const Words<ReturnChoice> choices{{"last", ReturnChoice::Last},
                                    {"strongest", ReturnChoice::Strongest},
                                    {"first", ReturnChoice::First}};
  add_words(scans, "--returns", taking.returns, "Which return of a pulse is taken", choices);
  scans
      ->add_option("--range-sd-m", taking.range_sd_m,
                   "Standard deviation of ranges, instead of what scans tell")
      ->check(not_negative());
  scans->add_flag("--no-labels", leaves_labels, "Leave semantic classes out");
  columns.add(scans, "");
}

void ScanOptions::add_grid(CLI::App* command) {
  const Words<GridSource> grids{{"beams", GridSource::Beams}, {"file", GridSource::File}};
  add_words(command, "--grid", taking.grid,
            "What makes points neighbours: rings and azimuths, or the file's own image", grids);
}

void ScanOptions::add_poses(CLI::App* scans) {
  scans->add_option("--poses", choice.poses,
                    "Poses of the sensor (TUM: t x y z qx qy qz qw) for files, or instead of a "
                    "dataset's");
  const Words<PoseOrder> orders{{"line", PoseOrder::Line}, {"name", PoseOrder::Name}};
  add_words(scans, "--pose-by", choice.order,
            "Which pose is a file's: that of its line, or by the stamp that is its name", orders);
  const Words<LidarSpec::Points> frames_of{{"as_fired", LidarSpec::Points::AsFired},
                                           {"at_stamp", LidarSpec::Points::AtStamp}};
  add_words(scans, "--points", choice.points,
            "In which frame points are: the sensor's as each was measured, or at the "
            "scan's stamp",
            frames_of);
}

void ScanOptions::close() {
  choice.frames = parse_frames(frames);
  taking.columns = columns.reading();
  choice.conf_unit_m = taking.columns.unit_m;
  if (leaves_labels) taking.labels = LabelUse::Leave;
}

}  // namespace groundray
