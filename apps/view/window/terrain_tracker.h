#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "apps/view/layers/terrain_follower.h"
#include "apps/view/rendering/view.h"
#include "apps/view/window/job.h"

namespace groundray {

/// Keeps the terrain's quadtree and clipmap round a moving viewpoint, in another thread.
class TerrainTracker {
 public:
  /// Viewpoint that the levels follow.
  enum class Follows { Eye, Platform, Place };
  struct Hooks {
    std::function<void()> changed{};  ///< the layers of the view have changed
    std::function<void(const std::string&)> failed{};
  };

  /// @param view  must outlive this.
  TerrainTracker(View& view, Hooks hooks);

  /// @param layer  name of the terrain's layer in the view.
  void open(std::shared_ptr<TerrainFollower> follower, const std::string& layer);
  void close();
  bool is_open() const noexcept { return follower_ != nullptr; }

  void set_follows(Follows follows);
  Follows follows() const noexcept { return follows_; }
  /// Sets the position of one of the viewpoints. If it is the one to follow, the terrain is rebuilt
  /// soon.
  /// @param step_m  shorter moves do not cause a rebuild.
  void set_place(Follows of, const glm::dvec3& p_w_m, double step_m);

  /// Returns the name of the terrain's layer.
  const std::string& layer() const noexcept { return layer_; }
  /// Returns the last terrain that was built, without its layer; std::nullopt before the first.
  const std::optional<FollowedTerrain>& built() const noexcept { return built_; }
  /// Returns the viewpoint that is followed; std::nullopt before the first.
  const std::optional<glm::dvec3>& viewpoint_w_m() const noexcept { return built_for_w_m_; }
  bool is_busy() const noexcept { return job_.is_running(); }

 private:
  void follow();
  void take(FollowedTerrain built);

  View& view_;
  Hooks hooks_;
  std::string layer_;
  std::shared_ptr<TerrainFollower> follower_;  // used by the job only
  Follows follows_ = Follows::Eye;
  std::array<std::optional<glm::dvec3>, 3> places_w_m_;  // indexed by Follows
  double step_m_ = 0;
  std::optional<glm::dvec3> built_for_w_m_;
  std::optional<FollowedTerrain> built_;
  Job job_;
};

}  // namespace groundray
