#include "reconstruction/pipeline/dem_pipeline.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>
#include <utility>

#include "core/math.h"
#include "reconstruction/dem/fill/dem_fill.h"
#include "reconstruction/dem/fill/sight_bound.h"
#include "reconstruction/dem/ground/ground_filter.h"
#include "reconstruction/pipeline/dem_points.h"
#include "terrain/dem/density_map.h"

namespace groundray {
namespace {

// ----- points

// Keeps the points whose index satisfies `is_kept`.
template <typename IsKept>
void keep(MeasuredPoints& points, const IsKept& is_kept) {
  const auto keep_column = [&](auto& column) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (is_kept(i)) column[kept++] = column[i];
    }
    column.resize(kept);
  };
  keep_column(points.sd_m);
  keep_column(points.bias_sd_m);
  keep_column(points.lean);
  keep_column(points.across_sd_m);
  keep_column(points.groups);
  keep_column(points.origins);
  keep_column(points.p_m);
}

// Keeps the points over the frame's cells and a margin, whose points affect the ground filter.
void keep_around(const GridFrame& frame, double margin_m, MeasuredPoints& points) {
  const glm::dvec2 a = frame.to_D({0, 0}), b = frame.to_D(frame.samples - 1);
  const glm::dvec2 border = glm::dvec2(margin_m) + glm::abs(frame.step_m);
  const Area area{glm::min(a, b) - border, glm::max(a, b) + border};
  std::vector<std::uint8_t> is_near;
  for (const glm::dvec3& p_m : points.p_m)
    is_near.push_back(std::isfinite(p_m.z) && area.contains(glm::dvec2(p_m)) ? 1 : 0);
  keep(points, [&](std::size_t i) { return is_near[i] != 0; });
}

// ----- ground

Fusion fuse_stage(const PointSource& points, const GridFrame& frame, const DemBuildOptions& options,
                  const PipelineControl& control, DemResult& result) {
  return run_stage({"fuse", "fusing"}, control, result.seconds, [&](const RunControl& work) {
    return fuse(points, frame, options.fusion, work);
  });
}

Fusion fuse_ground(const PointSource& points, const GridFrame& frame,
                   const DemBuildOptions& options, const PipelineControl& control,
                   DemResult& result) {
  MeasuredPoints all;
  for (MeasuredPoints block; points(block);) append(block, all);
  const std::size_t count = all.size();
  keep_around(frame, 2 * options.filter->window_radius_m, all);
  if (all.size() == 0)
    return {.layers = unknown_layers(frame), .counts = {.points = count, .outside = count}};
  const GroundPoints ground = run_stage(
      {"ground", "finding the ground"}, control, result.seconds,
      [&](const RunControl& work) { return filter_ground(all.p_m, *options.filter, work); });
  result.ground = ground.counts;
  Overhangs overhangs = find_overhangs(all.p_m, ground, frame, options.fusion.surface_gap_m);
  keep(all, [&](std::size_t i) { return ground.classes[i] == GroundClass::Ground; });
  Fusion fusion = fuse_stage(single_block(std::move(all)), frame, options, control, result);
  fusion.layers.surfaces = std::move(overhangs.surfaces);
  fusion.layers.overhang_m = std::move(overhangs.overhang_m);
  fusion.layers.clearance_m = std::move(overhangs.clearance_m);
  return fusion;
}

// ----- lines of sight

// Returns true if a point is above measured ground, or below it by at most the bound's rise.
bool is_sound(const DemLayers& layers, const glm::dvec3& end_m, double margin_m) {
  constexpr double sds = 2;
  const glm::dvec2 at = glm::round(layers.frame.to_grid(glm::dvec2(end_m)));
  const glm::ivec2 samples = layers.frame.samples;
  if (!(at.x >= 0 && at.y >= 0 && at.x < samples.x && at.y < samples.y)) return false;
  const std::size_t i = static_cast<std::size_t>(at.y) * static_cast<std::size_t>(samples.x) +
                        static_cast<std::size_t>(at.x);
  const double below_m = layers.elevation_m[i] - end_m.z;  // NaN where nothing was measured
  return below_m <= margin_m + sds * std::sqrt(layers.variance_m2[i]);
}

