#include "apps/view/recorded/timeline.h"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>
#include <variant>

#include "core/error.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

constexpr std::int64_t most_trail_places = 100'000;

nanoseconds on_path(const Trajectory& path, nanoseconds time) {
  return std::clamp(time, path.begin_time(), path.end_time());
}

}  // namespace

Timeline::Timeline(const std::filesystem::path& dataset) : Timeline(read_recorded_run(dataset)) {}

Timeline::Timeline(RecordedRun run) : run_(std::move(run)) {
  for (std::size_t sensor = 0; sensor < sensors().size(); ++sensor) {
    const RecordedSensor& each = sensors()[sensor];
    for (std::size_t frame = 0; frame < each.frames.size(); ++frame) {
      const nanoseconds stamp = each.frames[frame].stamp;
      end_ = events_.empty() ? stamp + each.lasts : std::max(end_, stamp + each.lasts);
      events_.push_back({stamp, sensor, frame});
    }
  }
  std::ranges::sort(events_, {}, [](const TimelineEvent& event) {
    return std::tuple(event.stamp, event.sensor, event.frame);
  });
  if (!events_.empty()) begin_ = events_.front().stamp;
}

std::size_t Timeline::sensor_named(const std::string& name) const {
  const auto found = std::ranges::find(sensors(), name, &RecordedSensor::name);
  if (found == sensors().end()) throw Error("the dataset has no sensor '{}'", name);
  return static_cast<std::size_t>(found - sensors().begin());
}

std::optional<std::size_t> Timeline::current(std::size_t sensor, nanoseconds time) const {
  // The events are searched because they are sorted; a file may list frames out of order.
  const auto after = std::ranges::upper_bound(events_, time, {}, &TimelineEvent::stamp);
  for (auto at = after; at != events_.begin();) {
    --at;
    if (at->sensor == sensor) return at->frame;
  }
  return std::nullopt;
}

std::optional<nanoseconds> Timeline::next(nanoseconds time,
                                          std::optional<std::size_t> sensor) const {
  const auto after = std::ranges::upper_bound(events_, time, {}, &TimelineEvent::stamp);
  const auto found = std::find_if(after, events_.end(), [&](const TimelineEvent& event) {
    return !sensor || event.sensor == *sensor;
  });
  return found == events_.end() ? std::nullopt : std::optional(found->stamp);
}

std::optional<nanoseconds> Timeline::previous(nanoseconds time,
                                              std::optional<std::size_t> sensor) const {
  const auto from = std::ranges::lower_bound(events_, time, {}, &TimelineEvent::stamp);
  const auto begin = std::make_reverse_iterator(from);
  const auto found = std::find_if(begin, events_.rend(), [&](const TimelineEvent& event) {
    return !sensor || event.sensor == *sensor;
  });
  return found == events_.rend() ? std::nullopt : std::optional(found->stamp);
}

Pose Timeline::pose_at(std::size_t sensor, nanoseconds time) const {
  const Trajectory& path = sensors().at(sensor).X_DS;
  return path.pose_at(on_path(path, time));
}

std::vector<glm::dvec3> Timeline::trail_m(std::size_t sensor, nanoseconds until,
                                          nanoseconds spacing) const {
  const Trajectory& path = sensors().at(sensor).X_DS;
  if (spacing <= nanoseconds(0)) throw Error("a trail needs a spacing of more than 0 s");
  const nanoseconds end = on_path(path, until);
  const std::int64_t length = (end - path.begin_time()).count();
  const nanoseconds step = std::max(spacing, nanoseconds(length / most_trail_places + 1));
  std::vector<glm::dvec3> places_m;
  for (nanoseconds time = path.begin_time(); time < end; time += step)
    places_m.push_back(path.pose_at(time).translation_m);
  places_m.push_back(path.pose_at(end).translation_m);
  return places_m;
}

std::vector<MovingThing> moving_things(const Simulation& simulation) {
  std::vector<MovingThing> things;
  for (const ObjectSpec& object : simulation.spec.objects) {
    if (std::holds_alternative<StandingObject>(object.place)) continue;
    const auto group =
        std::ranges::find(simulation.scene_objects.groups, object.name, &SceneObjects::Group::name);
    if (group != simulation.scene_objects.groups.end())
      things.push_back({object.name, object.label, group->first});
  }
  std::ranges::sort(things, {}, &MovingThing::instance);
  return things;
}

PlacedObject place_of(const Simulation& simulation, const MovingThing& thing, nanoseconds time) {
  const ObjectTracer& objects = simulation.scene_objects.objects;
  return objects.placed_at(objects.parts_of(thing.instance).first, time);
}

}  // namespace groundray
