#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "apps/view/terrain_follower.h"
#include "apps/view/view.h"
#include "apps/view/window/job.h"

namespace groundray {

/// Keeps the terrain's quadtree and clipmap round a viewpoint as that moves, off the window's
/// thread.
class TerrainTracker {
 public:
  /// Whose place the levels follow.
  enum class Follows { Eye, Platform, Place };
  struct Hooks {
    std::function<void()> changed{};  ///< the view holds something else
    std::function<void(const std::string&)> failed{};
  };

  /// @param view  is to outlive this.
  TerrainTracker(View& view, Hooks hooks);

  /// @param layer  the terrain's name in the view.
  void open(std::shared_ptr<TerrainFollower> follower, const std::string& layer);
  void close();
  bool is_open() const noexcept { return follower_ != nullptr; }

  void set_follows(Follows follows);
  Follows follows() const noexcept { return follows_; }
  /// Says where one of them is; the terrain follows soon, if it is the one to follow.
  /// @param step_m  moves that are smaller show nothing else.
  void set_place(Follows of, const glm::dvec3& p_w_m, double step_m);

  /// Returns the name of the layer that follows.
  const std::string& layer() const noexcept { return layer_; }
  /// Returns what was built last, without its layer; nothing before.
  const std::optional<FollowedTerrain>& built() const noexcept { return built_; }
  /// Returns the viewpoint that is followed; nothing before there is one.
  const std::optional<glm::dvec3>& viewpoint_w_m() const noexcept { return built_for_w_m_; }
  bool is_busy() const noexcept { return job_.is_running(); }

 private:
  void follow();
  void take(FollowedTerrain built);

  View& view_;
  Hooks hooks_;
  std::string layer_;
  std::shared_ptr<TerrainFollower> follower_;  // used by the job alone
  Follows follows_ = Follows::Eye;
  std::array<std::optional<glm::dvec3>, 3> places_w_m_;  // by Follows
  double step_m_ = 0;
  std::optional<glm::dvec3> built_for_w_m_;
  std::optional<FollowedTerrain> built_;
  Job job_;
};

}  // namespace groundray
