#include "apps/view/echo_beam.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <string_view>

#include "core/error.h"
#include "core/math.h"
#include "sensors/lidar/beam/beam.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

constexpr std::array<std::pair<std::string_view, std::string_view>, 22> echo_units{
    {{"x", "m"},           {"y", "m"},        {"z", "m"},           {"time", "s"},
     {"world_x", "m"},     {"world_y", "m"},  {"world_z", "m"},     {"range_true", "m"},
     {"incidence", "rad"}, {"range_sd", "m"}, {"error_bound", "m"}, {"error_estimate", "m"},
     {"amplitude", "W"},   {"width", "s"},    {"vx", "m/s"},        {"vy", "m/s"},
     {"vz", "m/s"},        {"sd_m", "m"},     {"range", "m"},       {"origin_x", "m"},
     {"origin_y", "m"},    {"origin_z", "m"}}};

std::string unit_suffix(const std::string& column) {
  const auto found =
      std::ranges::find(echo_units, column, [](const auto& unit) { return unit.first; });
  return found == echo_units.end() ? "" : " " + std::string(found->second);
}

void check_row(const PointCloud& scan, std::size_t row) {
  if (row >= scan.rows())
    throw Error("the scan has {} rows, but row {} was requested", scan.rows(), row);
}

const PointCloud::Column* find_column(const PointCloud& scan, std::string_view name) {
  const auto found = std::ranges::find(scan.columns(), name, &PointCloud::Column::name);
  return found == scan.columns().end() ? nullptr : &*found;
}

double value_of(const PointCloud::Column& column, std::size_t row) {
  return std::visit([row](const auto& values) { return static_cast<double>(values[row]); },
                    column.values);
}

std::optional<double> value_of(const PointCloud& scan, std::string_view name, std::size_t row) {
  const auto* column = find_column(scan, name);
  if (column == nullptr) return std::nullopt;
  return value_of(*column, row);
}

std::optional<glm::dvec3> vector_of(const PointCloud& scan,
                                    const std::array<std::string_view, 3>& names, std::size_t row) {
  glm::dvec3 v;
  for (glm::length_t k = 0; k < 3; ++k) {
    const auto value = value_of(scan, names[static_cast<std::size_t>(k)], row);
    if (!value || !std::isfinite(*value)) return std::nullopt;
    v[k] = *value;
  }
  return v;
}

std::string name_of(const PointCloud::Column& column, std::uint32_t number,
                    const RecordedNames& names) {
  if (column.name == "label" || column.name == "second_label") {
    const auto found = names.labels.find(number);
    return found == names.labels.end() ? "" : " (" + found->second + ")";
  }
  if (column.name == "kind") {
    constexpr std::array kinds{" (a surface)", " (air)", " (a false alarm)"};
    return number < kinds.size() ? kinds[number] : "";
  }
  if (column.name != "instance") return "";
  for (const RecordedNames::Objects& objects : names.objects) {
    if (objects.first <= number && number - objects.first < objects.count)
      return " (" + objects.name + ")";
  }
  return number == 0 ? " (the ground)" : "";
}

std::string cell_text(const PointCloud::Column& column, std::size_t row,
                      const RecordedNames& names) {
  const double value = value_of(column, row);
  const bool is_double = std::holds_alternative<PointCloud::Values<double>>(column.values);
  if (is_double || std::holds_alternative<PointCloud::Values<float>>(column.values)) {
    if (std::isnan(value)) return "none";
    return fmt::format("{:.{}g}{}", value, is_double ? 12 : 7, unit_suffix(column.name));
  }
  const auto number = static_cast<std::int64_t>(value);
  const std::string name =
      number < 0 ? "" : name_of(column, static_cast<std::uint32_t>(number), names);
  return fmt::format("{}{}{}", number, unit_suffix(column.name), name);
}

// Pulse as it leaves the sensor, in S at the time of firing.
struct FiredPulse {
  glm::dvec3 origin_m{0}, direction{0}, horizontal{0};
  nanoseconds time{0};
};

FiredPulse pulse_in(const PulseBatch& batch, std::size_t i) {
  const auto volley = std::ranges::find_if(batch.volleys, [i](const PulseBatch::Volley& each) {
    return each.begin <= i && i < each.end;
  });
  return {batch.origin_m[i], batch.direction[i], batch.horizontal[i],
          nanoseconds(std::llround(volley->time_s * 1e9))};
}

