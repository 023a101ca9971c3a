#include "terrain/traversability/traversability.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/math.h"
#include "terrain/lod/pass.h"

namespace groundray {
namespace {

constexpr double not_there = std::numeric_limits<double>::quiet_NaN();
constexpr double bytes_per_sample = 8 + 5 * 4 + 2;  // heights, layers, flags

// Samples of the ground in double: floats would round elevations above 512 m to 6e-5 m.
struct SampledGround {
  GridFrame frame;
  std::vector<double> heights_m;
};

void check_spec(const TraversabilitySpec& spec) {
  Violations broken("traversability");
  const auto check = [&](const char* name, double value) {
    broken.unless(value > 0 && std::isfinite(value), "{} = {:g} must be a length above 0", name,
                  value);
  };
  const VehicleSize& vehicle = spec.vehicle;
  check("cell_m", spec.cell_m);
  check("length_m", vehicle.length_m);
  check("width_m", vehicle.width_m);
  check("wheelbase_m", vehicle.wheelbase_m);
  check("track_m", vehicle.track_m);
  check("clearance_m", vehicle.clearance_m);
  check("wheel_radius_m", vehicle.wheel_radius_m);
  broken.unless(1 <= spec.headings && spec.headings <= 360, "headings = {} must be 1 to 360",
                spec.headings);
  const auto check_radius = [&](const char* name, double radius_m, double least_cells) {
    constexpr double most_cells = 1000;
    const double cells = radius_m / spec.cell_m;
    broken.unless(!(cells < least_cells),
                  "{} = {:g} is less than a cell, {:g} m; make cells smaller", name, radius_m,
                  spec.cell_m);
    broken.unless(!(cells > most_cells),
                  "{} = {:g} is more than {:g} cells of {:g} m; make cells larger", name, radius_m,
                  most_cells, spec.cell_m);
  };
  check_radius(spec.plane_radius_m ? "plane_radius_m" : "half diagonal of the vehicle",
               spec.plane_radius_m.value_or(vehicle.half_diagonal_m()), 1);
  check_radius(spec.step_radius_m ? "step_radius_m" : "wheel_radius_m",
               spec.step_radius_m.value_or(vehicle.wheel_radius_m), 1);
  check_radius("half diagonal of the vehicle", vehicle.half_diagonal_m(), 0);
  broken.throw_if_any();
}

GridFrame samples_over(const Ground& ground, double cell_m, std::size_t memory_bytes) {
  const GridFrame& frame = ground.frame();
  const glm::dvec2 a = frame.to_D({0, 0}), b = frame.to_D(frame.samples - 1);
  const glm::dvec2 low = glm::min(a, b), extent_m = glm::max(a, b) - low;
  const glm::dvec2 count = glm::floor(extent_m / cell_m * (1 + 1e-12)) + 1.0;
  if (std::min(count.x, count.y) < 2) {
    throw Error(
        "traversability: cell_m = {:g} leaves {:g} x {:g} samples of ground of {:g} m x {:g} m; "
        "make it smaller",
        cell_m, count.x, count.y, extent_m.x, extent_m.y);
  }
  const double bytes = count.x * count.y * bytes_per_sample;
  constexpr double most_samples = std::numeric_limits<int>::max();
  if (bytes > static_cast<double>(memory_bytes) || count.x * count.y > most_samples) {
    throw Error(
        "traversability: {:g} x {:g} samples take {:.0f} MB, more than the limit of {:.0f} MB or "
        "of 2^31 samples; make cell_m (now {:g}) larger, or allow more memory",
        count.x, count.y, 1e-6 * bytes, 1e-6 * static_cast<double>(memory_bytes), cell_m);
  }
  return {.samples = glm::ivec2(count),
          .origin_m = {low.x, low.y + cell_m * (count.y - 1)},
          .step_m = {cell_m, -cell_m},
          .cells_per_m = {1 / cell_m, -1 / cell_m}};
}

// Layers of one sample.
struct SampleLayers {
  double slope_deg = not_there, roughness_m = not_there, step_m = not_there,
         clearance_m = not_there;
};

// Computes the layers of samples from their neighbours.
class GroundJudge {
 public:
  GroundJudge(const SampledGround& ground, const TraversabilitySpec& spec)
      : ground_(ground),
        vehicle_(spec.vehicle),
        plane_(disc_stencil(spec.plane_radius_m.value_or(spec.vehicle.half_diagonal_m()),
                            spec.cell_m, ground.frame.samples.x)),
        step_(disc_stencil(spec.step_radius_m.value_or(spec.vehicle.wheel_radius_m), spec.cell_m,
                           ground.frame.samples.x)) {
    for (const glm::dvec2& place_m : plane_.places_m) plane_moment_m2_ += place_m.x * place_m.x;
    for (int heading = 0; heading < spec.headings; ++heading) {
      headings_.push_back(footprint_stencil(spec.vehicle,
                                            std::numbers::pi * heading / spec.headings, spec.cell_m,
                                            ground.frame.samples.x));
      footprint_reach_ = std::max(footprint_reach_, headings_.back().reach);
    }
  }

