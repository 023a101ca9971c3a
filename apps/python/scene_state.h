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

/// Cache of the scenes that frames see, for any number of threads. Frames that see the same scene
/// share it; an idle scene is reused to build the next.
class FrameSceneCache {
 public:
  /// @param simulation  must outlive this object.
  explicit FrameSceneCache(const Simulation& simulation) : simulation_(simulation) {}

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
    FrameSceneBuilder frames;
    const Scene* scene = nullptr;
    std::optional<Key> key;
    int users = 0;
  };
  Key key_of(const Exposed& frame) const;
  Entry& entry_for(const Key& key);
  void give_back(Entry& entry);

  const Simulation& simulation_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Entry>> entries_;
};

/// Loaded scene and the scenes that its frames see. All Python objects of a scene share it.
struct SceneState {
  SceneState(SceneSource from, std::unique_ptr<const TemporaryFolder> kept, Simulation loaded)
      : source(std::move(from)),
        folder(std::move(kept)),
        simulation(std::move(loaded)),
        frames(simulation) {}

  SceneSource source;
  std::unique_ptr<const TemporaryFolder> folder;  ///< of files that are read while frames are made
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
