#include <fmt/format.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/binding/arrays.h"
#include "apps/python/binding/bind.h"
#include "apps/python/binding/enum_from_text.h"
#include "apps/python/binding/long_call.h"
#include "apps/python/binding/numpy_argument.h"
#include "apps/python/binding/pickle.h"
#include "apps/python/fused_dem.h"
#include "apps/python/placed_returns.h"
#include "core/error.h"
#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/fill/dem_fill.h"
#include "reconstruction/dem/fusion/dem_fusion.h"
#include "reconstruction/dem/smooth/dem_smooth.h"
#include "reconstruction/pipeline/dem_pipeline.h"
#include "reconstruction/pipeline/dem_points.h"

namespace groundray::python {
namespace {

using nb::literals::operator""_a;

// ----- points

PointNoise checked_noise(const char* call, double divergence_rad, double position_sd_m,
                         double attitude_sd_rad) {
  Violations broken(call);
  const auto demand = [&](const char* name, double value) {
    broken.unless(value >= 0 && std::isfinite(value), "{} = {} must be 0 or more, and finite", name,
                  value);
  };
  demand("divergence_rad", divergence_rad);
  demand("position_sd_m", position_sd_m);
  demand("attitude_sd_rad", attitude_sd_rad);
  broken.throw_if_any();
  return {.divergence_rad = divergence_rad,
          .position_sd_m = position_sd_m,
          .attitude_sd_rad = attitude_sd_rad};
}

void add_point(const LidarPoint& point, std::uint32_t group, const PointNoise& noise,
               MeasuredPoints& to) {
  if (!(point.range_sd_m >= 0) || !std::isfinite(point.range_sd_m))
    throw Error("the standard deviation of the range of point {}, {} m, must be 0 or more",
                to.size(), point.range_sd_m);
  append(point, group, noise, to);
}

MeasuredPoints points_of(const GivenPoints& points_m, const GivenPoints& origins_m,
                         const GivenNumbers& range_sd_m, const std::optional<GivenNumbers>& groups,
                         const PointNoise& noise) {
  points_m.check("fuse_points: points_m");
  origins_m.check("fuse_points: origins_m");
  range_sd_m.check("fuse_points: range_sd_m");
  if (groups) groups->check("fuse_points: groups");
  const std::size_t count = points_m.rows();
  if (origins_m.rows() != count || range_sd_m.rows() != count ||
      (groups && groups->rows() != count))
    throw Error(
        "fuse_points: there are {} points, {} origins, {} values of range_sd_m{}; these "
        "numbers must be equal",
        count, origins_m.rows(), range_sd_m.rows(),
        groups ? fmt::format(" and {} groups", groups->rows()) : "");
  MeasuredPoints points;
  for (std::size_t i = 0; i < count; ++i) {
    const double group = groups ? (*groups)(i) : 0;
    if (!(0 <= group && group < std::ldexp(1, 31)) || group != std::floor(group))
      throw Error("fuse_points: the group of point {}, {}, must be a whole number from 0", i,
                  group);
    add_point({{points_m(i, 0), points_m(i, 1), points_m(i, 2)},
               {origins_m(i, 0), origins_m(i, 1), origins_m(i, 2)},
               range_sd_m(i)},
              static_cast<std::uint32_t>(group), noise, points);
  }
  return points;
}

MeasuredPoints points_of(const std::vector<const Sweep*>& scans, std::optional<double> range_sd_m,
                         const PointNoise& noise) {
  MeasuredPoints points;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    const PlacedReturns returns = placed_returns(*scans[k], range_sd_m);
    for (std::size_t i = 0; i < returns.points_m.size(); ++i)
      add_point({returns.points_m[i], returns.origins_m[i], returns.sd_m[i]},
                static_cast<std::uint32_t>(k), noise, points);
  }
  return points;
}

// ----- fusion

using GivenArea = std::optional<std::array<double, 4>>;

// Returns the grid of cells that covers the area, or by default all points.
GridFrame frame_of(const MeasuredPoints& points, double cell_m, const GivenArea& area_m) {
  if (area_m)
    return frame_over({{(*area_m)[0], (*area_m)[1]}, {(*area_m)[2], (*area_m)[3]}}, cell_m);
  Area area{glm::dvec2(std::numeric_limits<double>::infinity()),
            glm::dvec2(-std::numeric_limits<double>::infinity())};
  for (const glm::dvec3& p_m : points.p_m) {
    if (!std::isfinite(p_m.x) || !std::isfinite(p_m.y)) continue;
    area = {glm::min(area.low_m, glm::dvec2(p_m)), glm::max(area.high_m, glm::dvec2(p_m))};
  }
  if (!(area.low_m.x <= area.high_m.x)) throw Error("fuse: no point has finite coordinates");
  constexpr double share_of_cell = 1e-6;  // the area excludes its upper sides
  area.low_m -= cell_m * share_of_cell;
  area.high_m += cell_m * share_of_cell;
  return frame_over(area, cell_m);
}

FusedDem fused(MeasuredPoints points, double cell_m, const GivenArea& area_m, double most_sd_m,
               double outlier_share, const StopRequest& stop) {
  const GridFrame frame = frame_of(points, cell_m, area_m);
  Fusion fusion = fuse(single_block(std::move(points)), frame,
                       {.outlier_share = outlier_share, .most_sd_m = most_sd_m},
                       {.progress = [&](double /*share*/) { stop.obey(); }});
  return {std::move(fusion.layers), fusion.counts};
}

template <typename T>
AnyArray layer(nb::handle_t<FusedDem> self, const std::vector<T> DemLayers::*column) {
  const DemLayers& layers = nb::cast<const FusedDem&>(self).layers;
  const glm::uvec2 samples(layers.frame.samples);
  if constexpr (std::is_enum_v<T>) {
    static_assert(sizeof(T) == 1);
    return view(reinterpret_cast<const std::uint8_t*>((layers.*column).data()),
                {samples.y, samples.x}, self);
  } else {
    return view((layers.*column).data(), {samples.y, samples.x}, self);
  }
}

template <typename T>
void add_layer(nb::class_<FusedDem>& type, const char* name, std::vector<T> DemLayers::*column,
               const char* doc) {
  type.def_prop_ro(
      name, [column](nb::handle_t<FusedDem> self) { return layer<T>(self, column); }, doc);
}

void bind_fused(nb::module_& module) {
  nb::class_<FusedDem> type(module, "FusedDem",
                            R"(A DEM with the variance and source of each height.

Layers are rasters, rows x columns, the northernmost row first: read-only views.
Sample (row, column) is at first_sample_m + (column, row) * step_m in the frame D.)");
  add_pickling(type, "fused_dem",
               [](nb::handle self) { return state_of(nb::handle_t<FusedDem>(self)); });
  module.def("restore_fused_dem", &restored_dem, "state"_a);
  add_layer(type, "elevation_m", &DemLayers::elevation_m,
            "Heights of the ground; NaN where unknown.");
  add_layer(type, "variance_m2", &DemLayers::variance_m2,
            "Variances of measured heights; NaN elsewhere.");
  add_layer(type, "lidar_points", &DemLayers::lidar, "Number of points that determine the height.");
  add_layer(type, "chi2", &DemLayers::chi2, "Chi-squared of the fit per degree of freedom.");
  add_layer(type, "surfaces", &DemLayers::surfaces, "Number of surfaces above each other.");
  add_layer(type, "overhang_m", &DemLayers::overhang_m,
            "Height of the lowest surface above the ground.");
  add_layer(type, "clearance_m", &DemLayers::clearance_m, "Free height below the overhang.");
  add_layer(type, "distance_to_data_m", &DemLayers::to_data_m,
            "Distance to the nearest measured sample.");
  add_layer(type, "source", &DemLayers::source, "Source of the height: 0 none, 1 lidar.");
  type.def_prop_ro(
          "first_sample_m",
          [](const FusedDem& dem) {
            return std::array<double, 2>{dem.layers.frame.origin_m.x, dem.layers.frame.origin_m.y};
          },
          "Position of sample (0, 0) in D.")
      .def_prop_ro(
          "step_m",
          [](const FusedDem& dem) {
            return std::array<double, 2>{dem.layers.frame.step_m.x, dem.layers.frame.step_m.y};
          },
          "Spacing of columns and of rows; negative southwards.")
      .def_prop_ro(
          "counts",
          [](const FusedDem& dem) {
            nb::dict all;
            all["points"] = dem.counts.points;
            all["outside"] = dem.counts.outside;
            all["unusable"] = dem.counts.unusable;
            all["without_ground"] = dem.counts.without_ground;
            all["uncertain"] = dem.counts.uncertain;
            return all;
          },
          nb::sig("def counts(self) -> dict[str, int]"),
          "Numbers of points, of those outside or unusable, and of cells without_ground or "
          "uncertain.")
      .def("__repr__", [](const FusedDem& dem) {
        return fmt::format("<FusedDem: {} x {} samples of {} m>", dem.layers.frame.samples.x,
                           dem.layers.frame.samples.y, std::abs(dem.layers.frame.step_m.x));
      });
}

constexpr double unlimited = std::numeric_limits<double>::infinity();

constexpr const char* fuse_doc = R"(Fuses scans to a DEM with the variances of its heights.

