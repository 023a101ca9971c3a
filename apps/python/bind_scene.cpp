#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/dataset/write/run_text.h"
#include "apps/python/binding/bind.h"
#include "apps/python/binding/long_call.h"
#include "apps/python/binding/numpy_argument.h"
#include "apps/python/binding/pickle.h"
#include "apps/python/binding/points.h"
#include "apps/python/cast.h"
#include "apps/python/scene_state.h"
#include "apps/scene/edited_simulation.h"
#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/simulation.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"
#include "terrain/terrain_scene.h"

namespace groundray::python {
namespace {

using nb::literals::operator""_a;
using SharedScene = std::shared_ptr<SceneState>;

SharedScene build(SceneSpec spec, SceneSource source, std::optional<std::uint64_t> seed,
                  const StopRequest& stop) {
  if (seed) spec.seed = {*seed};
  use_given(source, spec);
  auto folder = use_terrain(source, spec);
  Simulation simulation = build_simulation(std::move(spec), [&](double /*share*/) { stop.obey(); });
  if (simulation.terrain.whole() != nullptr) folder.reset();
  return std::make_shared<SceneState>(std::move(source), std::move(folder), std::move(simulation),
                                      std::make_shared<GroundTracers>());
}

SharedScene open_scene(const std::filesystem::path& path, std::optional<std::uint64_t> seed,
                       std::optional<std::uint32_t> world) {
  if (seed && world) {
    throw nb::value_error(
        "load_scene: give seed or world, not both: the seed of a world follows from its number");
  }
  return without_gil([&](const StopRequest& stop) {
    SceneSource source{.path = std::filesystem::absolute(path)};
    return build(load_scene(path, data_folder() / "sensors", world), std::move(source), seed, stop);
  });
}

SharedScene parse(const std::string& text, SceneSource source, std::optional<std::uint64_t> seed) {
  return without_gil([&](const StopRequest& stop) {
    SceneSpec spec = parse_scene(text, source.path, data_folder() / "sensors");
    return build(std::move(spec), std::move(source), seed, stop);
  });
}

// Returns a terrain of its own that shares the heights of one that Python owns.
std::shared_ptr<TerrainModel> shared_heights(const std::shared_ptr<TerrainModel>& terrain) {
  return terrain ? std::make_shared<TerrainModel>(terrain->dem()) : nullptr;
}

SharedScene parse_given(const std::string& text, const std::filesystem::path& path,
                        std::optional<std::uint64_t> seed,
                        const std::shared_ptr<TerrainModel>& terrain,
                        std::map<std::string, Mesh> meshes,
                        std::map<std::string, std::string> trajectories) {
  return parse(text,
               {std::filesystem::absolute(path), shared_heights(terrain), std::move(meshes),
                std::move(trajectories)},
               seed);
}

// Returns a scene file's value as dicts, lists and texts; plain scalars as groundray._scene.Plain.
nb::object tree_of(const yaml::Node& node) {
  switch (node.kind) {
    case yaml::Node::Kind::Null:
      return nb::none();
    case yaml::Node::Kind::Plain:
      return nb::module_::import_("groundray._scene").attr("Plain")(node.text);
    case yaml::Node::Kind::Quoted:
      return nb::cast(node.text);
    case yaml::Node::Kind::List: {
      nb::list items;
      for (const yaml::Node& item : node.items) items.append(tree_of(item));
      return items;
    }
    case yaml::Node::Kind::Map:
      break;
  }
  nb::dict entries;
  for (std::size_t i = 0; i + 1 < node.items.size(); i += 2)
    entries[nb::cast(node.items[i].text)] = tree_of(node.items[i + 1]);
  return entries;
}

SharedScene edited(const SharedScene& scene, const nb::kwargs& changes) {
  const auto& [source, folder, base, frames] = *scene;
  const nb::object edited_text = nb::module_::import_("groundray._scene").attr("edited_text");
  const nb::object tree = tree_of(yaml::parse(base.spec.text, source.path));
  const auto text = nb::cast<std::string>(edited_text(tree, base.spec.seed.value, changes));
  return without_gil([&](const StopRequest&) {
    SceneSpec spec = parse_scene(text, source.path, data_folder() / "sensors");
    use_given(source, spec);
    spec.terrain = base.spec.terrain;
    return std::make_shared<SceneState>(source, folder, edited_simulation(std::move(spec), base),
                                        frames.tracers());
  });
}

constexpr const char* edited_doc =
    R"(Returns a scene with changes, without rebuilding what does not depend on them.