  SampleLayers at(int column, int row) const {
    const glm::ivec2 samples = ground_.frame.samples;
    const int margin = std::min({column, row, samples.x - 1 - column, samples.y - 1 - row});
    const double* const centre =
        &ground_.heights_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(samples.x) +
                           static_cast<std::size_t>(column)];
    SampleLayers layers;
    if (std::isnan(*centre)) return layers;
    if (plane_.reach <= margin) fit_plane(centre, layers);
    if (step_.reach <= margin) layers.step_m = step_m(centre);
    if (footprint_reach_ <= margin) layers.clearance_m = clearance_m(centre);
    return layers;
  }

 private:
  // Fits the plane z = mean + east x + north y. Its normal equations are diagonal, as a disc is
  // symmetric about both axes and diagonals.
  void fit_plane(const double* centre, SampleLayers& layers) const {
    double sum_m = 0, east_m2 = 0, north_m2 = 0;
    for (std::size_t i = 0; i < plane_.offsets.size(); ++i) {
      const double height_m = centre[plane_.offsets[i]] - *centre;
      sum_m += height_m;
      east_m2 += plane_.places_m[i].x * height_m;
      north_m2 += plane_.places_m[i].y * height_m;
    }
    const auto count = static_cast<double>(plane_.offsets.size());
    const double mean_m = sum_m / count;
    const double east = east_m2 / plane_moment_m2_, north = north_m2 / plane_moment_m2_;
    double squares_m2 = 0;
    for (std::size_t i = 0; i < plane_.offsets.size(); ++i) {
      const glm::dvec2 place_m = plane_.places_m[i];
      const double residual_m =
          centre[plane_.offsets[i]] - *centre - (mean_m + east * place_m.x + north * place_m.y);
      squares_m2 += residual_m * residual_m;
    }
    layers.slope_deg = math::atan(math::hypot(east, north)) * 180 / std::numbers::pi;
    layers.roughness_m = std::sqrt(squares_m2 / count);
  }

  double step_m(const double* centre) const {
    double low_m = *centre, high_m = *centre;
    for (const std::ptrdiff_t offset : step_.offsets) {
      const double height_m = centre[offset];
      if (std::isnan(height_m)) return not_there;
      low_m = std::min(low_m, height_m);
      high_m = std::max(high_m, height_m);
    }
    return high_m - low_m;
  }

  double clearance_m(const double* centre) const {
    double least_m = std::numeric_limits<double>::infinity();
    for (const FootprintStencil& heading : headings_) {
      const double at_heading_m = clearance_m(heading, centre);
      if (std::isnan(at_heading_m)) return not_there;
      least_m = std::min(least_m, at_heading_m);
    }
    return least_m;
  }

