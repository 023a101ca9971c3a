#include "apps/view/window/terrain_tracker.h"

#include <glm/geometric.hpp>

namespace groundray {
TerrainTracker::TerrainTracker(View& view, Hooks hooks) : view_(view), hooks_(std::move(hooks)) {}

void TerrainTracker::open(std::shared_ptr<TerrainFollower> follower, const std::string& layer) {
  close();
  follower_ = std::move(follower);
  layer_ = layer;
}

void TerrainTracker::close() {
  job_.abandon();
  follower_ = nullptr;
  built_.reset();
  built_for_w_m_.reset();
  for (auto& place : places_w_m_) place.reset();
}

void TerrainTracker::set_follows(Follows follows) {
  follows_ = follows;
  built_for_w_m_.reset();
  follow();
}

void TerrainTracker::set_place(Follows of, const glm::dvec3& p_w_m, double step_m) {
  places_w_m_[static_cast<std::size_t>(of)] = p_w_m;
  if (of != follows_) return;
  step_m_ = step_m;
  follow();
}

void TerrainTracker::follow() {
  const auto& place = places_w_m_[static_cast<std::size_t>(follows_)];
  if (!is_open() || job_.is_running() || !place) return;
  const glm::dvec3 viewpoint_w_m = *place;
  const double moved_m = built_for_w_m_ ? glm::distance(*built_for_w_m_, viewpoint_w_m) : 1e300;
  if (moved_m == 0 || moved_m < step_m_) return;
  built_for_w_m_ = viewpoint_w_m;
  job_.start([follower = follower_, viewpoint_w_m](
                 const auto&, const auto&) { return follower->follow(viewpoint_w_m); },
             [this](FollowedTerrain built) { take(std::move(built)); },
             {.failed = hooks_.failed, .ended = [this] { follow(); }});
}

void TerrainTracker::take(FollowedTerrain built) {
  if (!is_open()) return;
  built.layer.name = layer_;
  view_.add(std::move(built.layer));
  built.layer = {};
  built_ = std::move(built);
  if (hooks_.changed) hooks_.changed();
}

}  // namespace groundray
