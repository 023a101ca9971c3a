#include "apps/scene/frames.h"

#include <algorithm>
#include <initializer_list>
#include <utility>

#include "sensors/camera/imager.h"
#include "sensors/camera/path_tracer.h"
#include "terrain/terrain_scene.h"

namespace groundray {
namespace {

using Product = CameraProduct;

bool gives_any(const CameraSpec& camera, std::initializer_list<Product> products) {
  return std::ranges::any_of(products, [&](Product product) { return gives(camera, product); });
}

RandomKey key_of(const Simulation& simulation, std::size_t camera, std::int64_t image) {
  return {.seed = simulation.spec.seed,
          .sensor = static_cast<std::uint32_t>(simulation.lidars.size() + camera),
          .frame = static_cast<std::uint32_t>(image)};
}

TruthRequest truth_request(const PlacedCamera& placed, std::size_t image) {
  const CameraSpec& camera = placed.spec.camera;
  TruthRequest request{.begin = placed.begins[image],
                       .before = {},
                       .after = {},
                       .bounds = gives(camera, Product::Bound)};
  const bool both_ways = gives(camera, Product::Flow);
  if (both_ways && image > 0) request.before = placed.begins[image - 1];
  if ((both_ways || gives_any(camera, {Product::FlowFlo, Product::FlowKitti})) &&
      image + 1 < placed.begins.size())
    request.after = placed.begins[image + 1];
  return request;
}

ExposureSetting exposure_by(const PathTracer& tracer, const PlacedCamera& placed, std::size_t image,
                            const RandomKey& key) {
  const CameraSpec& spec = placed.spec.camera;
  if (!spec.shutter.automatic) return {spec.shutter.exposure_s};
  return choose_exposure(spec, placed.camera.meter(tracer, placed.X_DC, placed.begins[image], key),
                         placed.pupil_sr);
}

}  // namespace

const Scene& FrameSceneBuilder::operator()(const Exposed& frame) {
  const glm::dvec3 p_DL = float_frame_origin(frame.X_DS->pose_at(frame.begin).translation_m);
  const HeightGrid* whole = simulation_.terrain.whole();
  if (whole == nullptr) {
    const SensorBox sensors = sensor_box(frame);
    clipmap_ = clipmap_ ? clipmap_->moved_to(sensors)
                        : simulation_.terrain.clipmap(sensors, simulation_.reach_m);
    take(build_tracer(*clipmap_, p_DL, simulation_.spec.tracing, scene_ ? &scene_->rays : nullptr));
  } else if (!scene_ || p_DL != p_DL_) {
    scene_.reset();  // first, because two would need twice the memory
    take({{simulation_.terrain.whole_level()}, p_DL, simulation_.spec.tracing});
  }
  p_DL_ = p_DL;
  return *scene_;
}

void FrameSceneBuilder::take(RayTracer rays) {
  const SceneObjects& objects = simulation_.scene_objects;
  scene_ = Scene{std::move(rays),   {.label = simulation_.spec.terrain.label},
                 objects.materials, objects.objects,
                 objects.models,    objects.cover};
}

LidarScan make_scan(const Simulation& simulation, std::size_t lidar, std::int64_t sweep,
                    const Scene& scene, const SweepWatch& watch) {
  const PlacedLidar& placed = simulation.lidars[lidar];
  return placed.lidar.scan(scene, placed.X_DS, sweep, simulation.spec.seed,
                           static_cast<std::uint32_t>(lidar), watch);
}

LidarScan make_scan(const Simulation& simulation, std::size_t lidar, std::int64_t sweep) {
  FrameSceneBuilder scene_for(simulation);
  return make_scan(simulation, lidar, sweep, scene_for(exposed(simulation.lidars[lidar], sweep)));
}

ExposureSetting exposure_of(const Simulation& simulation, std::size_t camera, std::int64_t image,
                            const Scene& scene) {
  const PlacedCamera& placed = simulation.cameras[camera];
  const PathTracer tracer(scene, *simulation.sky, placed.spec.camera.sampling.depth,
                          simulation.air);
  return exposure_by(tracer, placed, static_cast<std::size_t>(image),
                     key_of(simulation, camera, image));
}

MadeImage make_image(const Simulation& simulation, std::size_t camera, std::int64_t image,
                     const Scene& scene, const std::function<void()>& check) {
  const PlacedCamera& placed = simulation.cameras[camera];
  const CameraSpec& spec = placed.spec.camera;
  const auto number = static_cast<std::size_t>(image);
  MadeImage made;
  if (needs_light(spec)) {
    if (gives(spec, Product::Coverage)) made.labels = labels_of(scene);
    const PathTracer tracer(scene, *simulation.sky, spec.sampling.depth, simulation.air);
    const RandomKey key = key_of(simulation, camera, image);
    made.exposure = exposure_by(tracer, placed, number, key);
    made.light = placed.camera.expose(tracer, placed.X_DC, placed.begins[number], key, made.labels,
                                      check, made.exposure.exposure_s);
    for (const float samples : made.light->samples.values())
      made.paths += static_cast<std::uint64_t>(samples);
  }
  if (gives_any(spec, {Product::Truth, Product::Bound, Product::Flow, Product::FlowFlo,
                       Product::FlowKitti, Product::Boxes})) {
    if (check) check();
    made.truth = image_truth(placed.camera, scene, simulation.scene_objects.materials.in_colour(),
                             placed.X_DC, truth_request(placed, number));
  }
  if (gives(spec, Product::Boxes)) {
    made.instances = imaged_instances(placed.camera, scene, simulation.scene_objects.boxes,
                                      placed.X_DC, placed.begins[number], *made.truth, check);
  }
  return made;
}

MadeImage make_image(const Simulation& simulation, std::size_t camera, std::int64_t image) {
  FrameSceneBuilder scene_for(simulation);
  return make_image(simulation, camera, image,
                    scene_for(exposed(simulation.cameras[camera], image)));
}

std::optional<ImagerStages> simulate_imager(const Simulation& simulation, std::size_t which,
                                            std::int64_t image, const MadeImage& made) {
  const PlacedCamera& placed = simulation.cameras[which];
  const CameraSpec& camera = placed.spec.camera;
  if (!gives_signal(camera)) return std::nullopt;
  const RandomKey key = key_of(simulation, which, image);
  ImagerSpec spec = *camera.imager;
  spec.gain_dn_e *= made.exposure.gain;
  const Imager imager(spec, made.exposure.exposure_s);
  ImagerStages stages;
  stages.irradiance_w_m2 = irradiance(made.light->radiance, placed.pupil_sr);
  stages.photons = imager.photons(stages.irradiance_w_m2);
  stages.electrons = imager.electrons(stages.photons, key);
  stages.raw_dn = imager.digital(stages.electrons, key);
  stages.saturated_share = imager.saturated_share(stages.electrons, stages.raw_dn);
  if (gives(camera, Product::Picture))
    stages.picture = RawDeveloper(camera.picture, spec).develop(stages.raw_dn);
  return stages;
}

}  // namespace groundray