  // Returns the clearance at a heading. The wheels' plane is the least squares plane of the four
  // heights under them, as of vehicles that drive (ground_path.h); the underbody is parallel to it.
  // The difference of two surfaces that are linear over each triangle is largest at a corner of a
  // triangle's part under the underbody.
  double clearance_m(const FootprintStencil& heading, const double* centre) const {
    std::array<double, 4> wheels_m{};
    for (std::size_t i = 0; i < wheels_m.size(); ++i)
      wheels_m[i] = heading.wheels[i].height_m(centre);
    const auto [front_left, front_right, rear_left, rear_right] = wheels_m;
    const double mean_m = (front_left + front_right + rear_left + rear_right) / 4;
    const double pitch =
        (front_left + front_right - rear_left - rear_right) / (2 * vehicle_.wheelbase_m);
    const double roll =
        (front_left + rear_left - front_right - rear_right) / (2 * vehicle_.track_m);
    double highest_m = -std::numeric_limits<double>::infinity();
    for (const StencilPoint& point : heading.underbody) {
      const double above_m =
          point.height_m(centre) - (mean_m + pitch * point.p_B.x + roll * point.p_B.y);
      if (std::isnan(above_m)) return not_there;
      highest_m = std::max(highest_m, above_m);
    }
    return vehicle_.clearance_m - highest_m / std::sqrt(1 + pitch * pitch + roll * roll);
  }

  const SampledGround& ground_;
  VehicleSize vehicle_;
  DiscStencil plane_, step_;
  double plane_moment_m2_ = 0;
  std::vector<FootprintStencil> headings_;
  int footprint_reach_ = 0;
};

std::uint8_t verdict_of(const SampleLayers& layers, const TraversabilityLimits& limits) {
  if (std::isnan(layers.slope_deg) || std::isnan(layers.step_m) || std::isnan(layers.clearance_m))
    return no_verdict;
  unsigned verdict = 0;
  const auto add = [&](bool is_blocked, GroundObstacle obstacle) {
    if (is_blocked) verdict |= static_cast<unsigned>(obstacle);
  };
  add(limits.slope_deg && layers.slope_deg > *limits.slope_deg, GroundObstacle::Slope);
  add(limits.roughness_m && layers.roughness_m > *limits.roughness_m, GroundObstacle::Roughness);
  add(limits.step_m && layers.step_m > *limits.step_m, GroundObstacle::Step);
  add(layers.clearance_m <= limits.least_clearance_m, GroundObstacle::Clearance);
  return static_cast<std::uint8_t>(verdict);
}

constexpr double sampling_share = 0.3;  // of the time

// Calls work(sample, index) for each sample, rows in parallel, and reports progress between blocks
// of rows.
void each_row(glm::ivec2 samples, const std::function<void(double)>& progress, double from,
              double to, const auto& work) {
  constexpr int block = 64;
  for (int first = 0; first < samples.y; first += block) {
    const int count = std::min(block, samples.y - first);
    run_pass(run_in_parallel, static_cast<std::size_t>(count), [&](std::size_t in_block) {
      const int row = first + static_cast<int>(in_block);
      std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(samples.x);
      for (int column = 0; column < samples.x; ++column) work(glm::ivec2(column, row), i++);
    });
    if (progress) progress(from + (to - from) * (first + count) / samples.y);
  }
}

// Returns the height of the ground at a point; NaN where there is none. A query selects one facet:
// at a point on the boundary of several, it may be one that does not exist beside a hole.
double height_beside_holes_m(const Ground& ground, glm::dvec2 p) {
  if (const auto height_m = ground.height_m_at(p)) return *height_m;
  constexpr double aside = 1e-6;  // of a cell
  const GridFrame& frame = ground.frame();
  for (const glm::dvec2 way : {glm::dvec2(1, 1), glm::dvec2(-1, 1), glm::dvec2(1, -1),
                               glm::dvec2(-1, -1), glm::dvec2(2, -1), glm::dvec2(-2, 1)}) {
    const auto plane = ground.facet_at(p + aside * way * frame.step_m);
    if (!plane) continue;
    const glm::dvec2 at = frame.to_grid(p);
    return plane->height_m + plane->u_slope_m * at.x + plane->v_slope_m * at.y;
  }
  return not_there;
}

// Samples the ground. The last samples may be beyond its edge by a rounding error.
void sample(const Ground& ground, const std::function<void(double)>& progress,
            SampledGround& sampled, TraversabilityLayers& layers) {
  const GridFrame& frame = ground.frame();
  const glm::dvec2 a = frame.to_D({0, 0}), b = frame.to_D(frame.samples - 1);
  each_row(sampled.frame.samples, progress, 0, sampling_share, [&](glm::ivec2 at, std::size_t i) {
    const glm::dvec2 p = glm::clamp(sampled.frame.to_D(at), glm::min(a, b), glm::max(a, b));
    sampled.heights_m[i] = height_beside_holes_m(ground, p);
    layers.elevation_m[i] = static_cast<float>(sampled.heights_m[i]);
  });
}

void judge(const SampledGround& sampled, const TraversabilitySpec& spec,
           const std::function<void(double)>& progress, TraversabilityLayers& layers) {
  const GroundJudge judge(sampled, spec);
  each_row(sampled.frame.samples, progress, sampling_share, 1, [&](glm::ivec2 at, std::size_t i) {
    const SampleLayers sample = judge.at(at.x, at.y);
    layers.slope_deg[i] = static_cast<float>(sample.slope_deg);
    layers.roughness_m[i] = static_cast<float>(sample.roughness_m);
    layers.step_m[i] = static_cast<float>(sample.step_m);
    layers.clearance_m[i] = static_cast<float>(sample.clearance_m);
    layers.belly_contact[i] =
        std::isnan(sample.clearance_m) ? no_verdict : std::uint8_t{sample.clearance_m <= 0};
    layers.verdict[i] = verdict_of(sample, spec.limits);
  });
}

}  // namespace

