#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/dataset_reader.h"
#include "apps/scene/simulation.h"
#include "apps/view/recorded/recorded_sensor.h"
#include "core/geometry/pose.h"
#include "core/geometry/trajectory.h"

namespace groundray {

/// Frame on a timeline.
struct TimelineEvent {
  std::chrono::nanoseconds stamp{0};
  std::size_t sensor = 0;  ///< index into Timeline::sensors()
  std::size_t frame = 0;   ///< index into that sensor's frames
};

/// Stamps of all frames of a dataset, and poses of its sensors over time. Immutable: any number of
/// threads may use one.
class Timeline {
 public:
  /// Reads the metadata of a dataset folder, but no scans or images.
  /// @throws Error as read_recorded_run.
  explicit Timeline(const std::filesystem::path& dataset);
  /// Constructs the timeline of metadata that has already been read.
  explicit Timeline(RecordedRun run);

  /// Returns the lidars, then the cameras, in the order of dataset.yaml.
  const std::vector<RecordedSensor>& sensors() const noexcept { return run_.sensors; }
  const Georeference& georeference() const noexcept { return run_.georeference; }
  const RecordedNames& names() const noexcept { return run_.names; }
  /// Returns all recorded frames, ordered by stamp and then by sensor.
  const std::vector<TimelineEvent>& events() const noexcept { return events_; }

  /// Start of the first frame and end of the last one; both 0 if there are none.
  std::chrono::nanoseconds begin() const noexcept { return begin_; }
  std::chrono::nanoseconds end() const noexcept { return end_; }

  /// Returns the index of a sensor. @throws Error if no sensor has that name.
  std::size_t sensor_named(const std::string& name) const;
  /// Returns the index of a sensor's frame that began last at a time; std::nullopt before the
  /// first.
  std::optional<std::size_t> current(std::size_t sensor, std::chrono::nanoseconds time) const;
  /// Returns the first stamp after a time, of one sensor or of all.
  std::optional<std::chrono::nanoseconds> next(
      std::chrono::nanoseconds time, std::optional<std::size_t> sensor = std::nullopt) const;
  /// Returns the last stamp before a time, of one sensor or of all.
  std::optional<std::chrono::nanoseconds> previous(
      std::chrono::nanoseconds time, std::optional<std::size_t> sensor = std::nullopt) const;

  /// Returns X_DS of a sensor, or X_DC of a camera, at a time clamped to its trajectory.
  Pose pose_at(std::size_t sensor, std::chrono::nanoseconds time) const;
  /// Returns a sensor's positions in D up to a time: one per `spacing` from the start of its
  /// trajectory, and one at the time itself. The spacing is increased to limit them to about
  /// 100,000.
  /// @throws Error if `spacing` is not positive.
  std::vector<glm::dvec3> trail_m(
      std::size_t sensor, std::chrono::nanoseconds until,
      std::chrono::nanoseconds spacing = std::chrono::milliseconds(20)) const;

 private:
  RecordedRun run_;
  std::vector<TimelineEvent> events_;
  std::chrono::nanoseconds begin_{0}, end_{0};
};

/// Moving object of a scene. Datasets do not record its positions; the scene defines them.
struct MovingThing {
  std::string name;
  std::uint16_t label = 0;
  std::uint32_t instance = 0;  ///< instance number in scans and images
};

/// Returns the moving objects of a scene, ordered by instance number.
std::vector<MovingThing> moving_things(const Simulation& simulation);
/// Returns an object's pose at a time of the run: p_DO + R_DO * (scale * p_M) is a model's point
/// p_M in D.
PlacedObject place_of(const Simulation& simulation, const MovingThing& thing,
                      std::chrono::nanoseconds time);

}  // namespace groundray