  scans            scans of Lidar.scan; points as reported, at the sensor's poses
  cell_m           side of the DEM's cells, whose borders are at multiples of it in D
  area_m           limits of the DEM in D: west, south, east, north; by default those of all points
  range_sd_m       standard deviation of ranges; by default that of scan and sensor
  divergence_rad   divergence of beams, full angle between the 1/e^2 points
  position_sd_m, attitude_sd_rad  standard deviations of each scan's pose, along and about each axis
  most_sd_m        samples whose height has a larger standard deviation stay unmeasured
  outlier_share    expected fraction of outliers, 0 to 0.5

The result does not depend on the number of threads. Raises groundray.Error naming every fault.)";

void bind_fusion(nb::module_& module) {
  module.def(
      "fuse_dem",
      [](const std::vector<const Sweep*>& scans, double cell_m, const GivenArea& area_m,
         std::optional<double> range_sd_m, double divergence_rad, double position_sd_m,
         double attitude_sd_rad, double most_sd_m, double outlier_share) {
        check_scans("fuse_dem", scans);
        const PointNoise noise =
            checked_noise("fuse_dem", divergence_rad, position_sd_m, attitude_sd_rad);
        return without_gil([&](const StopRequest& stop) {
          return fused(points_of(scans, range_sd_m, noise), cell_m, area_m, most_sd_m,
                       outlier_share, stop);
        });
      },
      "scans"_a, nb::kw_only(), "cell_m"_a, "area_m"_a = nb::none(), "range_sd_m"_a = nb::none(),
      "divergence_rad"_a = 0.0, "position_sd_m"_a = 0.0, "attitude_sd_rad"_a = 0.0,
      "most_sd_m"_a = unlimited, "outlier_share"_a = 0.02, fuse_doc);
  module.def(
      "fuse_points",
      [](const GivenPoints& points_m, const GivenPoints& origins_m, const GivenNumbers& range_sd_m,
         double cell_m, const std::optional<GivenNumbers>& groups, const GivenArea& area_m,
         double divergence_rad, double position_sd_m, double attitude_sd_rad, double most_sd_m,
         double outlier_share) {
        const PointNoise noise =
            checked_noise("fuse_points", divergence_rad, position_sd_m, attitude_sd_rad);
        return without_gil([&](const StopRequest& stop) {
          return fused(points_of(points_m, origins_m, range_sd_m, groups, noise), cell_m, area_m,
                       most_sd_m, outlier_share, stop);
        });
      },
      "points_m"_a, "origins_m"_a, "range_sd_m"_a, nb::kw_only(), "cell_m"_a,
      "groups"_a = nb::none(), "area_m"_a = nb::none(), "divergence_rad"_a = 0.0,
      "position_sd_m"_a = 0.0, "attitude_sd_rad"_a = 0.0, "most_sd_m"_a = unlimited,
      "outlier_share"_a = 0.02,
      R"(Like fuse_dem, for points of any origin.

  points_m    n x 3, in the frame D    origins_m  n x 3, origins of the beams
  range_sd_m  n                        groups     n numbers of scans; by default all are equal)");
}

