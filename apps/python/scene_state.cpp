#include "apps/python/scene_state.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ranges>

#include "core/error.h"
#include "terrain/terrain_scene.h"

namespace groundray::python {
namespace {

using std::chrono::nanoseconds;

// Requires at least one frame.
std::int64_t nearest_frame(const FrameTimes& times, nanoseconds time) {
  const auto frames = std::views::iota(std::int64_t{0}, times.count);
  const auto after = std::ranges::partition_point(
      frames, [&](std::int64_t frame) { return times.begin(frame) < time; });
  const std::int64_t next = after == frames.end() ? times.count - 1 : *after;
  if (next == 0) return 0;
  return time - times.begin(next - 1) < std::chrono::abs(times.begin(next) - time) ? next - 1
                                                                                   : next;
}

}  // namespace

std::shared_ptr<const RayTracer> GroundTracers::of(const Simulation& simulation,
                                                   const glm::dvec3& p_DL) {
  const std::lock_guard lock(mutex_);
  std::erase_if(all_, [](const auto& each) { return each.second.expired(); });
  for (const auto& [at, tracer] : all_) {
    if (at != p_DL) continue;
    if (auto found = tracer.lock()) return found;
  }
  auto made = std::make_shared<const RayTracer>(
      RayTracer({simulation.terrain.whole_level()}, p_DL, simulation.spec.tracing));
  ++built_;
  all_.emplace_back(p_DL, made);
  return made;
}

int GroundTracers::built() const {
  const std::lock_guard lock(mutex_);
  return built_;
}

Scene scene_on(RayTracer ground, const Simulation& simulation) {
  const SceneObjects& objects = simulation.scene_objects;
  return {std::move(ground), {.label = simulation.spec.terrain.label},
          objects.materials, objects.objects,
          objects.models,    objects.cover};
}

FrameSceneCache::Key FrameSceneCache::key_of(const Exposed& frame) const {
  if (simulation_.terrain.whole() == nullptr) return {.X_DS = frame.X_DS, .begin = frame.begin};
  return {.p_DL = float_frame_origin(frame.X_DS->pose_at(frame.begin).translation_m)};
}

// Returns an entry with this key, or else an idle one, or else a new one.
FrameSceneCache::Entry& FrameSceneCache::entry_for(const Key& key) {
  const auto same = std::ranges::find(entries_, key, [](const auto& entry) { return entry->key; });
  if (same != entries_.end()) return **same;
  const auto idle = std::ranges::find(entries_, 0, [](const auto& entry) { return entry->users; });
  if (idle != entries_.end()) return **idle;
  return *entries_.emplace_back(std::make_unique<Entry>(simulation_));
}

std::shared_ptr<const Scene> FrameSceneCache::of(const Exposed& frame) {
  const std::lock_guard lock(mutex_);
  const Key key = key_of(frame);
  Entry& entry = entry_for(key);
  if (entry.key != key) {
    entry.key.reset();  // invalid while a scene is built
    build(entry, frame, key);
    entry.key = key;
  }
  ++entry.users;
  return {entry.scene, [this, &entry](const Scene*) { give_back(entry); }};
}

void FrameSceneCache::build(Entry& entry, const Exposed& frame, const Key& key) {
  if (!key.p_DL) {
    entry.scene = &entry.frames(frame);
    return;
  }
  entry.whole.reset();  // first, because two would need twice the memory
  entry.ground.reset();
  entry.ground = tracers_->of(simulation_, *key.p_DL);
  const auto levels = entry.ground->levels();
  entry.whole =
      scene_on(RayTracer(entry.ground->device(), {levels.begin(), levels.end()}), simulation_);
  entry.scene = &*entry.whole;
}

// Releases an entry. Of the idle entries, only the last one released is kept for the next frame.
void FrameSceneCache::give_back(Entry& entry) {
  const std::lock_guard lock(mutex_);
  --entry.users;
  if (entry.users > 0) return;
  std::erase_if(entries_,
                [&](const auto& each) { return each.get() != &entry && each->users == 0; });
}

double seconds_of(nanoseconds time) { return std::chrono::duration<double>(time).count(); }

nanoseconds nanoseconds_of(double time_s) {
  constexpr double most_s = 4.6e9;
  if (!(std::abs(time_s) <= most_s)) throw Error("t_s = {} must be within 4.6e9 s of zero", time_s);
  return nanoseconds(std::llround(time_s * 1e9));
}

AnyArray all_times_s(const FrameTimes& times) {
  std::vector<double> all_s;
  for (std::int64_t frame = 0; frame < times.count; ++frame)
    all_s.push_back(seconds_of(times.begin(frame)));
  return array_of(std::move(all_s));
}

std::int64_t chosen_frame(const FrameTimes& times, std::optional<double> t_s,
                          std::optional<std::int64_t> frame) {
  if (t_s.has_value() == frame.has_value())
    throw Error("{}: give either t_s, when the frame begins, or frame, its number", times.sensor);
  if (frame) {
    if (0 <= *frame && *frame < times.count) return *frame;
    throw Error("{}: there is no frame {}; the scene has {}, numbered from 0", times.sensor, *frame,
                times.count);
  }
  constexpr nanoseconds slack = std::chrono::microseconds(1);
  const nanoseconds time = nanoseconds_of(*t_s);
  const std::int64_t nearest = nearest_frame(times, time);
  if (std::chrono::abs(times.begin(nearest) - time) <= slack) return nearest;
  throw Error("{}: no frame begins at {} s; the nearest is frame {}, at {} s", times.sensor, *t_s,
              nearest, seconds_of(times.begin(nearest)));
}

}  // namespace groundray::python