double time_of_pulse(const ScanPattern& pattern, std::int64_t sweep, std::int64_t pulse) {
  PulseBatch batch;
  pattern.fill(sweep, pulse, pulse + 1, batch);
  return batch.volleys.front().time_s;
}

// Returns the pulse of a ring that fires nearest to a time, within `rounding_s`: files store times
// as floats.
std::optional<FiredPulse> pulse_at(const ScanPattern& pattern, std::int64_t sweep, double time_s,
                                   double rounding_s, std::uint16_t ring) {
  std::int64_t begin = 0, end = pattern.pulses(sweep);
  while (begin < end) {
    const std::int64_t middle = begin + (end - begin) / 2;
    time_of_pulse(pattern, sweep, middle) < time_s - rounding_s ? begin = middle + 1 : end = middle;
  }
  constexpr std::int64_t most = 65536;
  PulseBatch batch;
  pattern.fill(sweep, begin, std::min(begin + most, pattern.pulses(sweep)), batch);
  std::optional<FiredPulse> best;
  double best_s = rounding_s;
  for (const PulseBatch::Volley& volley : batch.volleys) {
    if (volley.time_s > time_s + rounding_s) break;
    for (std::size_t i = volley.begin; i < volley.end; ++i) {
      if (batch.ring[i] != ring || std::abs(volley.time_s - time_s) > best_s) continue;
      best_s = std::abs(volley.time_s - time_s);
      best = pulse_in(batch, i);
    }
  }
  return best;
}

std::optional<FiredPulse> find_pulse(const RecordedSensor& lidar, const RecordedFrame& frame,
                                     const PointCloud& scan, std::size_t row) {
  if (!lidar.lidar) return std::nullopt;
  const ScanPattern pattern(lidar.lidar->spec.pattern);
  const std::int64_t pulses = pattern.pulses(frame.number);
  if (const auto number = value_of(scan, "pulse", row)) {
    const auto pulse = static_cast<std::int64_t>(*number);
    if (pulse < 0 || pulse >= pulses) return std::nullopt;
    PulseBatch batch;
    pattern.fill(frame.number, pulse, pulse + 1, batch);
    return pulse_in(batch, 0);
  }
  const auto time_s = value_of(scan, "time", row), ring = value_of(scan, "ring", row);
  if (!time_s || !ring || !std::isfinite(*time_s)) return std::nullopt;
  const double stamp_s = std::chrono::duration<double>(pattern.stamp(frame.number)).count();
  const double rounding_s = 2e-9 + std::abs(*time_s) * 1.2e-7;
  return pulse_at(pattern, frame.number, stamp_s + *time_s, rounding_s,
                  static_cast<std::uint16_t>(*ring));
}

// Returns true if a point lies on a pulse's axis, up to the rounding of floats and angular noise.
bool lies_on(const glm::dvec3& point_m, const FiredPulse& pulse) {
  const glm::dvec3 to_m = point_m - pulse.origin_m;
  const double along_m = glm::dot(to_m, pulse.direction);
  const double aside_m = glm::length(to_m - along_m * pulse.direction);
  return along_m > 0 && aside_m < 1e-4 + 1e-5 * along_m;
}

// Sets origin, direction and cross-section axes of an echo's beam, in D.
void set_axis(const RecordedSensor& lidar, const RecordedFrame& frame, const PointCloud& scan,
              std::size_t row, const glm::dvec3& point_S, EchoBeam& beam) {
  const double time_s = value_of(scan, "time", row).value_or(0);
  auto pulse = find_pulse(lidar, frame, scan, row);
  const nanoseconds fired =
      pulse ? pulse->time : frame.stamp + time_of(std::isfinite(time_s) ? time_s : 0);
  const Pose X_DS = pose_at(lidar, fired);
  const bool is_as_fired = lidar.points == LidarSpec::Points::AsFired;
  beam.reported_m = (is_as_fired ? X_DS : pose_at(lidar, frame.stamp)) * point_S;
  if (pulse && !lies_on(inverse(X_DS) * beam.reported_m, *pulse)) pulse.reset();
  beam.is_origin_exact = pulse.has_value();
  beam.origin_m = pulse ? X_DS * pulse->origin_m : X_DS.translation_m;
  beam.range_m = glm::distance(beam.origin_m, beam.reported_m);
  if (beam.range_m == 0)
    throw Error("row {} has no direction: it coincides with the origin of its beam", row);
  beam.direction = (beam.reported_m - beam.origin_m) / beam.range_m;
  glm::dvec3 across = pulse ? X_DS.rotation * pulse->horizontal
                            : glm::cross(X_DS.rotation * glm::dvec3(0, 0, 1), beam.direction);
  across -= glm::dot(across, beam.direction) * beam.direction;
  if (glm::length(across) < 1e-9) across = glm::cross(beam.direction, glm::dvec3(0, 1, 0));
  beam.horizontal = glm::normalize(across);
  beam.vertical = glm::cross(beam.direction, beam.horizontal);
}

