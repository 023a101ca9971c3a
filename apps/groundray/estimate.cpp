#include "apps/groundray/estimate.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <type_traits>
#include <utility>
#include <variant>

#include "apps/dataset/write/dataset_writer.h"
#include "apps/dataset/write/frame_maker.h"
#include "core/io/temporary_folder.h"
#include "sensors/camera/auto_exposure.h"

namespace groundray {
namespace {

using Seconds = std::chrono::duration<double>;

constexpr std::size_t echo_row_bytes = 30;  // of write_imaged_echoes

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

ImageF rows_of(const ImageF& image, int first, int count) {
  ImageF rows(image.width(), count, image.channels());
  const auto values = static_cast<std::ptrdiff_t>(image.width()) * image.channels();
  std::copy_n(image.values().begin() + values * first, values * count, rows.values().begin());
  return rows;
}

// Returns the rows of a camera's image from `first` on as a camera.
PlacedCamera band_of(const PlacedCamera& whole, LensModel lens, int first, int count) {
  PlacedCamera band = whole;
  CameraSpec& spec = band.spec.camera;
  band.spec.name += fmt::format("-rows{}", first);
  band.rectification.reset();
  spec.lens = std::move(lens);
  spec.size_px.y = count;
  band.camera = Camera(spec);
  if (whole.pupil_sr.width() > 0) band.pupil_sr = rows_of(whole.pupil_sr, first, count);
  return band;
}

Bands bands_of(const PlacedCamera& whole) {
  constexpr int count = 4, rows = 16;  // EXR compresses 16 rows at a time
  const int height = whole.spec.camera.size_px.y;
  LensModel lens = whole.spec.camera.lens;
  Bands bands;
  if (height <= count * rows || !crop(lens, 0)) {
    bands.cameras.push_back(band_of(whole, std::move(lens), 0, height));
    return bands;
  }
  for (int i = 0; i < count; ++i) {
    const int first = (2 * i + 1) * height / (2 * count) - rows / 2;
    lens = whole.spec.camera.lens;
    crop(lens, first);
    bands.cameras.push_back(band_of(whole, lens, first, rows));
    if (i > 0) bands.cameras.back().spec.lidars.clear();  // their echoes are listed once
  }
  bands.scale = double{1} * height / (count * rows);
  return bands;
}

// Gives a camera an exposure time and a gain.
void fix_exposure(PlacedCamera& camera, const ExposureSetting& exposure) {
  CameraSpec& spec = camera.spec.camera;
  spec.shutter.automatic.reset();
  spec.shutter.exposure_s = exposure.exposure_s;
  if (spec.imager) spec.imager->gain_dn_e *= exposure.gain;
  camera.camera = Camera(spec);
}

// Cost of frames of the sample, by stage.
struct Cost {
  Seconds tracing{0};
  Seconds preparing{0};  // surroundings of the sensor, where they follow it; echoes in images
  Seconds writing{0};    // processor time
  std::uint64_t bytes = 0, echo_bytes = 0;  // of all files but the lists of echoes; of these

  void add(const MadeFrame& made, const WrittenFrame& written) {
    tracing += made.tracing;
    preparing += made.making - made.tracing;
    writing += written.writing_cpu;
    bytes += written.bytes;
  }
  Cost& operator+=(const Cost& other) {
    tracing += other.tracing;
    preparing += other.preparing;
    writing += other.writing;
    bytes += other.bytes;
    echo_bytes += other.echo_bytes;
    return *this;
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
    for (const auto& echoes : made.echoes) cost.echo_bytes += echoes.size() * echo_row_bytes;
    cost.bytes -= std::min(cost.bytes, cost.echo_bytes);
    return cost;
  }
  ExposureSetting exposure_of(std::uint32_t camera, std::int64_t image) {
    return maker_.exposure_of({camera, image});
  }
  std::int64_t frames(std::uint32_t sensor) const { return dataset_.frames(sensor); }

 private:
  TemporaryFolder folder_;
  const Simulation& simulation_;
  DatasetWriter dataset_;
  FrameMaker maker_;
};

}  // namespace

RunEstimate estimate_run(Simulation simulation) {
  const auto lidars = static_cast<std::uint32_t>(simulation.lidars.size());
  const std::size_t cameras = simulation.cameras.size();
  std::vector<double> scales;
  std::vector<std::size_t> band_ends;  // in simulation.cameras, after the cameras themselves
  for (std::size_t i = 0; i < cameras; ++i) {
    Bands bands = bands_of(simulation.cameras[i]);
    scales.push_back(bands.scale);
    std::ranges::move(bands.cameras, std::back_inserter(simulation.cameras));
    band_ends.push_back(simulation.cameras.size());
  }
  Sample sample(simulation);
  RunEstimate estimate;
  // The first frame includes building the scene.
  const std::uint32_t first_sensor = lidars > 0 ? 0 : static_cast<std::uint32_t>(cameras);
  const std::int64_t first = sample.frames(first_sensor) / 2;
  estimate.preparation =
      sample.cost_of(first_sensor, std::max<std::int64_t>(first - 1, 0)).preparing;
  // Where levels of the terrain follow the sensor, every scan and image moves them.
  const Seconds moving = simulation.terrain.whole() == nullptr
                             ? sample.cost_of(first_sensor, first).preparing
                             : Seconds(0);
  estimate.total = estimate.preparation;
  // Files are compressed on one thread while the next frame is traced on all.
  const auto threads = static_cast<double>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  const auto add = [&](const Cost& cost, Seconds once, double scale, std::int64_t frames,
                       std::vector<RunEstimate::Frame>& into) {
    const RunEstimate::Frame frame{
        moving + once + scale * (cost.tracing + cost.writing / threads),
        static_cast<std::uint64_t>(scale * static_cast<double>(cost.bytes)) + cost.echo_bytes};
    into.push_back(frame);
    estimate.total += static_cast<double>(frames) * frame.time;
    estimate.total_bytes += static_cast<std::uint64_t>(frames) * frame.bytes;
  };
  for (std::uint32_t lidar = 0; lidar < lidars; ++lidar) {
    const std::int64_t frames = sample.frames(lidar);
    add(sample.cost_of(lidar, frames / 2), Seconds(0), 1, frames, estimate.scans);
  }
  std::size_t band = cameras;
  for (std::size_t camera = 0; camera < cameras; ++camera) {
    const std::uint32_t sensor = lidars + static_cast<std::uint32_t>(camera);
    const std::int64_t frames = sample.frames(sensor);
    Seconds metering{0};
    if (simulation.cameras[camera].spec.camera.shutter.automatic) {
      const auto begin = std::chrono::steady_clock::now();
      const ExposureSetting exposure = sample.exposure_of(sensor, frames / 2);
      metering = std::chrono::steady_clock::now() - begin;
      for (std::size_t i = band; i < band_ends[camera]; ++i)
        fix_exposure(simulation.cameras[i], exposure);
    }
    Cost cost;
    for (; band < band_ends[camera]; ++band)
      cost += sample.cost_of(lidars + static_cast<std::uint32_t>(band), frames / 2);
    add(cost, metering + cost.preparing, scales[camera], frames, estimate.images);
  }
  return estimate;
}

}  // namespace groundray