// Part of a frame that lines of sight cross.
struct SightWindow {
  glm::ivec2 first{0};
  GridFrame frame;
};

SightWindow window_of(const GridFrame& frame, const std::vector<SightLine>& lines) {
  glm::dvec2 low(frame.samples), high(0);
  for (const SightLine& line : lines) {
    for (const glm::dvec3& p_m : {line.origin_m, line.end_m}) {
      const glm::dvec2 at = frame.to_grid(glm::dvec2(p_m));
      low = glm::min(low, at);
      high = glm::max(high, at);
    }
  }
  const glm::dvec2 most(frame.samples - 1), least_last(1);  // a frame has 2 x 2 samples at least
  const glm::ivec2 last(glm::clamp(glm::ceil(high) + 1., least_last, most));
  const glm::ivec2 first(glm::clamp(glm::floor(low) - 1., glm::dvec2(0), glm::dvec2(last - 1)));
  SightWindow window{first, frame};
  window.frame.samples = last - first + 1;
  window.frame.origin_m = frame.to_D(first);
  return window;
}

void lower(const SightWindow& window, const std::vector<float>& bound_m, DemLayers& layers) {
  const auto columns = static_cast<std::size_t>(layers.frame.samples.x);
  std::size_t i = 0;
  for (int row = 0; row < window.frame.samples.y; ++row) {
    std::size_t to = static_cast<std::size_t>(window.first.y + row) * columns +
                     static_cast<std::size_t>(window.first.x);
    for (int column = 0; column < window.frame.samples.x; ++column, ++i, ++to)
      layers.upper_bound_m[to] = std::fmin(layers.upper_bound_m[to], bound_m[i]);
  }
}

BoundTally bound(const DemSources& sources, const DemBuildOptions& options, const RunControl& work,
                 DemLayers& layers) {
  constexpr double share_of_cell = 0.25;  // half a cell on a slope of 1/2
  const glm::dvec2 cell_m = glm::abs(layers.frame.step_m);
  const double margin_m =
      options.sight_margin_m.value_or(share_of_cell * std::max(cell_m.x, cell_m.y));
  for (LidarBlock block; sources.beams(block);) {
    bound_by_sight(block, margin_m, layers);
    work.progress(block.share);
  }
  constexpr float sds = 3;
  BoundTally tally;
  for (std::size_t i = 0; i < layers.upper_bound_m.size(); ++i) {
    if (std::isnan(layers.upper_bound_m[i])) continue;
    ++tally.samples;
    if (layers.elevation_m[i] - sds * std::sqrt(layers.variance_m2[i]) > layers.upper_bound_m[i])
      ++tally.broken;
  }
  return tally;
}

// ----- heights

void smooth(const SmoothOptions& options, const PipelineControl& control, DemResult& result) {
  DemLayers& layers = result.layers;
  result.smoothed =
      run_stage({"smooth", "smoothing"}, control, result.seconds, [&](const RunControl& work) {
        return smooth_dem(layers.frame, layers.elevation_m, layers.variance_m2, options, work);
      });
  const auto heights_m = std::exchange(result.smoothed->heights_m, {});
  for (std::size_t i = 0; i < heights_m.size(); ++i) {
    if (!std::isnan(heights_m[i])) layers.elevation_m[i] = heights_m[i];
  }
}

void fill(const DemBuildOptions& options, const PipelineControl& control, DemResult& result) {
  DemLayers& layers = result.layers;
  result.filled =
      run_stage({"fill", "filling"}, control, result.seconds, [&](const RunControl& work) {
        return options.fill_method == FillMethod::Mesh
                   ? fill_dem_by_mesh(layers.frame, layers.elevation_m, *options.fill,
                                      options.most_rim_edges, work)
                   : fill_dem(layers.frame, layers.elevation_m, layers.upper_bound_m, *options.fill,
                              work);
      });
  const auto heights_m = std::exchange(result.filled->heights_m, {});
  const auto sd_m = std::exchange(result.filled->sd_m, {});
  result.filled->to_data_m = {};
  for (std::size_t i = 0; i < heights_m.size(); ++i) {
    if (!std::isnan(layers.elevation_m[i]) || std::isnan(heights_m[i])) continue;
    layers.elevation_m[i] = heights_m[i];
    layers.source[i] = HeightSource::Filled;
    if (!sd_m.empty()) layers.fill_sd_m[i] = sd_m[i];
  }
  add_boundary_variance(layers);
}