// ----- smoothing and filling

GridFrame frame_of(const GivenRaster& heights_m, double cell_m) {
  constexpr std::size_t most = std::numeric_limits<int>::max();
  if (!(cell_m > 0) || !std::isfinite(cell_m)) throw Error("cell_m = {} must be positive", cell_m);
  if (heights_m.rows() > most || heights_m.columns() > most)
    throw Error("heights_m has {} x {} samples; at most 2^31 - 1 are permitted each way",
                heights_m.rows(), heights_m.columns());
  return {{static_cast<int>(heights_m.columns()), static_cast<int>(heights_m.rows())},
          {0, 0},
          {cell_m, -cell_m},
          {1 / cell_m, -1 / cell_m}};
}

std::span<const float> values_of(const GivenRaster& raster) {
  return {raster.data(), raster.size()};
}

void check_alike(const char* call, const GivenRaster& heights_m, const char* name,
                 const GivenRaster& other) {
  heights_m.check(fmt::format("{}: heights_m", call));
  other.check(fmt::format("{}: {}", call, name));
  if (other.rows() != heights_m.rows() || other.columns() != heights_m.columns())
    throw Error("{}: {} has {} x {} samples, but heights_m has {} x {}; they must be equal", call,
                name, other.rows(), other.columns(), heights_m.rows(), heights_m.columns());
}