  seed            whole number
  weather         dict: replaces the keys of `weather`; {} for a vacuum
  sky             dict: replaces `sky`
  sun             dict: replaces `sun` of `sky`
  mounts          dict from names of lidars and cameras to dicts: replaces their `mount`
  density_per_m2  dict from names of layers of `scatter` to numbers

Keys and rules are those of a scene file (docs/reference/scene.md); frames are those of a scene file
with these changes. Terrain is shared with this scene: its DEM is not read again, and the ground is
not built again for tracing where both scenes trace it as a whole. Objects are shared unless
scattered ones move, because of the density or the seed.
Raises groundray.Error for other changes and as load_scene does.)";

template <typename Placed>
std::vector<std::string> sensor_names(const std::vector<Placed>& sensors) {
  std::vector<std::string> names;
  for (const Placed& sensor : sensors) names.push_back(sensor.spec.name);
  return names;
}

template <typename Placed>
std::size_t find_sensor(const std::vector<Placed>& sensors, const std::string& name,
                        const char* kind) {
  const std::vector<std::string> names = sensor_names(sensors);
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  if (names.empty()) throw Error("the scene has no {} '{}'; it has none", kind, name);
  throw Error("the scene has no {} '{}'; it has {}", kind, name, fmt::join(names, ", "));
}

// ----- rays

// Returns the scene that rays from a box see, as sensors there would.
std::shared_ptr<const Scene> scene_for(SceneState& state, const SensorBox& box) {
  const Simulation& simulation = state.simulation;
  const glm::dvec3 middle = (box.low_m + box.high_m) / 2.0;
  if (simulation.terrain.whole() != nullptr) {
    const Trajectory here({{.pose = {.translation_m = middle}}});
    return state.frames.of({&here, here.begin_time(), here.end_time()});
  }
  const double reach_m = glm::distance(glm::dvec2(box.low_m), glm::dvec2(box.high_m)) / 2;
  RayTracer rays =
      build_tracer(simulation.terrain.clipmap(box, std::max(reach_m, simulation.reach_m)),
                   float_frame_origin(middle), simulation.spec.tracing);
  return std::make_shared<const Scene>(scene_on(std::move(rays), simulation));
}

Points cast_in_scene(SceneState& state, const GivenPoints& origins_m, const GivenPoints& directions,
                     double t_s, bool error_bound) {
  const auto time = nanoseconds_of(t_s);
  if (time < std::chrono::nanoseconds(0) || time > run_time(state.simulation.spec))
    throw Error("cast_rays: t_s = {} must be within the scene's time, 0 to {} s", t_s,
                state.simulation.spec.duration_s);
  const GivenRays rays(origins_m, directions, time);
  return without_gil([&](const StopRequest& stop) {
    rays.check();
    const auto scene = scene_for(state, rays.box());
    return Points{cast_rays(*scene, rays, error_bound ? ErrorBounds::Report : ErrorBounds::Omit,
                            [&] { stop.obey(); })};
  });
}

AnyArray ground_heights(const SceneState& state, const GivenPlaces& places_m) {
  places_m.check("heights_at: places_m");
  return array_of(without_gil([&](const StopRequest&) {
    const Ground& ground = state.simulation.terrain.ground();
    std::vector<double> heights_m(places_m.rows());
    for (std::size_t i = 0; i < heights_m.size(); ++i) {
      heights_m[i] = ground.height_m_at({places_m(i, 0), places_m(i, 1)})
                         .value_or(std::numeric_limits<double>::quiet_NaN());
    }
    return heights_m;
  }));
}

nb::list groups_of(const SceneState& state) {
  nb::list all;
  for (const SceneObjects::Group& group : state.simulation.scene_objects.groups) {
    nb::dict one;
    one["name"] = group.name;
    one["label"] = group.label;
    one["first"] = group.first;
    one["count"] = group.count;
    all.append(one);
  }
  return all;
}

// ----- pickling

nb::list scene_state(nb::handle self) {
  const auto& scene = nb::cast<const SceneState&>(self);
  nb::list inputs;
  for (const auto& [name, fingerprint] : run_inputs(scene.simulation))
    inputs.append(nb::make_tuple(name, fingerprint));
  nb::list state;
  state.append(GROUNDRAY_VERSION);
  state.append(scene.simulation.spec.text);
  state.append(std::filesystem::absolute(scene.source.path).string());
  state.append(scene.simulation.spec.seed.value);
  state.append(scene.source.terrain);
  state.append(scene.source.meshes);
  state.append(scene.source.trajectories);
  state.append(inputs);
  return state;
}

// Checks that the files which a pickled scene names are what they were.
void check_inputs(const std::string& path, const Simulation& simulation,
                  const std::vector<std::pair<std::string, std::uint64_t>>& pickled,
                  bool has_terrain) {
  const std::vector<RunInput> inputs = run_inputs(simulation);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (i == 0 && has_terrain) continue;  // heights are in the pickle, and no file's
    if (i < pickled.size() && pickled[i].second == inputs[i].fingerprint) continue;
    throw Error(
        "{}: the pickled scene cannot be restored: its {} has changed since, as a file that the "
        "scene names is another; bring that file back, or load the scene anew and pickle that",
        path, inputs[i].name);
  }
}

