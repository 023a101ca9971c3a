#include <nanobind/nanobind.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <filesystem>

#include "apps/python/binding/arrays.h"
#include "apps/python/binding/bind.h"
#include "apps/scene/sampling/world_sampler.h"
#include "apps/scene/yaml_writer.h"

namespace groundray::python {
namespace {

using nb::literals::operator""_a;
using sampling::WorldSampler;

nb::object drawn_values(const WorldSampler& worlds, std::uint32_t world) {
  const yaml::Node scene = worlds.scene_of(world);
  const yaml::Node* const drawn = sampling::find(scene, {"world", "drawn"});
  return nb::module_::import_("yaml").attr("safe_load")(yaml::line_of(*drawn));
}

}  // namespace

void bind_worlds(nb::module_& module) {
  nb::class_<WorldSampler>(module, "Worlds", R"(Worlds of a scene file with a block `worlds`.

Their values are drawn from its distributions (docs/reference/sampling.md): a world depends on the
file and its own number alone. len(worlds) counts them; load_scene(path, world=17) loads one.)")
      .def(
          "__init__",
          [](WorldSampler* self, const std::filesystem::path& path) {
            new (self) WorldSampler(sampling::load_worlds(path));
          },
          "path"_a,
          "Reads the block. Raises groundray.Error with a line for each fault, or if there is "
          "none.")
      .def("__len__", &WorldSampler::count)
      .def_prop_ro("keys", &WorldSampler::keys, "Keys whose values are drawn.")
      .def(
          "seed",
          [](const WorldSampler& worlds, std::uint32_t world) {
            return worlds.seed_of(world).value;
          },
          "world"_a, "Returns the seed of a world.")
      .def("values", &drawn_values, "world"_a,
           "Returns the values drawn for a world, by key. Raises groundray.Error if there is none.")
      .def(
          "scene_text",
          [](const WorldSampler& worlds, std::uint32_t world) {
            return yaml::text_of(worlds.scene_of(world));
          },
          "world"_a,
          R"(Returns the scene file of a world, whose paths begin in the folder of this one.

Raises groundray.Error if there is no such world.)");
}

}  // namespace groundray::python
