#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/binding/arrays.h"
#include "apps/python/scene_source.h"
#include "apps/scene/frames.h"
#include "apps/scene/simulation.h"

namespace groundray::python {

/// Ground of a terrain that is traced as a whole, for all scenes of that terrain and any number of
/// threads. It exists while a scene uses it.
class GroundTracers {
 public:
  /// Returns the ground in the frame L at p_DL; builds it, while others wait, unless it exists.
  std::shared_ptr<const RayTracer> of(const Simulation& simulation, const glm::dvec3& p_DL);

  /// Returns how many have been built.
  int built() const;

 private:
  mutable std::mutex mutex_;
  std::vector<std::pair<glm::dvec3, std::weak_ptr<const RayTracer>>> all_;
  int built_ = 0;
};

/// Returns the scene of a simulation with this ground.
Scene scene_on(RayTracer ground, const Simulation& simulation);

/// Cache of the scenes that frames see, for any number of threads. Frames that see the same scene
/// share it; an idle scene is reused to build the next.
class FrameSceneCache {
 public:
  /// @param simulation  must outlive this object.
  /// @param tracers     shared by the scenes of its terrain.
  FrameSceneCache(const Simulation& simulation, std::shared_ptr<GroundTracers> tracers)
      : simulation_(simulation), tracers_(std::move(tracers)) {}

  const std::shared_ptr<GroundTracers>& tracers() const { return tracers_; }

  /// Returns the scene that a frame sees, which must be released before this object ends. Waits
  /// while another thread builds one.
  /// @throws Error as FrameSceneBuilder.
  std::shared_ptr<const Scene> of(const Exposed& frame);

 private:
  // Frames with equal keys see the same scene.
  struct Key {
    std::optional<glm::dvec3> p_DL;     // set if the whole terrain is in memory
    const Trajectory* X_DS = nullptr;   // set otherwise
    std::chrono::nanoseconds begin{0};  // set with X_DS
    bool operator==(const Key&) const = default;
  };
  struct Entry {
    explicit Entry(const Simulation& simulation) : frames(simulation) {}
    FrameSceneBuilder frames;                 // used if the terrain is served by tiles
    std::shared_ptr<const RayTracer> ground;  // otherwise, and `whole` is on it
    std::optional<Scene> whole;
    const Scene* scene = nullptr;
    std::optional<Key> key;
    int users = 0;
  };
  Key key_of(const Exposed& frame) const;
  Entry& entry_for(const Key& key);
  void build(Entry& entry, const Exposed& frame, const Key& key);
  void give_back(Entry& entry);

  const Simulation& simulation_;
  std::shared_ptr<GroundTracers> tracers_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Entry>> entries_;
};

/// Loaded scene and the scenes that its frames see. All Python objects of a scene share it.
struct SceneState {
  SceneState(SceneSource from, std::shared_ptr<const TemporaryFolder> kept, Simulation loaded,
             std::shared_ptr<GroundTracers> tracers)
      : source(std::move(from)),
        folder(std::move(kept)),
        simulation(std::move(loaded)),
        frames(simulation, std::move(tracers)) {}

  SceneSource source;
  std::shared_ptr<const TemporaryFolder> folder;  ///< of files that are read while frames are made
  Simulation simulation;
  FrameSceneCache frames;
};

/// Lidar of a scene.
struct SceneLidar {
  std::shared_ptr<SceneState> state;
  std::size_t index = 0;

  const PlacedLidar& placed() const { return state->simulation.lidars[index]; }
};

/// Camera of a scene.
struct SceneCamera {
  std::shared_ptr<SceneState> state;
  std::size_t index = 0;

  const PlacedCamera& placed() const { return state->simulation.cameras[index]; }
};

/// Start times of a sensor's frames.
struct FrameTimes {
  std::string sensor;  ///< name for messages
  std::int64_t count = 0;
  std::function<std::chrono::nanoseconds(std::int64_t)> begin;
};

double seconds_of(std::chrono::nanoseconds time);

/// Converts seconds to nanoseconds.
/// @throws Error unless the time is within 4.6e9 s of zero.
std::chrono::nanoseconds nanoseconds_of(double time_s);

AnyArray all_times_s(const FrameTimes& times);

/// Returns the frame with this number, or the one that begins at `t_s` to a microsecond.
/// @throws Error if there is no such frame, or unless exactly one of both is given.
std::int64_t chosen_frame(const FrameTimes& times, std::optional<double> t_s,
                          std::optional<std::int64_t> frame);

}  // namespace groundray::python
