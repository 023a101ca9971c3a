#include "reconstruction/dem/fusion/dem_fusion.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "core/error.h"
#include "reconstruction/dem/fusion/point_spool.h"
#include "reconstruction/dem/fusion/tile_fit.h"

namespace groundray {
namespace {

// Memory per point while its tile is fitted: as read, and sorted.
constexpr std::size_t bytes_in_work = 2 * sizeof(PackedPoint);

void refuse_faults(const FusionOptions& options) {
  Violations broken("FusionOptions");
  broken.unless(options.outlier_share >= 0 && options.outlier_share <= 0.5,
                "outlier_share = {} must be 0 to 0.5", options.outlier_share);
  broken.unless(options.surface_gap_m >= 0 && options.surface_gap_m <= PackedPoint::highest_m,
                "surface_gap_m = {} must be 0 to {}", options.surface_gap_m,
                PackedPoint::highest_m);
  broken.unless(options.steepest_slope > 0, "steepest_slope = {} must be above 0",
                options.steepest_slope);
  broken.unless(options.slope_sd > 0 && options.slope_sd <= 1e6,
                "slope_sd = {} must be above 0 and at most 1e6", options.slope_sd);
  broken.unless(options.most_sd_m > 0, "most_sd_m = {} must be above 0", options.most_sd_m);
  broken.throw_if_any();
}

std::filesystem::path folder_of(const FusionOptions& options) {
  if (!options.folder.empty()) return options.folder;
  std::error_code fault;
  std::filesystem::path folder = std::filesystem::temp_directory_path(fault);
  if (fault) throw Error("there is no folder for temporary files: specify one");
  return folder;
}

// Returns tiles that are as large as possible, but numerous enough for many threads, and never a
// single row or column.
CellTiling tiling_of(const GridFrame& frame) {
  constexpr int smallest = 28, small = 124;
  const glm::ivec2 size = frame.samples;
  const double cells = static_cast<double>(size.x) * size.y;
  constexpr double many = 16384;  // tiles, each with a buffer
  const int most = cells > many * small * small ? CellTiling::largest_edge : small;
  const double wanted = std::ceil(std::sqrt(cells / 16));
  int edge = static_cast<int>(std::clamp<double>(wanted, smallest, most));
  while (edge > smallest && (size.x % edge == 1 || size.y % edge == 1)) --edge;
  return {glm::ivec2(0), size, edge};
}

// Each tile has a list of its points, and a buffer for a few of them.
void refuse_many_tiles(const CellTiling& tiling, const GridFrame& frame, std::size_t memory_bytes) {
  constexpr std::size_t bytes_each = 1024;
  if (tiling.count() <= 64 || tiling.count() <= memory_bytes / bytes_each) return;
  throw Error(
      "a DEM of {} x {} samples is split into {} tiles, whose point buffers take more than the "
      "{:.3g} MB allowed: allow more memory, or choose larger cells or a smaller area",
      frame.samples.x, frame.samples.y, tiling.count(), 1e-6 * static_cast<double>(memory_bytes));
}

// First pass: sorts points into the tiles that contain them, also in their margins.
class Intake {
 public:
  Intake(const GridFrame& frame, const CellTiling& tiling, PointSpool& spool)
      : frame_(frame), tiling_(tiling), spool_(spool) {}

  void take(const MeasuredPoints& block);
  const FusionCounts& counts() const noexcept { return counts_; }

 private:
  void refuse_columns(const MeasuredPoints& block) const;
  void set_aside(const MeasuredPoints& block, std::size_t i);

