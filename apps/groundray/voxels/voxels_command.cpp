#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/dataset/scan_files.h"
#include "apps/groundray/command.h"
#include "apps/groundray/voxels/label_voxels.h"
#include "apps/groundray/voxels/visible_voxels.h"
#include "apps/groundray/voxels/voxel_labels.h"
#include "apps/groundray/whole_folder.h"
#include "apps/scan/number_checks.h"
#include "apps/scene/frames.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/print_error.h"
#include "core/progress.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

struct VoxelsOptions {
  fs::path scene, out;
  std::vector<std::string> lidars;
  std::string frames = ":";
  std::string labels;
  std::optional<std::uint64_t> seed;
  std::optional<std::uint32_t> world;
  std::int64_t views = 70;  // of SemanticKITTI's own tool
};

template <typename Value>
void write_values(const fs::path& path, const std::vector<Value>& values) {
  static_assert(std::endian::native == std::endian::little);
  write_text(path, {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)});
}

// Makes the voxels of the scans of one lidar.
class VoxelMaker {
 public:
  VoxelMaker(const Simulation& simulation, std::size_t lidar, const VoxelsOptions& options)
      : simulation_(simulation),
        number_(lidar),
        lidar_(simulation.lidars[lidar]),
        options_(options),
        scene_for_(simulation) {}

  void write(std::int64_t sweep, const fs::path& stem) {
    const VoxelGrid& grid = semantic_kitti_grid;
    const auto stamp = lidar_.lidar.pattern().stamp(sweep);
    const Pose X_SD = inverse(lidar_.X_DS.pose_at(stamp));
    const Scene& scene = scene_for_(exposed(lidar_, sweep));
    const VoxelLabelMap map = voxel_labels(simulation_.spec, scene, options_.labels);
    const std::vector<std::uint16_t> labels =
        label_voxels(simulation_, scene, grid, X_SD, stamp, map, stop_if_interrupted);
    const LidarScan scan = make_scan(simulation_, number_, sweep, scene);
    VoxelFlags crossed(grid.count(), 0);
    std::vector<glm::dvec3> positions;
    const std::int64_t end = std::min(lidar_.sweeps, sweep + 1 + options_.views);
    for (std::int64_t view = sweep; view < end; ++view) {
      stop_if_interrupted();
      const Pose X_DS = lidar_.X_DS.pose_at(lidar_.lidar.pattern().stamp(view));
      positions.push_back(X_SD * X_DS.translation_m);
      flag_crossed(lidar_, view, scene_for_(exposed(lidar_, view)), grid, X_SD, crossed);
    }
    const VoxelVisibility visibility = visibility_of(grid, labels, positions, stop_if_interrupted);
    const auto file = [&](const char* ending) {
      fs::path path = stem;
      return path += ending;
    };
    write_values(file(".bin"), packed(scanned_voxels(lidar_, sweep, scan.echoes, grid)));
    write_values(file(".label"), labels);
    write_values(file(".invalid"), packed(visibility.invalid));
    write_values(file(".occluded"), packed(visibility.occluded));
    write_values(file(".seen"), packed(crossed));
    occupied_ += labels.size() - static_cast<std::size_t>(std::ranges::count(labels, 0));
  }

  std::size_t occupied() const { return occupied_; }

 private:
  const Simulation& simulation_;
  std::size_t number_;
  const PlacedLidar& lidar_;
  const VoxelsOptions& options_;
  FrameSceneBuilder scene_for_;
  std::size_t occupied_ = 0;
};

// Returns the indices of the lidars with these names, or of all.
std::vector<std::size_t> chosen_lidars(const Simulation& simulation, const VoxelsOptions& options) {
  std::vector<std::string> names;
  for (const PlacedLidar& lidar : simulation.lidars) names.push_back(lidar.spec.name);
  if (names.empty())
    throw Error("{}: has no lidar, whose frame the voxels are in", options.scene.string());
  for (const std::string& name : options.lidars) {
    if (std::ranges::find(names, name) == names.end()) {
      throw Error("--lidar {}: the scene has no such lidar; it has {}", name,
                  fmt::join(names, ", "));
    }
  }
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (options.lidars.empty() ||
        std::ranges::find(options.lidars, names[i]) != options.lidars.end())
      chosen.push_back(i);
  }
  return chosen;
}

// Returns the numbers of the chosen sweeps.
std::vector<std::int64_t> chosen_sweeps(const PlacedLidar& lidar, const VoxelsOptions& options) {
  const FrameRange range = parse_frames(options.frames);
  std::vector<std::int64_t> sweeps;
  for (std::int64_t sweep = 0; sweep < lidar.sweeps; ++sweep)
    if (range.contains(static_cast<std::size_t>(sweep))) sweeps.push_back(sweep);
  if (sweeps.empty()) {
    throw Error("--frames {}: selects none of the {} scans of lidar '{}', numbered from 0",
                options.frames, lidar.sweeps, lidar.spec.name);
  }
  return sweeps;
}

void make_voxels(const VoxelsOptions& options) {
  WholeFolder folder(options.out);
  std::optional<Seed> seed;
  if (options.seed) seed = Seed{*options.seed};
  const Simulation simulation = load_simulation(options.scene, seed, options.world);
  std::size_t sequence = 0;
  for (const std::size_t lidar : chosen_lidars(simulation, options)) {
    const PlacedLidar& placed = simulation.lidars[lidar];
    const std::vector<std::int64_t> sweeps = chosen_sweeps(placed, options);
    const fs::path name = fmt::format("sequences/{:02}/voxels", sequence);
    fs::create_directories(folder.file(name));
    VoxelMaker maker(simulation, lidar, options);
    Progress progress(stderr, "grids", sweeps.size());
    for (std::size_t i = 0; i < sweeps.size(); ++i) {
      maker.write(sweeps[i], folder.file(name / fmt::format("{:06}", sweeps[i])));
      progress.update(i + 1);
    }
    print_text(stdout, "sequence {:02} of {}: {} grids, {} occupied voxels on average\n", sequence,
               placed.spec.name, sweeps.size(), maker.occupied() / sweeps.size());
    ++sequence;
  }
  folder.appear();
}

}  // namespace

Command add_voxels_command(CLI::App& app) {
  const auto options = std::make_shared<VoxelsOptions>();
  CLI::App* command = app.add_subcommand(
      "voxels", "Write occupied, labelled and visible voxels around a lidar, as SemanticKITTI");
  command->add_option("SCENE", options->scene, "Scene file")->required();
  command->add_option("-o,--output", options->out, "New or empty folder")->required();
  command->add_option("--lidar", options->lidars, "Lidar of the scene; may be repeated (all)");
  command->add_option("--frames", options->frames,
                      "Scans A:B:STEP, numbered from 0 (all; SemanticKITTI has ::5)");
  command->add_option("--labels", options->labels,
                      "Label set of a public dataset, such as semantic_kitti (the scene's labels)");
  command
      ->add_option("--views", options->views,
                   "Number of following scans from which voxels count as visible (70)")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000}));
  command
      ->add_option("--seed", options->seed,
                   "Seed of noise and scattered objects, instead of the scene's")
      ->check(whole());
  command->add_option("--world", options->world, "One of the worlds of the scene, from 0")
      ->check(whole());
  return {command, [options] { make_voxels(*options); }};
}

}  // namespace groundray
