#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/dataset_listing.h"
#include "apps/scene/world.h"
#include "apps/view/recorded_sensor.h"
#include "core/pose.h"
#include "core/trajectory.h"

namespace groundray {

/// A frame as it comes in time.
struct TimelineEvent {
  std::chrono::nanoseconds stamp{0};
  std::size_t sensor = 0;  ///< of Timeline::sensors()
  std::size_t frame = 0;   ///< of its frames
};

/// When which sensor of a dataset made which frame, and where it was meanwhile. Immutable; any
/// number of threads may ask.
class Timeline {
 public:
  /// Reads what a dataset folder tells; scans and images are not looked into.
  /// @throws Error as read_recorded_run.
  explicit Timeline(const std::filesystem::path& dataset);
  /// Of what was read already.
  explicit Timeline(RecordedRun run);

  /// The lidars, then the cameras, as dataset.yaml lists them.
  const std::vector<RecordedSensor>& sensors() const noexcept { return run_.sensors; }
  const Georeference& georeference() const noexcept { return run_.georeference; }
  const RecordedNames& names() const noexcept { return run_.names; }
  /// All frames that are there, by stamp; of one stamp by sensor.
  const std::vector<TimelineEvent>& events() const noexcept { return events_; }

  /// When the first frame begins and the last one ends; both 0 if there is none.
  std::chrono::nanoseconds begin() const noexcept { return begin_; }
  std::chrono::nanoseconds end() const noexcept { return end_; }

  /// Returns the number of a sensor. @throws Error if there is none of that name.
  std::size_t sensor_named(const std::string& name) const;
  /// Returns which of a sensor's frames has begun last at a time; none before the first.
  std::optional<std::size_t> current(std::size_t sensor, std::chrono::nanoseconds time) const;
  /// Returns the first stamp after a time, of all sensors or of one.
  std::optional<std::chrono::nanoseconds> next(
      std::chrono::nanoseconds time, std::optional<std::size_t> sensor = std::nullopt) const;
  /// Returns the last stamp before a time, likewise.
  std::optional<std::chrono::nanoseconds> previous(
      std::chrono::nanoseconds time, std::optional<std::size_t> sensor = std::nullopt) const;

  /// Returns X_DS of a sensor, of a camera X_DC: at the path's ends if it does not reach so far.
  Pose pose_at(std::size_t sensor, std::chrono::nanoseconds time) const;
  /// Returns where a sensor was up to a time: a place each `spacing` from the path's begin on, and
  /// one at the time itself. Of more than 100 000 places they are spaced more widely.
  std::vector<glm::dvec3> trail_m(
      std::size_t sensor, std::chrono::nanoseconds until,
      std::chrono::nanoseconds spacing = std::chrono::milliseconds(20)) const;

 private:
  RecordedRun run_;
  std::vector<TimelineEvent> events_;
  std::chrono::nanoseconds begin_{0}, end_{0};
};

/// An object of a scene that moves. Datasets do not record where it was: the scene that they were
/// made of tells.
struct MovingThing {
  std::string name;
  std::uint16_t label = 0;
  std::uint32_t instance = 0;  ///< its number in scans and images
};

/// Returns the objects of a scene that move, by number.
std::vector<MovingThing> moving_things(const World& world);
/// Returns where one is at a time of the run: a model's point p_M, times `scale`, is at X_DO * p_M.
PlacedObject place_of(const World& world, const MovingThing& thing, std::chrono::nanoseconds time);

}  // namespace groundray