  GridFrame frame_;
  CellTiling tiling_;
  PointSpool& spool_;
  FusionCounts counts_;
};

void Intake::refuse_columns(const MeasuredPoints& block) const {
  const std::size_t n = block.size();
  if (block.sd_m.size() == n && block.bias_sd_m.size() == n && block.lean.size() == n &&
      block.across_sd_m.size() == n && block.groups.size() == n && block.origins.size() == n) {
    return;
  }
  throw Error(
      "measured points after the first {}: columns must have the same length, but p_m has {} "
      "entries, sd_m {}, bias_sd_m {}, lean {}, across_sd_m {}, groups {} and origins {}",
      counts_.points, n, block.sd_m.size(), block.bias_sd_m.size(), block.lean.size(),
      block.across_sd_m.size(), block.groups.size(), block.origins.size());
}

bool is_sd(float value_m) {
  return value_m >= 0 && value_m < std::numeric_limits<float>::infinity();
}

bool is_lean(glm::vec2 lean) {
  constexpr float most = 1.001F * MeasuredPoints::most_lean;
  return glm::dot(lean, lean) <= most * most;
}

// Counts a point that is not used, or rejects it.
void Intake::set_aside(const MeasuredPoints& block, std::size_t i) {
  const glm::dvec3& p_m = block.p_m[i];
  if (!(std::isfinite(p_m.x) && std::isfinite(p_m.y) &&
        std::abs(p_m.z) <= PackedPoint::highest_m)) {
    ++counts_.unusable;
    return;
  }
  Violations broken(fmt::format("measured point {}", counts_.points + i));
  const auto check = [&broken](const char* name, float value_m) {
    broken.unless(is_sd(value_m), "{} = {} must be a number >= 0", name, value_m);
  };
  check("sd_m", block.sd_m[i]);
  check("bias_sd_m", block.bias_sd_m[i]);
  check("across_sd_m", block.across_sd_m[i]);
  broken.unless(is_lean(block.lean[i]),
                "lean = ({}, {}) must be finite, with a length of at most {}", block.lean[i].x,
                block.lean[i].y, MeasuredPoints::most_lean);
  broken.unless(block.groups[i] < PackedPoint::groups, "group {} must be below 2^31",
                block.groups[i]);
  broken.throw_if_any();
  ++counts_.outside;
}

void Intake::take(const MeasuredPoints& block) {
  refuse_columns(block);
  const GridFrame frame = frame_;
  const glm::dvec2 samples(frame.samples);
  for (std::size_t i = 0; i < block.size(); ++i) {
    const glm::dvec3 p_m = block.p_m[i];
    const float sd_m = block.sd_m[i], bias_m = block.bias_sd_m[i], across_m = block.across_sd_m[i];
    const std::uint32_t group = block.groups[i];
    const glm::vec2 lean = block.lean[i];
    const glm::dvec2 at = frame.to_grid(glm::dvec2(p_m)) + 0.5;  // from the first cell's corner
    const bool is_inside = at.x >= 0 && at.x < samples.x && at.y >= 0 && at.y < samples.y;
    if (!is_inside || !(std::abs(p_m.z) <= PackedPoint::highest_m) ||
        !(is_sd(sd_m) && is_sd(bias_m) && is_sd(across_m) && is_lean(lean)) ||
        group >= PackedPoint::groups) {
      set_aside(block, i);
      continue;
    }
    const glm::ivec2 cell(at);
    constexpr double places = 65536, steps = 1 / PackedPoint::height_step_m;
    const auto height = static_cast<std::int32_t>(std::floor(p_m.z * steps + 0.5));
    const auto x = static_cast<std::uint16_t>(static_cast<std::int32_t>((at.x - cell.x) * places));
    const auto y = static_cast<std::uint16_t>(static_cast<std::int32_t>((at.y - cell.y) * places));
    const std::uint32_t name = 2 * group + (block.origins[i] == PointOrigin::Stereo ? 1U : 0U);
    const std::uint16_t sd = packed_sd(sd_m), bias = packed_sd(bias_m),
                        across = packed_sd(across_m), lean_x = packed_lean(lean.x),
                        lean_y = packed_lean(lean.y);
    tiling_.for_each_view(cell, [&](std::size_t tile, std::uint16_t number) {
      spool_.add(tile, {height, name, number, x, y, sd, bias, across, lean_x, lean_y});
    });
  }
  counts_.points += block.size();
}

// Second pass: fits the tiles.
class TileFusion {
 public:
  TileFusion(const GridFrame& frame, const FusionOptions& options, std::filesystem::path folder)
      : frame_(frame),
        memory_bytes_(options.memory_bytes),
        folder_(std::move(folder)),
        rules_{frame.step_m,     options.surface_gap_m, options.steepest_slope,
               options.slope_sd, options.most_sd_m,     OutlierRule(options.outlier_share)} {}

