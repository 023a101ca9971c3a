#include <fmt/format.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "apps/python/binding/arrays.h"
#include "apps/python/binding/bind.h"
#include "apps/python/binding/enum_from_text.h"
#include "apps/python/binding/long_call.h"
#include "apps/python/binding/mesh.h"
#include "apps/python/binding/numpy_argument.h"
#include "apps/python/binding/pickle.h"
#include "apps/python/binding/points.h"
#include "apps/python/cast.h"
#include "apps/python/terrain_model.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "reconstruction/pipeline/terrain_decimation.h"
#include "terrain/dem/dem_io.h"
#include "terrain/dem/layers_io.h"
#include "terrain/terrain_mesh.h"

namespace groundray::python {
namespace {

using nb::literals::operator""_a;
using Pair = std::array<double, 2>;

// Returns the origin of D in W: the south-west sample's position, rounded down to whole metres.
glm::dvec3 origin_for(const Pair& south_west_w_m) {
  return {std::floor(south_west_w_m[0]), std::floor(south_west_w_m[1]), 0};
}

Dem dem_of(const GivenRaster& heights_m, double cell_m, const Pair& south_west_w_m,
           const std::string& crs_wkt) {
  heights_m.check("Terrain: heights_m");
  constexpr std::size_t most = std::numeric_limits<int>::max();
  Violations broken("Terrain");
  broken.unless(heights_m.rows() <= most && heights_m.columns() <= most,
                "heights_m has {} x {} samples; at most 2^31 - 1 are permitted each way",
                heights_m.rows(), heights_m.columns());
  broken.unless(cell_m > 0 && std::isfinite(cell_m), "cell_m = {} must be positive", cell_m);
  broken.unless(std::isfinite(south_west_w_m[0]) && std::isfinite(south_west_w_m[1]),
                "south_west_w_m = ({}, {}) must be finite", south_west_w_m[0], south_west_w_m[1]);
  broken.throw_if_any();
  const glm::ivec2 size(static_cast<int>(heights_m.columns()), static_cast<int>(heights_m.rows()));
  const glm::dvec3 origin_w_m = origin_for(south_west_w_m);
  const glm::dvec2 north_west(south_west_w_m[0] - origin_w_m.x,
                              south_west_w_m[1] - origin_w_m.y + cell_m * (size.y - 1));
  HeightGrid grid(size, north_west, {cell_m, -cell_m},
                  std::vector<float>(heights_m.data(), heights_m.data() + heights_m.size()));
  const Georeference place{origin_w_m, "", crs_wkt};
  check_crs(place);
  return {std::move(grid), origin_w_m, crs_wkt, crs_wkt.empty() ? "local (no CRS)" : "as given"};
}

using SharedTerrain = std::shared_ptr<TerrainModel>;

SharedTerrain open_terrain(const std::filesystem::path& path, std::optional<double> nodata,
                           const std::string& reproject_to) {
  return without_gil([&](const StopRequest&) {
    return std::make_shared<TerrainModel>(load_dem(path, {nodata, reproject_to}));
  });
}

void save(const TerrainModel& terrain, const std::filesystem::path& path) {
  check_ending(path, {".tif", ".tiff"});
  without_gil([&](const StopRequest&) {
    write_dem(terrain.dem(), path);
    return true;
  });
}

Points cast_on_terrain(const TerrainModel& terrain, const GivenPoints& origins_m,
                       const GivenPoints& directions, bool error_bound,
                       const std::string& tracing) {
  const auto chosen_tracing = chosen<Tracing>("cast_rays: tracing", tracing,
                                              {{"exact", Tracing::Exact}, {"fast", Tracing::Fast}});
  const GivenRays rays(origins_m, directions, {});
  return without_gil([&](const StopRequest& stop) {
    return Points{cast_rays(terrain.scene(chosen_tracing), rays,
                            error_bound ? ErrorBounds::Report : ErrorBounds::Omit,
                            [&] { stop.obey(); })};
  });
}

AnyArray dem_heights(const TerrainModel& terrain, const GivenPlaces& places_m) {
  places_m.check("heights_at: places_m");
  return array_of(without_gil([&](const StopRequest&) {
    const HeightGrid& grid = terrain.dem().grid;
    std::vector<double> heights_m(places_m.rows());
    for (std::size_t i = 0; i < heights_m.size(); ++i) {
      heights_m[i] = grid.height_m_at({places_m(i, 0), places_m(i, 1)})
                         .value_or(std::numeric_limits<double>::quiet_NaN());
    }
    return heights_m;
  }));
}

Mesh terrain_mesh(const TerrainModel& terrain, double max_error_m, bool fewest) {
  return without_gil([&](const StopRequest& stop) {
    const Dem& dem = terrain.dem();
    const RunControl control{.progress = [&](double) { stop.obey(); }};
    TerrainMesh built = fewest ? decimate_terrain(dem.grid, max_error_m, control).mesh
                               : build_terrain_mesh(dem.grid, {.tolerance_m = max_error_m});
    Mesh mesh{.georeference = {dem.origin_w_m, dem.crs_name, dem.crs_wkt}};
    for (const glm::ivec2& sample : built.vertices)
      mesh.measured.shape.vertices_m.emplace_back(dem.grid.frame().to_D(sample),
                                                  dem.grid.height_m(sample.x, sample.y));
    mesh.measured.shape.triangles = std::move(built.triangles);
    mesh.measured.shape.levels = std::move(built.levels);
    return mesh;
  });
}

AnyArray heights_of(nb::handle self) {
  const HeightGrid& grid = nb::cast<const TerrainModel&>(self).dem().grid;
  return view(grid.heights_m().data(),
              {static_cast<std::size_t>(grid.rows()), static_cast<std::size_t>(grid.columns())},
              self);
}

// ----- pickling

nb::list terrain_state(nb::handle self) {
  const Dem& dem = nb::cast<const TerrainModel&>(self).dem();
  const auto [samples, origin_m, step_m, cells_per_m] = dem.grid.frame();
  nb::list state;
  state.append(heights_of(self));
  state.append(nb::make_tuple(samples.x, samples.y));
  state.append(nb::make_tuple(origin_m.x, origin_m.y));
  state.append(nb::make_tuple(step_m.x, step_m.y));
  add_georeference({dem.origin_w_m, dem.crs_name, dem.crs_wkt}, state);
  return state;
}

SharedTerrain restored_terrain(const nb::tuple& values) {
  constexpr std::size_t count = 7;
  PickledState state("Terrain", values, count);
  auto heights_m = state.next_array<float, 2>("heights_m");
  const auto [columns, rows] = state.next<std::array<int, 2>>("samples");
  const auto first_m = state.next<Pair>("origin_m");
  const auto step_m = state.next<Pair>("step_m");
  HeightGrid grid({columns, rows}, {first_m[0], first_m[1]}, {step_m[0], step_m[1]},
                  std::move(heights_m));
  auto [origin_w_m, crs_name, crs_wkt] = read_georeference(state);
  check_crs({origin_w_m, "", crs_wkt});
  return std::make_shared<TerrainModel>(
      Dem{std::move(grid), origin_w_m, std::move(crs_wkt), std::move(crs_name)});
}

constexpr const char* terrain_doc = R"(A DEM in memory: the reference surface that rays hit.

