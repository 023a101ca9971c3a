#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "apps/dataset/write/boxes.h"
#include "apps/dataset/write/frame_files.h"
#include "apps/dataset/write/preview.h"
#include "core/image/exr_io.h"
#include "core/image/flow_io.h"
#include "core/image/luminance.h"
#include "core/image/png_io.h"
#include "core/io/file_io.h"
#include "sensors/camera/image_truth.h"
#include "sensors/camera/lidar_image.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;
using Product = CameraProduct;

// Returns true if the product is stored in the image's EXR file.
bool is_layer(Product product) { return product <= Product::Flow || product == Product::Coverage; }

std::string echoes_suffix(const std::string& lidar) { return "_" + lidar + ".npy"; }

// Channels collected for one EXR file.
struct Layers {
  std::vector<ExrLayer> all;

  void add(std::vector<std::string> names, const ImageF& image) {
    all.push_back({std::move(names), &image});
  }
  void add(const char* name, const Image32& image) { all.push_back({{name}, &image}); }
};

void add_light(const Exposure& light, const CameraSpec& camera,
               std::span<const std::uint16_t> labels, Layers& layers) {
  if (gives(camera, Product::Radiance)) {
    layers.add({"R", "G", "B"}, light.radiance);
    layers.add({"StdError.R", "StdError.G", "StdError.B"}, light.standard_error);
    layers.add({"Samples"}, light.samples);
  }
  if (!gives(camera, Product::Coverage)) return;
  std::vector<std::string> names;
  for (const std::uint16_t label : labels) names.push_back(fmt::format("Coverage.{}", label));
  layers.add(std::move(names), light.coverage);
}

// Channels of a truth that are stored with another type.
struct TruthInFile {
  ImageF p_DQ;
  Image32 is_valid, forward_is_seen, backward_is_seen;

  explicit TruthInFile(const ImageTruth& truth)
      : p_DQ(converted<float>(truth.p_DQ)),
        is_valid(converted<std::uint32_t>(truth.is_valid)),
        forward_is_seen(converted<std::uint32_t>(truth.forward.is_seen)),
        backward_is_seen(converted<std::uint32_t>(truth.backward.is_seen)) {}

 private:
  template <typename T, typename From>
  static Image<T> converted(const Image<From>& from) {
    if (from.width() == 0) return {};
    Image<T> to(from.width(), from.height(), from.channels());
    std::ranges::transform(from.values(), to.values().begin(),
                           [](From value) { return static_cast<T>(value); });
    return to;
  }
};

void add_flow(const std::string& name, const Flow& flow, const Image32& is_seen, Layers& layers) {
  if (flow.offset_px.width() == 0) return;
  layers.add({name + ".u", name + ".v"}, flow.offset_px);
  layers.all.push_back({{name + ".seen"}, &is_seen});
}

void add_truth(const ImageTruth& truth, const TruthInFile& in_file, const CameraSpec& camera,
               Layers& layers) {
  if (gives(camera, Product::Truth)) {
    layers.add("Valid", in_file.is_valid);
    layers.add({"Distance"}, truth.range_m);
    layers.add({"Z"}, truth.depth_m);
    layers.add({"P.X", "P.Y", "P.Z"}, in_file.p_DQ);
    layers.add({"N.X", "N.Y", "N.Z"}, truth.normal);
    layers.add({"Ns.X", "Ns.Y", "Ns.Z"}, truth.shading_normal);
    layers.add({"Albedo.R", "Albedo.G", "Albedo.B"}, truth.albedo);
    layers.add({"Incidence"}, truth.incidence_rad);
    layers.add({"Velocity.X", "Velocity.Y", "Velocity.Z"}, truth.velocity_m_s);
    layers.add("Label", truth.label);
    layers.add("Instance", truth.instance);
    layers.add("Material", truth.material);
  }
  if (gives(camera, Product::Bound)) layers.add({"Bound"}, truth.bound_m);
  if (!gives(camera, Product::Flow)) return;
  add_flow("FlowForward", truth.forward, in_file.forward_is_seen, layers);
  add_flow("FlowBackward", truth.backward, in_file.backward_is_seen, layers);
}

