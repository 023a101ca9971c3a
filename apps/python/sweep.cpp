#include "apps/python/sweep.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/binding/pickle.h"
#include "apps/scene/frames.h"

namespace groundray::python {
namespace {

using std::chrono::nanoseconds;

// Returns the samples from before to after a frame. Times of columns are rounded to floats, so a
// millisecond more is covered.
std::vector<Trajectory::Sample> samples_around(const Exposed& frame) {
  constexpr std::chrono::milliseconds margin(1);
  const std::vector<Trajectory::Sample>& all = frame.X_DS->samples();
  auto first = std::ranges::upper_bound(all, frame.begin - margin, {}, &Trajectory::Sample::time);
  auto last = std::ranges::lower_bound(all, frame.end + margin, {}, &Trajectory::Sample::time);
  if (first != all.begin()) --first;
  if (last != all.end()) ++last;
  return {first, last};
}

SweepSource source_of(const Simulation& simulation, std::size_t lidar, std::int64_t frame) {
  const PlacedLidar& placed = simulation.lidars[lidar];
  const DemHeader& dem = simulation.terrain.header();
  return {.sensor = placed.spec.name,
          .stamp = placed.lidar.pattern().stamp(frame),
          .points = placed.spec.lidar.points,
          .range_noise_sigma_m = placed.spec.lidar.range_noise_sigma_m,
          .georeference = {dem.origin_w_m, dem.crs_name, dem.crs_wkt},
          .poses = samples_around(exposed(placed, frame))};
}

// ----- pickling

void add_samples(const std::vector<Trajectory::Sample>& samples, nb::list& state) {
  std::vector<std::int64_t> times_ns;
  std::vector<double> poses;  // w, x, y, z of the rotation and x, y, z of the position
  for (const auto& [time, pose] : samples) {
    times_ns.push_back(time.count());
    const auto& [q, p_m] = pose;
    poses.insert(poses.end(), {q.w, q.x, q.y, q.z, p_m.x, p_m.y, p_m.z});
  }
  state.append(array_of(std::move(times_ns)));
  state.append(array_of(std::move(poses)));
}

std::vector<Trajectory::Sample> read_samples(PickledState& state) {
  const auto times_ns = state.next_array<std::int64_t>("times_ns");
  const auto poses = state.next_array<double>("poses");
  if (times_ns.empty() || poses.size() != 7 * times_ns.size())
    state.refuse("poses", "must have 7 values for each of at least one time");
  std::vector<Trajectory::Sample> samples;
  for (std::size_t i = 0; i < times_ns.size(); ++i) {
    const double* p = &poses[7 * i];
    const glm::dquat rotation(p[0], p[1], p[2], p[3]);
    samples.push_back({nanoseconds(times_ns[i]), {rotation, {p[4], p[5], p[6]}}});
  }
  return samples;
}

void add_source(const SweepSource& source, nb::list& state) {
  state.append(source.sensor);
  state.append(source.stamp.count());
  state.append(source.points == LidarSpec::Points::AsFired);
  state.append(source.range_noise_sigma_m);
  add_georeference(source.georeference, state);
  add_samples(source.poses, state);
}

SweepSource read_source(PickledState& state) {
  SweepSource source{.sensor = state.next<std::string>("sensor"),
                     .stamp = nanoseconds(state.next<std::int64_t>("stamp_ns")),
                     .points = state.next<bool>("is_as_fired") ? LidarSpec::Points::AsFired
                                                               : LidarSpec::Points::AtStamp,
                     .range_noise_sigma_m = state.next<double>("range_noise_sigma_m"),
                     .georeference = read_georeference(state),
                     .poses = read_samples(state)};
  if (source.stamp < source.X_DS.begin_time() || source.X_DS.end_time() < source.stamp)
    state.refuse("stamp_ns", "lies outside the times of its poses");
  return source;
}

void add_waveforms(const Waveforms& waveforms, nb::handle owner, nb::list& state) {
  state.append(waveforms.interval_s);
  state.append(view(waveforms.power_w.data(), {waveforms.power_w.size()}, owner));
  state.append(field_of(waveforms, &WaveformRun::pulse, owner));
  state.append(field_of(waveforms, &WaveformRun::count, owner));
  state.append(field_of(waveforms, &WaveformRun::first_sample, owner));
  state.append(field_of(waveforms, &WaveformRun::start_s, owner));
}

Waveforms read_waveforms(PickledState& state) {
  Waveforms waveforms{.interval_s = state.next<double>("interval_s"),
                      .runs = {},
                      .power_w = state.next_array<float>("power_w")};
  const auto pulses = state.next_array<std::uint32_t>("pulse");
  const auto counts = state.next_array<std::uint32_t>("count");
  const auto firsts = state.next_array<std::uint64_t>("first_sample");
  const auto starts_s = state.next_array<double>("start_s");
  if (counts.size() != pulses.size() || firsts.size() != pulses.size() ||
      starts_s.size() != pulses.size())
    state.refuse("pulse", "and the other arrays of runs differ in length");
  for (std::size_t i = 0; i < pulses.size(); ++i)
    waveforms.runs.push_back({pulses[i], counts[i], firsts[i], starts_s[i]});
  return waveforms;
}

void add_convergence(const Convergence& seen, nb::list& state) {
  std::vector<std::uint64_t> counts{seen.pulses, seen.changed};
  std::vector<double> changes;
  for (const Convergence::Changes& each : {seen.range_m, seen.true_m, seen.share}) {
    counts.push_back(each.count);
    changes.insert(changes.end(), {each.sum_squares, each.largest});
  }
  state.append(array_of(std::move(counts)));
  state.append(array_of(std::move(changes)));
}

Convergence read_convergence(PickledState& state) {
  const auto counts = state.next_array<std::uint64_t>("convergence_counts");
  const auto changes = state.next_array<double>("convergence_changes");
  if (counts.size() != 5 || changes.size() != 6)
    state.refuse("convergence_counts", "must be 5 numbers, and 'convergence_changes' 6");
  return {counts[0],
          counts[1],
          {changes[0], changes[1], counts[2]},
          {changes[2], changes[3], counts[3]},
          {changes[4], changes[5], counts[4]}};
}

}  // namespace

Sweep make_sweep(SceneState& state, std::size_t lidar, std::int64_t frame,
                 const SweepWatch& watch) {
  const Simulation& simulation = state.simulation;
  const auto scene = state.frames.of(exposed(simulation.lidars[lidar], frame));
  LidarScan scan = make_scan(simulation, lidar, frame, *scene, watch);
  return {{std::move(scan.echoes)},
          {std::move(scan.no_returns)},
          std::move(scan.waveforms),
          scan.convergence,
          frame,
          source_of(simulation, lidar, frame)};
}

nb::list state_of(nb::handle_t<Sweep> self) {
  const auto& sweep = nb::cast<const Sweep&>(self);
  nb::list state;
  add_points(sweep, self, state);
  add_points(sweep.no_returns, self, state);
  add_waveforms(sweep.waveforms, self, state);
  add_convergence(sweep.convergence, state);
  state.append(sweep.frame);
  add_source(sweep.source, state);
  return state;
}

Sweep restored_sweep(const nb::tuple& values) {
  constexpr std::size_t count = 22;
  PickledState state("Scan", values, count);
  Points echoes = read_points(state);
  Points no_returns = read_points(state);
  Waveforms waveforms = read_waveforms(state);
  const Convergence convergence = read_convergence(state);
  const auto frame = state.next<std::int64_t>("frame");
  return {std::move(echoes), std::move(no_returns), std::move(waveforms), convergence, frame,
          read_source(state)};
}

}  // namespace groundray::python
