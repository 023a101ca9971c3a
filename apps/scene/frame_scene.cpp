#include "apps/scene/frame_scene.h"

#include <utility>

#include "terrain/terrain_scene.h"

namespace groundray {

const Scene& FrameScene::operator()(const Exposed& frame) {
  const glm::dvec3 p_DL = float_frame_origin(frame.X_DS->pose_at(frame.begin).translation_m);
  const HeightGrid* whole = world_.terrain.whole();
  if (whole == nullptr) {
    const SensorBox sensors = sensor_box(frame);
    clipmap_ =
        clipmap_ ? clipmap_->moved_to(sensors) : world_.terrain.clipmap(sensors, world_.reach_m);
    take(build_tracer(*clipmap_, p_DL, world_.spec.tracing, scene_ ? &scene_->rays : nullptr));
  } else if (!scene_ || p_DL != p_DL_) {
    scene_.reset();  // before the next one is built: two would need twice the memory
    take({{full_resolution_level(*whole)}, p_DL, world_.spec.tracing});
  }
  p_DL_ = p_DL;
  return *scene_;
}

void FrameScene::take(RayTracer rays) {
  const Content& content = world_.content;
  scene_ = Scene{std::move(rays),   {.label = world_.spec.terrain.label},
                 content.materials, content.objects,
                 content.models,    content.cover};
}

}  // namespace groundray