TraversabilityLayers traversability(const Ground& ground, const TraversabilitySpec& spec,
                                    std::size_t memory_bytes,
                                    const std::function<void(double share)>& progress) {
  check_spec(spec);
  SampledGround sampled{samples_over(ground, spec.cell_m, memory_bytes), {}};
  const glm::ivec2 size = sampled.frame.samples;
  const auto samples = static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
  TraversabilityLayers layers;
  layers.frame = sampled.frame;
  sampled.heights_m.resize(samples);
  for (auto* layer : {&layers.elevation_m, &layers.slope_deg, &layers.roughness_m, &layers.step_m,
                      &layers.clearance_m})
    layer->resize(samples);
  for (auto* layer : {&layers.belly_contact, &layers.verdict}) layer->resize(samples);
  sample(ground, progress, sampled, layers);
  judge(sampled, spec, progress, layers);
  if (std::ranges::all_of(layers.verdict, [](std::uint8_t v) { return v == no_verdict; })) {
    const glm::dvec2 extent_m = glm::dvec2(size - 1) * spec.cell_m;
    throw Error(
        "traversability: nowhere on the {:g} m x {:g} m of ground, less its holes, is there ground "
        "under a whole vehicle of {:g} m and within its windows; are its sizes in metres?",
        extent_m.x, extent_m.y, 2 * spec.vehicle.half_diagonal_m());
  }
  return layers;
}

VerdictCounts count_verdicts(const TraversabilityLayers& layers) {
  VerdictCounts counts;
  for (const std::uint8_t verdict : layers.verdict) {
    if (verdict == no_verdict) continue;
    ++counts.known;
    counts.traversable += verdict == 0 ? 1 : 0;
    for (std::size_t bit = 0; bit < counts.obstacles.size(); ++bit)
      counts.obstacles[bit] += (unsigned{verdict} >> bit) & 1U;
  }
  return counts;
}

}  // namespace groundray