// Returns the slope (rise over run) along one axis; NaN if neither neighbour has a height.
float slope_along(const DemLayers& layers, std::ptrdiff_t i, int place, int count,
                  std::ptrdiff_t stride, double step_m) {
  constexpr float no_height = std::numeric_limits<float>::quiet_NaN();
  const auto height_m = [&](std::ptrdiff_t at) {
    return layers.elevation_m[static_cast<std::size_t>(at)];
  };
  const float before_m = place > 0 ? height_m(i - stride) : no_height;
  const float after_m = place + 1 < count ? height_m(i + stride) : no_height;
  const auto step = static_cast<float>(step_m);
  if (!std::isnan(before_m) && !std::isnan(after_m)) return (after_m - before_m) / (2 * step);
  return (std::isnan(after_m) ? height_m(i) - before_m : after_m - height_m(i)) / step;
}

void set_slopes(DemLayers& layers) {
  const glm::ivec2 samples = layers.frame.samples;
  std::ptrdiff_t i = 0;
  for (int row = 0; row < samples.y; ++row) {
    for (int column = 0; column < samples.x; ++column, ++i) {
      if (std::isnan(layers.elevation_m[static_cast<std::size_t>(i)])) continue;
      const float x = slope_along(layers, i, column, samples.x, 1, layers.frame.step_m.x);
      const float y = slope_along(layers, i, row, samples.y, samples.x, layers.frame.step_m.y);
      layers.slope_rad[static_cast<std::size_t>(i)] =
          static_cast<float>(math::atan(math::hypot(x, y)));
    }
  }
}

}  // namespace

PointSource single_block(MeasuredPoints points) {
  return [points = std::move(points), is_first = true](MeasuredPoints& block) mutable {
    if (!std::exchange(is_first, false)) return false;
    block = std::move(points);
    return true;
  };
}

void bound_by_sight(const LidarBlock& block, double margin_m, DemLayers& layers) {
  constexpr double sds = 2;
  std::vector<SightLine> lines;
  for (std::size_t i = 0; i < block.points.size(); ++i) {
    const glm::dvec3& end_m = block.points.p_m[i];
    if (!is_sound(layers, end_m, margin_m)) continue;
    const glm::dvec3 up_m(0, 0, sds * math::hypot(block.points.sd_m[i], block.points.bias_sd_m[i]));
    lines.push_back({.origin_m = block.origins_m[i] + up_m, .end_m = end_m + up_m});
  }
  if (lines.empty()) return;
  const SightWindow window = window_of(layers.frame, lines);
  lower(window, sight_bound(window.frame, {}, lines, margin_m), layers);
}

DemResult build_dem(const DemSources& sources, const GridFrame& frame,
                    const DemBuildOptions& options, const PipelineControl& control) {
  DemResult result;
  Fusion fusion = options.filter ? fuse_ground(sources.points, frame, options, control, result)
                                 : fuse_stage(sources.points, frame, options, control, result);
  result.layers = std::move(fusion.layers);
  result.fusion = fusion.counts;
  result.has_ground = std::ranges::any_of(result.layers.elevation_m,
                                          [](float height_m) { return !std::isnan(height_m); });
  if (!result.has_ground) return result;
  if (sources.beams) {
    result.bound = run_stage(
        {"sight", "tracing lines of sight"}, control, result.seconds,
        [&](const RunControl& work) { return bound(sources, options, work, result.layers); });
  }
  if (options.smooth) smooth(*options.smooth, control, result);
  if (options.fill) fill(options, control, result);
  set_slopes(result.layers);
  return result;
}

}  // namespace groundray