SharedScene restored_scene(const nb::tuple& values) {
  constexpr std::size_t count = 8;
  PickledState state("Scene", values, count);
  const auto version = state.next<std::string>("version");
  if (version != GROUNDRAY_VERSION)
    throw Error("the scene was pickled by groundray {}, but this is {}: use the same for both",
                version, GROUNDRAY_VERSION);
  const auto text = state.next<std::string>("text");
  const auto path = state.next<std::string>("path");
  const auto seed = state.next<std::uint64_t>("seed");
  SceneSource source{
      .path = path,
      .terrain = shared_heights(state.next<std::shared_ptr<TerrainModel>>("terrain")),
      .meshes = state.next<std::map<std::string, Mesh>>("meshes"),
      .trajectories = state.next<std::map<std::string, std::string>>("trajectories")};
  const bool has_terrain = source.terrain != nullptr;
  const auto inputs = state.next<std::vector<std::pair<std::string, std::uint64_t>>>("inputs");
  SharedScene scene = parse(text, std::move(source), seed);
  without_gil([&](const StopRequest&) {
    check_inputs(path, scene->simulation, inputs, has_terrain);
    return true;
  });
  return scene;
}

constexpr const char* cast_doc =
    R"(Casts rays through the scene on all cores and returns the first hit of each.

  origins_m    n x 3, metres in the frame D
  directions   n x 3, axes of D, of any length except zero
  t_s          time in seconds of the scene's time, for the poses of moving objects
  error_bound  adds a bound of each range's difference from that on the reference surface

The result has a row for each ray: range_true_m along it (infinite without a hit), world_x_m,
world_y_m, world_z_m (in D), nx, ny, nz, incidence_rad, error_estimate_m (NaN without a hit), label,
instance (0 for the ground) and error_bound_m if requested. The ground is hit from above only.
Raises groundray.Error for invalid rays.)";

}  // namespace

