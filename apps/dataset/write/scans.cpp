#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>

#include "apps/dataset/dataset_reader.h"
#include "apps/dataset/write/boxes.h"
#include "apps/dataset/write/frame_files.h"
#include "apps/dataset/write/preview.h"
#include "core/image/png_io.h"
#include "core/io/npy_io.h"
#include "core/io/ply_io.h"
#include "sensors/lidar/scan_boxes.h"

namespace groundray {
namespace {

constexpr const char* preview_suffix = "_preview.png";
constexpr const char* no_returns_suffix = "_no_returns.ply";
constexpr const char* wave_suffix = "_wave.npy";
constexpr const char* wave_index_suffix = "_wave_index.npy";

bool has_no_returns(const LidarSpec& lidar) {
  return lidar.no_returns == LidarSpec::NoReturns::Report;
}
bool has_boxes(const LidarSpec& lidar) { return lidar.boxes == LidarSpec::Boxes::Report; }
bool has_waveforms(const LidarSpec& lidar) {
  return lidar.waveforms != LidarSpec::WaveformOutput::Omit;
}

std::vector<std::string> comments_of(const Simulation& simulation, const LidarScan& scan) {
  const glm::dvec3 origin_m = simulation.terrain.header().origin_w_m;
  std::vector<std::string> comments{
      fmt::format("origin_w {} {} {}", origin_m.x, origin_m.y, origin_m.z)};
  const Convergence& seen = scan.convergence;
  if (seen.pulses > 0) {
    comments.push_back(fmt::format(
        "{}{{pulses: {}, other_echoes: {}, range_rms_m: {:.3g}, range_max_m: {:.3g}, "
        "true_rms_m: {:.3g}, true_max_m: {:.3g}, share_rms: {:.3g}, share_max: {:.3g}}}",
        convergence_comment, seen.pulses, seen.changed, seen.range_m.rms(), seen.range_m.largest,
        seen.true_m.rms(), seen.true_m.largest, seen.share.rms(), seen.share.largest));
  }
  if (scan.waveforms.interval_s > 0)
    comments.push_back(fmt::format("waveform_interval_s {}", scan.waveforms.interval_s));
  return comments;
}

}  // namespace

std::vector<std::string> scan_suffixes(const MountedLidar& mounted) {
  const LidarSpec& lidar = mounted.lidar;
  std::vector<std::string> suffixes{preview_suffix};
  if (has_no_returns(lidar)) suffixes.emplace_back(no_returns_suffix);
  if (has_boxes(lidar)) suffixes.emplace_back(boxes_suffix);
  if (has_waveforms(lidar)) {
    suffixes.emplace_back(wave_suffix);
    suffixes.emplace_back(wave_index_suffix);
  }
  suffixes.emplace_back(scan_suffix);
  return suffixes;
}

void write_scan(const Simulation& simulation, const DatasetWriter& dataset, std::uint32_t sensor,
                std::int64_t frame, const LidarScan& scan) {
  const PlacedLidar& lidar = simulation.lidars[sensor];
  const auto path_of = [&](std::string_view suffix) {
    return dataset.product_path(sensor, frame, suffix);
  };
  write_png(path_of(preview_suffix),
            draw_preview(scan.echoes, lidar, simulation.terrain.ground(), frame));
  if (has_no_returns(lidar.spec.lidar)) write_ply(path_of(no_returns_suffix), scan.no_returns, {});
  if (has_boxes(lidar.spec.lidar)) {
    const auto stamp = lidar.lidar.pattern().stamp(frame);
    const SceneObjects& objects = simulation.scene_objects;
    write_boxes(path_of(boxes_suffix), objects,
                scanned_instances(scan.echoes, objects.boxes, stamp), stamp);
  }
  if (has_waveforms(lidar.spec.lidar)) {
    const Waveforms& waveforms = scan.waveforms;
    write_npy(path_of(wave_suffix), {{"", "<f4"}}, waveforms.power_w.size(),
              std::as_bytes(std::span(waveforms.power_w)));
    static_assert(sizeof(WaveformRun) == 24);  // sum of the fields below
    write_npy(path_of(wave_index_suffix),
              {{"pulse", "<u4"}, {"count", "<u4"}, {"first_sample", "<u8"}, {"start_s", "<f8"}},
              waveforms.runs.size(), std::as_bytes(std::span(waveforms.runs)));
  }
  write_ply(path_of(scan_suffix), scan.echoes, comments_of(simulation, scan));
}

}  // namespace groundray
