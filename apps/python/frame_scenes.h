#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "apps/scene/frame_scene.h"
#include "apps/scene/world.h"

namespace groundray::python {

/// What frames see, for any number of threads: frames that see the same share it, and one that is
/// done with serves to make the next.
class FrameScenes {
 public:
  /// @param world  is to outlive this.
  explicit FrameScenes(const World& world) : world_(world) {}

  /// Returns what a frame sees, to be given back before this ends. Waits where another thread makes
  /// one. @throws Error as FrameScene.
  std::shared_ptr<const Scene> of(const Exposed& frame);

 private:
  // Frames with equal keys see the same scene.
  struct Key {
    std::optional<glm::dvec3> p_DL;     // of a terrain in memory as a whole
    const Trajectory* X_DS = nullptr;   // else
    std::chrono::nanoseconds begin{0};  // likewise
    bool operator==(const Key&) const = default;
  };
  struct Entry {
    explicit Entry(const World& world) : frames(world) {}
    FrameScene frames;
    const Scene* scene = nullptr;
    std::optional<Key> key;
    int users = 0;
  };
  Key key_of(const Exposed& frame) const;
  Entry& entry_for(const Key& key);
  void give_back(Entry& entry);

  const World& world_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Entry>> entries_;
};

}  // namespace groundray::python