void bind_scene(nb::module_& module) {
  nb::class_<SceneState> type(module, "Scene", nb::is_weak_referenceable(),
                              R"(A scene and everything that its file names, ready to run.

See load_scene and scene. Immutable: any number of threads may use one. Copies are the scene
itself. Pickles hold the text of its file, its seed and what it has in memory, and load its files
again: if one has changed, that is a groundray.Error.)");
  add_pickling(type, "scene", &scene_state);
  module.def("restore_scene", &restored_scene, "state"_a);
  type.def_prop_ro(
          "lidars", [](const SceneState& scene) { return sensor_names(scene.simulation.lidars); },
          "Names, in the order of the file.")
      .def_prop_ro(
          "cameras", [](const SceneState& scene) { return sensor_names(scene.simulation.cameras); },
          "Names, in the order of the file.")
      .def(
          "lidar",
          [](const SharedScene& scene, const std::string& name) {
            return SceneLidar{scene, find_sensor(scene->simulation.lidars, name, "lidar")};
          },
          "name"_a, "The lidar of this name. Raises groundray.Error if there is none.")
      .def(
          "camera",
          [](const SharedScene& scene, const std::string& name) {
            return SceneCamera{scene, find_sensor(scene->simulation.cameras, name, "camera")};
          },
          "name"_a, "The camera of this name. Raises groundray.Error if there is none.")
      .def_prop_ro("duration_s",
                   [](const SceneState& scene) { return scene.simulation.spec.duration_s; })
      .def_prop_ro("seed", [](const SceneState& scene) { return scene.simulation.spec.seed.value; })
      .def_prop_ro(
          "origin_w_m",
          [](const SceneState& scene) {
            const glm::dvec3 p = scene.simulation.terrain.header().origin_w_m;
            return std::array<double, 3>{p.x, p.y, p.z};
          },
          "Origin of the frame D in W, the coordinates of the DEM: add it to positions in D.")
      .def_prop_ro(
          "crs", [](const SceneState& scene) { return scene.simulation.terrain.header().crs_name; },
          "Name of W's coordinate reference system.")
      .def_prop_ro("objects", &groups_of,
                   nb::sig("def objects(self) -> list[dict[str, typing.Any]]"),
                   "Groups of objects: name, label, first instance and count.")
      .def("edited", &edited, "changes"_a,
           nb::sig("def edited(self, *, seed: int = ..., "
                   "weather: collections.abc.Mapping[str, typing.Any] = ..., "
                   "sky: collections.abc.Mapping[str, typing.Any] = ..., "
                   "sun: collections.abc.Mapping[str, typing.Any] = ..., "
                   "mounts: collections.abc.Mapping[str, "
                   "collections.abc.Mapping[str, typing.Any]] = ..., "
                   "density_per_m2: collections.abc.Mapping[str, float] = ...) -> Scene"),
           edited_doc)
      .def_prop_ro(
          "grounds_built", [](const SceneState& scene) { return scene.frames.tracers()->built(); },
          "Number of times that the ground was built for tracing, by this scene and all that it "
          "was edited from or into. Ground that is served by tiles is not counted.")
      .def("heights_at", &ground_heights, "places_m"_a,
           R"(Heights of the ground's reference surface, n metres, in doubles.

  places_m  n x 2, x and y in the frame D

NaN outside of the DEM and in its holes. Objects are ignored.)")
      .def("cast_rays", &cast_in_scene, "origins_m"_a, "directions"_a, "t_s"_a = 0.0, nb::kw_only(),
           "error_bound"_a = false, cast_doc)
      .def("__repr__", [](const SceneState& scene) {
        return fmt::format("<Scene of {} s: lidars [{}], cameras [{}]>",
                           scene.simulation.spec.duration_s,
                           fmt::join(sensor_names(scene.simulation.lidars), ", "),
                           fmt::join(sensor_names(scene.simulation.cameras), ", "));
      });
  module.def("load_scene", &open_scene, "path"_a, "seed"_a = nb::none(), nb::kw_only(),
             "world"_a = nb::none(),
             R"(Loads a scene file (docs/reference/scene.md) and everything it names.

`seed` replaces the scene's own. `world` is the number of one of the scene's worlds
(docs/reference/sampling.md), whose values are drawn. Ctrl-C stops the certification of a large DEM.
Raises groundray.Error, with a line for each fault: file, line, key, rule and likely fix.)");
  module.def("data_folder", &data_folder, "Returns the folder with groundray's own data.");
  module.def("parse_scene", &parse_given, "text"_a, "path"_a, "seed"_a = nb::none(),
             "terrain"_a = nb::none(), "meshes"_a = std::map<std::string, Mesh>(),
             "trajectories"_a = std::map<std::string, std::string>(),
             R"(Like load_scene, for the text of a scene file.

`path` names the file in messages; files that the text names are relative to its folder. `terrain`
replaces the DEM that it names, `meshes` models and `trajectories`, in TUM format, those of these
names.)");
}

}  // namespace groundray::python