// Returns the transform from D to C in the middle of the image's time: with a rolling shutter, each
// row has its own pose.
glm::mat4 world_to_camera(const PlacedCamera& placed, nanoseconds begin) {
  const Pose X_CD = inverse(placed.X_DC.pose_at(begin + placed.camera.duration() / 2));
  glm::mat4 matrix(glm::mat3_cast(glm::quat(X_CD.rotation)));
  matrix[3] = glm::vec4(glm::vec3(X_CD.translation_m), 1);
  return matrix;
}

std::vector<ExrAttribute> attributes_of(const PlacedCamera& placed, nanoseconds begin,
                                        const MadeImage& made) {
  const CameraSpec& camera = placed.spec.camera;
  const double exposure_s = made.light ? made.exposure.exposure_s : camera.shutter.exposure_s;
  std::vector<ExrAttribute> attributes{
      {"cameraModel", camera.model},
      {"radianceUnit", "W/(m^2 sr), 683 lm/W"},
      {"pixelCentres", "whole"},
      {"whiteLuminance", static_cast<float>(luminous_efficacy_lm_w)},
      {"expTime", static_cast<float>(exposure_s)},
      {"worldToCamera", world_to_camera(placed, begin)}};
  if (camera.aperture)
    attributes.push_back({"aperture", static_cast<float>(camera.aperture->f_number)});
  return attributes;
}

// Writes each requested stage of the imager to its own file.
void write_stages(const CameraSpec& camera, const ImagerStages& stages,
                  const std::function<std::filesystem::path(const char*)>& path_of) {
  if (gives(camera, Product::Irradiance))
    write_exr(path_of("_irradiance.exr"), {{{"R", "G", "B"}, &stages.irradiance_w_m2}});
  if (gives(camera, Product::Photons))
    write_exr(path_of("_photons.exr"), {{{"Y"}, &stages.photons}});
  if (gives(camera, Product::Electrons))
    write_exr(path_of("_electrons.exr"), {{{"Y"}, &stages.electrons}});
  if (gives(camera, Product::Raw)) write_png(path_of("_raw.png"), stages.raw_dn);
  if (stages.picture)
    std::visit([&](const auto& image) { write_png(path_of(".png"), image); },
               stages.picture->picture);
}

// Returns the lines of an image's *_exposure.yaml.
std::string exposure_text(const ExposureSetting& exposure, const PictureSpec& spec,
                          const ImagerStages& stages) {
  std::string text = fmt::format("exposure_s: {:.9g}\ngain: {:.6g}\nsaturated: {:.6g}\n",
                                 exposure.exposure_s, exposure.gain, stages.saturated_share);
  if (!stages.picture) return text;
  const auto& [picture, gains, lift] = *stages.picture;
  if (spec.balances_white)
    text += fmt::format("white_balance: [{:.6g}, {:.6g}, {:.6g}]\n", gains.r, gains.g, gains.b);
  if (spec.tone_key) text += fmt::format("tone_lift: {:.6g}\n", lift);
  return text;
}

// Returns the last scan that has begun by the middle of the image's time, or the first scan.
std::int64_t scan_at(const PlacedLidar& lidar, nanoseconds time) {
  std::int64_t scan = 0;
  while (scan + 1 < lidar.sweeps && lidar.lidar.pattern().stamp(scan + 1) <= time) ++scan;
  return scan;
}

// Returns a flow that is unknown everywhere, as for the last image, which has no next one.
ImageF unknown_flow(glm::ivec2 size_px) {
  ImageF flow_px(size_px.x, size_px.y, 2);
  std::ranges::fill(flow_px.values(), std::numeric_limits<float>::quiet_NaN());
  return flow_px;
}

// Returns the number of flows that exceed the range of KITTI's format.
std::size_t write_flows(const CameraSpec& camera, const ImageF& forward_px,
                        const std::function<std::filesystem::path(const char*)>& path_of) {
  if (gives(camera, Product::FlowFlo)) write_flo(path_of(".flo"), forward_px);
  return gives(camera, Product::FlowKitti) ? write_kitti_flow(path_of("_flow.png"), forward_px) : 0;
}

}  // namespace