  std::size_t most_in_tile() const noexcept { return memory_bytes_ / 4 / bytes_in_work; }
  std::size_t most_in_batch() const noexcept { return memory_bytes_ / 2 / bytes_in_work; }

  /// Returns tile `tile` of `tiling`, whose points are in the bin of that number. Several threads
  /// may call it at a time, except for tiles of more than most_in_tile points.
  DemTile fuse(const CellTiling& tiling, const PointSpool& spool, std::size_t tile);

  std::uint64_t without_ground() const noexcept { return without_ground_; }
  std::uint64_t uncertain() const noexcept { return uncertain_; }
  std::uint64_t bytes_on_disk() const noexcept { return bytes_on_disk_; }

 private:
  void fit(const CellTiling& tiling, const PointSpool& spool, std::size_t tile, DemTile& into);
  void split(const CellTiling& tiling, const PointSpool& spool, std::size_t tile, DemTile& into);

  GridFrame frame_;
  std::size_t memory_bytes_;
  std::filesystem::path folder_;
  TileRules rules_;
  std::atomic<std::uint64_t> without_ground_ = 0, uncertain_ = 0;
  std::uint64_t bytes_on_disk_ = 0;
};

DemTile TileFusion::fuse(const CellTiling& tiling, const PointSpool& spool, std::size_t tile) {
  GridFrame frame = frame_;
  const glm::ivec2 first = tiling.first_cell(tile);
  frame.samples = tiling.cells(tile);
  frame.origin_m = frame_.to_D(first);
  DemTile fused{first, unknown_layers(frame)};
  fit(tiling, spool, tile, fused);
  return fused;
}

void TileFusion::fit(const CellTiling& tiling, const PointSpool& spool, std::size_t tile,
                     DemTile& into) {
  if (spool.count(tile) == 0) return;
  if (spool.count(tile) > most_in_tile()) return split(tiling, spool, tile, into);
  std::vector<PackedPoint> read_back;
  const TileCounts counts = fit_tile(spool.parts(tile, read_back), tiling.cells(tile),
                                     tiling.first_cell(tile) - into.first, rules_, into.layers);
  without_ground_ += counts.without_ground;
  uncertain_ += counts.uncertain;
}

// Splits a tile of too many points into tiles of an eighth of its edge.
void TileFusion::split(const CellTiling& tiling, const PointSpool& spool, std::size_t tile,
                       DemTile& into) {
  const glm::ivec2 first = tiling.first_cell(tile);
  if (tiling.edge() == CellTiling::smallest_edge) {
    const glm::dvec2 place_m = frame_.to_D(first);
    throw Error(
        "the cells around ({}, {}) m contain {} points, which take {:.3g} MB at once, more than a "
        "quarter of the {:.3g} MB allowed: allow more memory or choose smaller cells",
        place_m.x, place_m.y, spool.count(tile),
        1e-6 * static_cast<double>(spool.count(tile) * bytes_in_work),
        1e-6 * static_cast<double>(memory_bytes_));
  }
  const CellTiling parts(first, tiling.cells(tile),
                         std::max(CellTiling::smallest_edge, tiling.edge() / 8));
  PointSpool sorted(parts.count(), memory_bytes_ / 16, folder_);
  spool.read(tile, [&](std::span<const PackedPoint> some) {
    for (PackedPoint point : some) {
      const glm::ivec2 cell =
          first - CellTiling::margin +
          glm::ivec2(point.cell % CellTiling::width, point.cell / CellTiling::width);
      parts.for_each_view(cell, [&](std::size_t part, std::uint16_t number) {
        point.cell = number;
        sorted.add(part, point);
      });
    }
  });
  bytes_on_disk_ += sorted.bytes_on_disk();
  for (std::size_t part = 0; part < parts.count(); ++part) fit(parts, sorted, part, into);
}

// Returns the end of the tiles from `begin` that are fused together: as many as the memory for
// their points allows. A tile of too many points, which will be split, is fused by itself.
std::size_t batch_end(const PointSpool& spool, std::size_t begin, std::size_t most_points,
                      std::size_t most_in_tile) {
  constexpr std::size_t cells_weigh = 200'000;  // memory of a tile without points, in points
  constexpr std::size_t most_tiles = 64;
  std::size_t end = begin, points = 0;
  while (end < spool.bins() && end - begin < most_tiles) {
    points += spool.count(end) + cells_weigh;
    if (end > begin && (points > most_points || spool.count(end) > most_in_tile)) break;
    if (spool.count(end++) > most_in_tile) break;
  }
  return end;
}

}  // namespace

FusionCounts fuse(const PointSource& source, const GridFrame& frame, const FusionOptions& options,
                  const std::function<void(DemTile&&)>& sink, const RunControl& work) {
  refuse_faults(frame);
  refuse_faults(options);
  const CellTiling tiling = tiling_of(frame);
  refuse_many_tiles(tiling, frame, options.memory_bytes);
  const std::filesystem::path folder = folder_of(options);
  PointSpool spool(tiling.count(), options.memory_bytes / 4, folder);
  Intake intake(frame, tiling, spool);
  for (MeasuredPoints block; source(block);) {
    intake.take(block);
    work.report(0);
  }
  TileFusion fusion(frame, options, folder);
  std::vector<DemTile> fused;
  for (std::size_t begin = 0; begin < spool.bins();) {
    const std::size_t end = batch_end(spool, begin, fusion.most_in_batch(), fusion.most_in_tile());
    fused.resize(end - begin);
    tbb::parallel_for(begin, end, [&](std::size_t tile) {
      fused[tile - begin] = fusion.fuse(tiling, spool, tile);
    });
    for (DemTile& tile : fused) sink(std::move(tile));
    begin = end;
    work.report(0.5 + 0.5 * static_cast<double>(begin) / static_cast<double>(spool.bins()));
  }
  FusionCounts counts = intake.counts();
  counts.without_ground = fusion.without_ground();
  counts.uncertain = fusion.uncertain();
  counts.bytes_on_disk = spool.bytes_on_disk() + fusion.bytes_on_disk();
  return counts;
}

namespace {

template <typename T>
void copy_rows(const std::vector<T>& from, glm::ivec2 size, std::vector<T>& to, int stride,
               glm::ivec2 first) {
  for (int row = 0; row < size.y; ++row) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(first.y + row) * stride + first.x;
    std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(row) * size.x, size.x, to.begin() + at);
  }
}