// Returns the beam's edge at a range as a closed ring.
std::vector<glm::dvec3> ring_of(const EchoBeam& beam, double range_m, const glm::dvec2& radius_m,
                                std::size_t points) {
  std::vector<glm::dvec3> ring;
  for (std::size_t i = 0; i <= points; ++i) {
    const double angle_rad =
        2 * std::numbers::pi * static_cast<double>(i % points) / static_cast<double>(points);
    ring.push_back(beam.origin_m + range_m * beam.direction +
                   radius_m.x * math::cos(angle_rad) * beam.horizontal +
                   radius_m.y * math::sin(angle_rad) * beam.vertical);
  }
  return ring;
}

// Intersects the lines from waist_m to across_m with the plane of the surface.
std::vector<glm::dvec3> on_plane(const EchoBeam& beam, const glm::dvec3& point_m,
                                 const glm::dvec3& normal) {
  constexpr double least_slope = 0.02;
  std::vector<glm::dvec3> ring;
  for (std::size_t i = 0; i < beam.across_m.size(); ++i) {
    const glm::dvec3 along = glm::normalize(beam.across_m[i] - beam.waist_m[i]);
    const double slope = glm::dot(along, normal);
    if (std::abs(slope) < least_slope) return {};
    const double to_m = glm::dot(point_m - beam.waist_m[i], normal) / slope;
    ring.push_back(beam.waist_m[i] + to_m * along);
  }
  return ring;
}

}  // namespace

std::vector<EchoValue> echo_values(const PointCloud& scan, std::size_t row,
                                   const RecordedNames& names) {
  check_row(scan, row);
  std::vector<EchoValue> values;
  for (const PointCloud::Column& column : scan.columns())
    values.push_back({column.name, cell_text(column, row, names)});
  return values;
}

EchoBeam echo_beam(const RecordedSensor& lidar, const RecordedFrame& frame, const PointCloud& scan,
                   std::size_t row, std::size_t points) {
  check_row(scan, row);
  if (lidar.kind != SensorKind::Lidar)
    throw Error("'{}' is not a lidar: it has no beams", lidar.name);
  const auto point_S = vector_of(scan, {"x", "y", "z"}, row);
  if (!point_S) throw Error("row {} has no finite x, y and z", row);
  EchoBeam beam;
  set_axis(lidar, frame, scan, row, *point_S, beam);
  beam.true_m = vector_of(scan, {"world_x", "world_y", "world_z"}, row);
  BeamSpec spec = lidar.lidar ? lidar.lidar->spec.beam : BeamSpec{};
  spec.sub_rays = 1;
  spec.most_sub_rays.reset();
  const LaserBeam laser(spec);
  const glm::dvec2 radius_m = laser.radius_m(beam.range_m);
  beam.horizontal_radius_m = radius_m.x;
  beam.vertical_radius_m = radius_m.y;
  points = std::max<std::size_t>(points, 3);
  beam.waist_m = ring_of(beam, 0, laser.radius_m(0), points);
  beam.across_m = ring_of(beam, beam.range_m, radius_m, points);
  if (const auto normal = vector_of(scan, {"nx", "ny", "nz"}, row)) {
    beam.surface_m = on_plane(beam, beam.true_m.value_or(beam.reported_m), glm::normalize(*normal));
  }
  return beam;
}

}  // namespace groundray