std::vector<OverlaidScan> shown_scans(const Simulation& simulation, std::size_t camera,
                                      std::int64_t image) {
  const PlacedCamera& placed = simulation.cameras[camera];
  const nanoseconds begin = placed.begins[static_cast<std::size_t>(image)];
  std::vector<OverlaidScan> scans;
  for (const std::string& name : placed.spec.lidars) {
    const auto lidar = std::ranges::find(simulation.lidars, name,
                                         [](const PlacedLidar& each) { return each.spec.name; });
    scans.push_back({static_cast<std::uint32_t>(lidar - simulation.lidars.begin()),
                     scan_at(*lidar, begin + placed.camera.duration() / 2)});
  }
  return scans;
}

std::vector<ImagedEcho> show_echoes(const Simulation& simulation, std::size_t camera,
                                    std::int64_t image, const OverlaidScan& shown,
                                    const PointCloud& echoes, const Scene& scene) {
  const PlacedCamera& placed = simulation.cameras[camera];
  return image_echoes(placed.camera, scene, placed.X_DC,
                      placed.begins[static_cast<std::size_t>(image)], echoes,
                      simulation.lidars[shown.lidar].lidar.pattern().stamp(shown.scan));
}

std::vector<std::string> image_suffixes(const MountedCamera& mounted) {
  const CameraSpec& camera = mounted.camera;
  std::vector<std::string> suffixes{"_preview.png"};
  const auto add = [&](Product product, const char* suffix) {
    if (gives(camera, product)) suffixes.emplace_back(suffix);
  };
  add(Product::FlowFlo, ".flo");
  add(Product::FlowKitti, "_flow.png");
  add(Product::Boxes, boxes_suffix);
  add(Product::Irradiance, "_irradiance.exr");
  add(Product::Photons, "_photons.exr");
  add(Product::Electrons, "_electrons.exr");
  add(Product::Raw, "_raw.png");
  add(Product::Picture, ".png");
  if (gives_signal(camera)) suffixes.emplace_back(exposure_suffix);
  for (const std::string& lidar : mounted.lidars) suffixes.push_back(echoes_suffix(lidar));
  if (std::ranges::any_of(camera.products, is_layer)) suffixes.emplace_back(".exr");
  return suffixes;
}

ImageFigures write_image(const Simulation& simulation, const DatasetWriter& dataset,
                         std::size_t which, std::int64_t image, const MadeImage& made,
                         std::span<const std::vector<ImagedEcho>> echoes) {
  const PlacedCamera& placed = simulation.cameras[which];
  const CameraSpec& camera = placed.spec.camera;
  const auto path_of = [&](std::string_view suffix) {
    return dataset.product_path(static_cast<std::uint32_t>(simulation.lidars.size() + which), image,
                                suffix);
  };
  for (std::size_t i = 0; i < echoes.size(); ++i)
    write_imaged_echoes(path_of(echoes_suffix(placed.spec.lidars[i])), echoes[i]);
  ImageFigures written;
  Layers layers;
  if (made.light) add_light(*made.light, camera, made.labels, layers);
  std::optional<TruthInFile> in_file;
  if (made.truth) {
    in_file.emplace(*made.truth);
    add_truth(*made.truth, *in_file, camera, layers);
    const ImageF& flow_px = made.truth->forward.offset_px;
    written.flows_left_out =
        write_flows(camera, flow_px.width() > 0 ? flow_px : unknown_flow(camera.size_px), path_of);
  }
  if (gives(camera, Product::Boxes)) {
    write_boxes(path_of(boxes_suffix), simulation.scene_objects, made.instances,
                placed.begins[static_cast<std::size_t>(image)]);
  }
  if (made.light)
    if (const auto stages = simulate_imager(simulation, which, image, made)) {
      write_stages(camera, *stages, path_of);
      write_text(path_of(exposure_suffix), exposure_text(made.exposure, camera.picture, *stages));
      written.saturated_share = stages->saturated_share;
    }
  write_png(path_of("_preview.png"), draw_image_preview(made.light ? &*made.light : nullptr,
                                                        made.truth ? &*made.truth : nullptr));
  if (!layers.all.empty()) {
    write_exr(path_of(".exr"), layers.all,
              attributes_of(placed, placed.begins[static_cast<std::size_t>(image)], made));
  }
  return written;
}

}  // namespace groundray