  heights_m       rows x columns, metres, the northernmost row first; NaN where unknown.
                  Heights are kept as float32.
  cell_m          spacing of samples in both directions
  south_west_w_m  position of the first sample of the last row in W
  crs_wkt         W's coordinate reference system as WKT, or empty for local metres

Each cell is two triangles, split from sample (column + 1, row) to (column, row + 1). Positions
are in the frame D: W minus `origin_w_m`, which is south_west_w_m rounded down to whole metres (a
scene of the same DEM has another origin, near its centre).
Immutable: any number of threads may use one. Raises groundray.Error naming every fault.)";

}  // namespace

void bind_terrain(nb::module_& module) {
  nb::class_<TerrainModel> type(module, "Terrain", terrain_doc);
  add_pickling(type, "terrain", &terrain_state);
  module.def("restore_terrain", &restored_terrain, "state"_a);
  type.def(
          "__init__",
          [](TerrainModel* place, const GivenRaster& heights_m, double cell_m,
             const Pair& south_west_w_m, const std::string& crs_wkt) {
            new (place) TerrainModel(without_gil([&](const StopRequest&) {
              return dem_of(heights_m, cell_m, south_west_w_m, crs_wkt);
            }));
          },
          "heights_m"_a, "cell_m"_a = 1.0, "south_west_w_m"_a = Pair{0, 0}, "crs_wkt"_a = "")
      .def_prop_ro(
          "heights_m", [](nb::handle_t<TerrainModel> self) { return heights_of(self); },
          "Heights of the samples, rows x columns, metres, as in the file: a view.")
      .def_prop_ro(
          "first_sample_m",
          [](const TerrainModel& terrain) {
            const glm::dvec2 p = terrain.dem().grid.origin_m();
            return Pair{p.x, p.y};
          },
          "Position of sample (0, 0) in D.")
      .def_prop_ro(
          "step_m",
          [](const TerrainModel& terrain) {
            const glm::dvec2 step_m = terrain.dem().grid.step_m();
            return Pair{step_m.x, step_m.y};
          },
          "Spacing of columns and of rows; negative southwards.")
      .def_prop_ro(
          "origin_w_m",
          [](const TerrainModel& terrain) {
            const glm::dvec3 p = terrain.dem().origin_w_m;
            return std::array<double, 3>{p.x, p.y, p.z};
          },
          "Origin of the frame D in W: add it to positions in D.")
      .def_prop_ro(
          "crs", [](const TerrainModel& terrain) { return terrain.dem().crs_name; },
          "Name of W's coordinate reference system.")
      .def("heights_at", &dem_heights, "places_m"_a,
           R"(Heights of the surface, n metres, in doubles.

  places_m  n x 2, x and y in the frame D

NaN outside of the DEM and in its holes.)")
      .def("cast_rays", &cast_on_terrain, "origins_m"_a, "directions"_a, "error_bound"_a = false,
           nb::kw_only(), "tracing"_a = "exact",
           R"(Casts rays at the surface on all cores, with intersections in double precision.

  origins_m   n x 3, metres in the frame D
  directions  n x 3, axes of D, of any length except zero
  tracing     "exact" decides every ray in double precision; "fast" casts rays of lidars and images
              two to four times as fast, and may decide up to 5e-6 of them, at silhouettes,
              differently

Like Scene.cast_rays, but without objects; the label is 1. The surface is the DEM itself:
error_estimate_m is 0, and error_bound_m, if requested, the accuracy of ranges.)")
      .def("mesh", &terrain_mesh, "max_error_m"_a, "fewest"_a = false,
           R"(Returns a triangle mesh within max_error_m of the surface, vertically.

The bound is certified at samples and between them. There are no T-junctions. 0 simplifies only
flat areas, unless fewest is true: then it must be positive, edges of the full resolution are
collapsed, and far fewer triangles remain where the ground is rough, in some twenty times the
time.)")
      .def("save", &save, "path"_a,
           "Writes a GeoTIFF of float32 heights. It appears only when complete.")
      .def("__repr__", [](const TerrainModel& terrain) {
        const HeightGrid& grid = terrain.dem().grid;
        return fmt::format("<Terrain: {} x {} samples of {} m, {}>", grid.columns(), grid.rows(),
                           std::abs(grid.step_m().x), terrain.dem().crs_name);
      });
  module.def("load_terrain", &open_terrain, "path"_a, "nodata"_a = nb::none(),
             "reproject_to"_a = "",
             R"(Loads a complete DEM: GeoTIFF, HGT, ESRI ASCII and others (docs/reference/trust.md).

  nodata        a stored value that means "no height", in addition to the file's own
  reproject_to  a projected CRS in metres to warp to, such as "EPSG:32631", or "utm"

Raises groundray.Error, with the command that repairs the file if there is one.)");
}

}  // namespace groundray::python