AnyArray smoothed(const GivenRaster& heights_m, const GivenRaster& variance_m2, double cell_m,
                  std::optional<double> curvature_sd_per_m) {
  check_alike("smooth_dem", heights_m, "variance_m2", variance_m2);
  SmoothHeights result = without_gil([&](const StopRequest& stop) {
    return smooth_dem(frame_of(heights_m, cell_m), values_of(heights_m), values_of(variance_m2),
                      {.curvature_sd_per_m = curvature_sd_per_m},
                      {.progress = [&](double /*share*/) { stop.obey(); }});
  });
  return array_of(std::move(result.heights_m), {heights_m.rows(), heights_m.columns()});
}

nb::dict filled_dem(const GivenRaster& heights_m, double cell_m, const std::string& reach,
                    std::optional<double> farthest_m, double largest_share,
                    const std::optional<GivenRaster>& most_m) {
  check_alike("fill_dem", heights_m, "most_m", most_m ? *most_m : heights_m);
  const FillOptions options{.reach = chosen<FillReach>("reach", reach,
                                                       {{"enclosed", FillReach::Enclosed},
                                                        {"hull", FillReach::Hull},
                                                        {"everywhere", FillReach::Everywhere}}),
                            .farthest_m = farthest_m,
                            .largest_share = largest_share};
  FilledHeights result = without_gil([&](const StopRequest& stop) {
    return fill_dem(frame_of(heights_m, cell_m), values_of(heights_m),
                    most_m ? values_of(*most_m) : std::span<const float>(), options,
                    {.progress = [&](double /*share*/) { stop.obey(); }});
  });
  const Shape shape{heights_m.rows(), heights_m.columns()};
  nb::dict all;
  all["heights_m"] = array_of(std::move(result.heights_m), shape);
  all["sd_m"] = array_of(std::move(result.sd_m), shape);
  all["distance_to_data_m"] = array_of(std::move(result.to_data_m), shape);
  all["filled"] = result.filled;
  all["holes"] = result.holes.size();
  return all;
}

}  // namespace

void bind_dem(nb::module_& module) {
  bind_fused(module);
  bind_fusion(module);
  module.def("smooth_dem", &smoothed, "heights_m"_a, "variance_m2"_a, nb::kw_only(), "cell_m"_a,
             "curvature_sd_per_m"_a = nb::none(),
             R"(Smooths measured heights according to their noise; edges are kept.

  heights_m           rows x columns, metres; NaN where unknown
  variance_m2         variance of each height; NaN where it was not measured
  curvature_sd_per_m  standard deviation of the true ground's second derivatives; by default
                      estimated from the heights

Returns heights of the same shape, NaN where nothing was measured.)");
  module.def("fill_dem", &filled_dem, "heights_m"_a, nb::kw_only(), "cell_m"_a,
             "reach"_a = "enclosed", "farthest_m"_a = nb::none(), "largest_share"_a = 0.2,
             "most_m"_a = nb::none(),
             nb::sig("def fill_dem(heights_m: numpy.typing.ArrayLike, *, cell_m: float, "
                     "reach: str = 'enclosed', farthest_m: float | None = None, "
                     "largest_share: float = 0.2, most_m: numpy.typing.ArrayLike | None = None)"
                     " -> dict[str, typing.Any]"),
             R"(Fills blank areas of a DEM, with standard deviations of the filled heights.

  heights_m      rows x columns, metres; NaN where unknown
  reach          area to fill: "enclosed" holes, the "hull" of measured samples, or "everywhere"
  farthest_m     a hole stays if part of it is farther from data; 50 cells by default
  largest_share  fraction of the raster's samples; a larger hole stays
  most_m         upper bounds of heights from lines of sight, rows x columns; NaN for none

Returns heights_m (measured ones unchanged), sd_m of filled heights, distance_to_data_m, and the
numbers of filled samples and of holes.)");
}

}  // namespace groundray::python