void place(const DemTile& tile, DemLayers& whole) {
  const auto copy = [&](auto column) {
    copy_rows(tile.layers.*column, tile.layers.frame.samples, whole.*column, whole.frame.samples.x,
              tile.first);
  };
  copy(&DemLayers::elevation_m);
  copy(&DemLayers::variance_m2);
  copy(&DemLayers::lidar);
  copy(&DemLayers::stereo);
  copy(&DemLayers::chi2);
  copy(&DemLayers::surfaces);
  copy(&DemLayers::overhang_m);
  copy(&DemLayers::clearance_m);
  copy(&DemLayers::source);
  copy(&DemLayers::slope_rad);
}

void set_distances(DemLayers& layers) {
  const auto has_data =
      marks_of(layers.source, [](HeightSource source) { return source != HeightSource::None; });
  layers.to_data_m = data_distance_m(layers.frame.samples, layers.frame.step_m, has_data);
}

}  // namespace

Fusion fuse(const PointSource& source, const GridFrame& frame, const FusionOptions& options,
            const RunControl& work) {
  refuse_faults(frame);
  constexpr double bytes_each = 56;  // of the layers and the distance transform
  const double bytes = bytes_each * frame.samples.x * frame.samples.y;
  if (bytes > static_cast<double>(work.most_bytes)) {
    throw Error(
        "a DEM of {} x {} samples takes {:.0f} MB, more than the {:.0f} MB allowed: choose larger "
        "cells, a smaller area, or tiles",
        frame.samples.x, frame.samples.y, bytes * 1e-6,
        static_cast<double>(work.most_bytes) * 1e-6);
  }
  Fusion fusion{unknown_layers(frame), {}};
  fusion.counts = fuse(
      source, frame, options, [&fusion](DemTile&& tile) { place(tile, fusion.layers); }, work);
  set_distances(fusion.layers);
  return fusion;
}

}  // namespace groundray
