#include "apps/scene/frame_scene_builder.h"

#include <utility>

#include "terrain/terrain_scene.h"

namespace groundray {

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
    take({{full_resolution_level(*whole)}, p_DL, simulation_.spec.tracing});
  }
  p_DL_ = p_DL;
  return *scene_;
}

void FrameSceneBuilder::take(RayTracer rays) {
  const SceneObjects& content = simulation_.content;
  scene_ = Scene{std::move(rays),   {.label = simulation_.spec.terrain.label},
                 content.materials, content.objects,
                 content.models,    content.cover};
}

}  // namespace groundray
