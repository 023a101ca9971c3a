#include "apps/groundray/estimate.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>

#include "apps/dataset/write/dataset_writer.h"
#include "apps/dataset/write/frame_maker.h"
#include "core/error.h"
#include "sensors/camera/imager.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using Seconds = std::chrono::duration<double>;

// Temporary folder, which is removed with its contents.
class SampleFolder {
 public:
  SampleFolder() {
    std::string name = (fs::temp_directory_path() / "groundray-sample-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw Error("{}: no temporary folder can be created: {}", fs::temp_directory_path().string(),
                  std::generic_category().message(errno));
    }
    path_ = name;
  }
  ~SampleFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  SampleFolder(const SampleFolder&) = delete;
  SampleFolder& operator=(const SampleFolder&) = delete;

  const fs::path& path() const noexcept { return path_; }

 private:
  fs::path path_;
};

// Cameras that together show a part of an image of another camera.
struct Bands {
  std::vector<PlacedCamera> cameras;
  double scale = 1;  // pixels of the whole image for each of theirs
};

// Moves the top of the image to a row; returns false for a model without a principal point.
bool crop(LensModel& lens, int first_row) {
  return std::visit(
      [&]<typename Model>(Model& model) {
        if constexpr (std::is_same_v<Model, Equirectangular>) {
          return false;
        } else if constexpr (std::is_same_v<Model, FTheta>) {
          model.centre_px.y -= first_row;
        } else {
          model.scale.centre_px.y -= first_row;
        }
        return true;
      },
      lens);
}

PlacedCamera as_large_as(const PlacedCamera& whole, LensModel lens, glm::ivec2 size_px,
                         std::size_t number) {
  PlacedCamera part = whole;
  CameraSpec& spec = part.spec.camera;
  part.spec.name += fmt::format("-part{}", number);
  part.spec.lidars.clear();
  part.rectification.reset();
  spec.lens = std::move(lens);
  spec.size_px = size_px;
  part.camera = Camera(spec);
  if (whole.pupil_sr.width() > 0)
    part.pupil_sr = pupil_sr(part.camera.lens(), *spec.aperture, spec.imager->pixel_pitch_m);
  return part;
}

Bands bands_of(const PlacedCamera& whole) {
  constexpr int count = 4, rows = 16;  // EXR compresses 16 rows at a time
  const glm::ivec2 size_px = whole.spec.camera.size_px;
  Bands bands;
  LensModel first = whole.spec.camera.lens;
  if (size_px.y <= count * rows) {
    bands.cameras.push_back(as_large_as(whole, first, size_px, 0));
  } else if (!crop(first, 0)) {
    constexpr int reduction = 4;
    const glm::ivec2 small_px = glm::max(size_px / reduction, glm::ivec2(1));
    bands.cameras.push_back(as_large_as(whole, first, small_px, 0));
    bands.scale = double{1} * size_px.x * size_px.y / (double{1} * small_px.x * small_px.y);
  } else {
    for (int i = 0; i < count; ++i) {
      LensModel lens = whole.spec.camera.lens;
      crop(lens, (2 * i + 1) * size_px.y / (2 * count) - rows / 2);
      bands.cameras.push_back(
          as_large_as(whole, std::move(lens), {size_px.x, rows}, static_cast<std::size_t>(i)));
    }
    bands.scale = double{1} * size_px.y / (count * rows);
  }
  return bands;
}

// Cost of frames of the sample, by stage.
struct Cost {
  Seconds tracing{0};
  Seconds preparing{0};  // the surroundings of the sensor, where they follow it
  Seconds writing{0};    // processor time
  std::uint64_t bytes = 0;

  void add(const MadeFrame& made, const WrittenFrame& written) {
    tracing += made.tracing;
    preparing += made.making - made.tracing;
    writing += written.writing_cpu;
    bytes += written.bytes;
  }
};

// Generator of the frames of the sample.
class Sample {
 public:
  explicit Sample(const Simulation& simulation)
      : simulation_(simulation),
        dataset_(folder_.path() / "dataset", simulation, FolderUse::New),
        maker_(simulation, dataset_) {}

  Cost cost_of(std::uint32_t sensor, std::int64_t frame) {
    Cost cost;
    const MadeFrame made = maker_.make({sensor, frame});
    cost.add(made, write_frame(simulation_, dataset_, made));
    return cost;
  }
  std::int64_t frames(std::uint32_t sensor) const { return dataset_.frames(sensor); }

 private:
  SampleFolder folder_;
  const Simulation& simulation_;
  DatasetWriter dataset_;
  FrameMaker maker_;
};

}  // namespace

RunEstimate estimate_run(Simulation simulation) {
  std::vector<Bands> parts;
  for (const PlacedCamera& camera : simulation.cameras) parts.push_back(bands_of(camera));
  simulation.cameras.clear();
  for (const Bands& each : parts)
    simulation.cameras.insert(simulation.cameras.end(), each.cameras.begin(), each.cameras.end());
  Sample sample(simulation);
  RunEstimate estimate;
  // The scene is built for the first frame; the same frame again costs what any other does.
  const std::int64_t first = sample.frames(0) / 2;
  estimate.preparation = sample.cost_of(0, std::max<std::int64_t>(first - 1, 0)).preparing;
  const auto cores = static_cast<double>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  const Seconds moving = [&] {
    return simulation.terrain.whole() == nullptr ? sample.cost_of(0, first).preparing : Seconds(0);
  }();
  const auto add = [&](const Cost& cost, double scale, std::int64_t frames,
                       std::vector<RunEstimate::Frame>& into) {
    // Files are compressed on one thread while the next frame is traced on all.
    const RunEstimate::Frame frame{
        moving + scale * (cost.tracing + cost.writing / cores),
        static_cast<std::uint64_t>(scale * static_cast<double>(cost.bytes))};
    into.push_back(frame);
    estimate.total += static_cast<double>(frames) * frame.time;
    estimate.total_bytes += static_cast<std::uint64_t>(frames) * frame.bytes;
  };
  estimate.total = estimate.preparation;
  std::uint32_t sensor = 0;
  for (; sensor < simulation.lidars.size(); ++sensor) {
    const std::int64_t frames = sample.frames(sensor);
    add(sample.cost_of(sensor, frames / 2), 1, frames, estimate.scans);
  }
  for (const Bands& each : parts) {
    const std::int64_t frames = sample.frames(sensor);
    Cost cost;
    for (std::size_t i = 0; i < each.cameras.size(); ++i, ++sensor) {
      const Cost band = sample.cost_of(sensor, frames / 2);
      cost.tracing += band.tracing;
      cost.writing += band.writing;
      cost.bytes += band.bytes;
    }
    add(cost, each.scale, frames, estimate.images);
  }
  return estimate;
}

}  // namespace groundray
