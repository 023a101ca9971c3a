#include <fmt/format.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "apps/python/binding/arrays.h"
#include "apps/python/binding/bind.h"
#include "apps/python/binding/long_call.h"
#include "apps/python/binding/mesh.h"
#include "apps/python/binding/numpy_argument.h"
#include "apps/python/binding/pickle.h"
#include "core/error.h"
#include "core/geometry/mesh.h"
#include "reconstruction/mesh/measured_mesh_io.h"

namespace groundray::python {
namespace {

using nb::literals::operator""_a;

/// Rule for the values of a column: from 0 to `most`.
struct ColumnRule {
  const char* name;
  double most;
  const char* says;
};

constexpr ColumnRule sd_rule{"sd_m", std::numeric_limits<float>::max(), "0 or more, and finite"};
constexpr ColumnRule label_rule{"labels", std::numeric_limits<std::uint16_t>::max(),
                                "a whole number from 0 to 65535"};
constexpr ColumnRule confidence_rule{"confidence", 1, "from 0 to 1"};

template <typename T>
std::vector<T> column_values(const ColumnRule& rule, const std::optional<GivenNumbers>& given,
                             std::size_t vertices, Violations& broken) {
  std::vector<T> values;
  if (!given) return values;
  given->check(fmt::format("Mesh: {}", rule.name));
  broken.unless(given->rows() == vertices,
                "there are {} vertices, but {} values of {}; there must be one for each", vertices,
                given->rows(), rule.name);
  for (std::size_t i = 0; i < given->rows(); ++i) {
    const double value = (*given)(i);
    const bool is_sound =
        value >= 0 && value <= rule.most && (!std::is_integral_v<T> || value == std::floor(value));
    broken.unless(is_sound, "{} of vertex {}, {}, must be {}", rule.name, i, value, rule.says);
    if (!is_sound) break;  // reports only the column's first fault
    values.push_back(static_cast<T>(value));
  }
  return values;
}

std::vector<glm::uvec3> triangles_of(const GivenIndices& given, std::size_t vertices,
                                     Violations& broken) {
  std::vector<glm::uvec3> triangles(given.rows());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const std::int64_t vertex = given(i, static_cast<std::size_t>(k));
      if (vertex < 0 || vertex >= static_cast<std::int64_t>(vertices)) {
        broken.unless(false, "triangle {} names vertex {}, but vertices are numbered from 0 to {}",
                      i, vertex, static_cast<std::int64_t>(vertices) - 1);
        return triangles;
      }
      triangles[i][k] = static_cast<std::uint32_t>(vertex);
    }
  }
  return triangles;
}

Mesh given_mesh(const GivenPoints& vertices_m, const GivenIndices& triangles,
                const std::optional<GivenNumbers>& sd_m, const std::optional<GivenNumbers>& labels,
                const std::optional<GivenNumbers>& confidence,
                const std::array<double, 3>& origin_w_m) {
  vertices_m.check("Mesh: vertices_m");
  triangles.check("Mesh: triangles");
  const std::size_t count = vertices_m.rows();
  Violations broken("mesh");
  Mesh mesh;
  for (std::size_t i = 0; i < count; ++i)
    mesh.measured.shape.vertices_m.emplace_back(vertices_m(i, 0), vertices_m(i, 1),
                                                vertices_m(i, 2));
  mesh.measured.shape.triangles = triangles_of(triangles, count, broken);
  mesh.measured.sd_m = column_values<float>(sd_rule, sd_m, count, broken);
  mesh.measured.labels = column_values<std::uint16_t>(label_rule, labels, count, broken);
  mesh.measured.confidence = column_values<float>(confidence_rule, confidence, count, broken);
  mesh.georeference.origin_w_m = {origin_w_m[0], origin_w_m[1], origin_w_m[2]};
  broken.unless(std::ranges::all_of(origin_w_m, [](double x) { return std::isfinite(x); }),
                "origin_w_m = ({}, {}, {}) must be finite", origin_w_m[0], origin_w_m[1],
                origin_w_m[2]);
  broken.throw_if_any();
  check_mesh(mesh.measured.shape, "mesh", EmptyMesh::Allow);
  return mesh;
}

// Returns a view of a property of the vertices, or None if it is unknown.
template <typename T>
std::optional<AnyArray> known(nb::handle_t<Mesh> self, const std::vector<T> MeasuredMesh::*column) {
  const std::vector<T>& values = nb::cast<const Mesh&>(self).measured.*column;
  if (values.empty()) return std::nullopt;
  return view(values.data(), {values.size()}, self);
}

// ----- pickling

template <typename T>
AnyArray all_of(const std::vector<T>& values, nb::handle owner) {
  return view(values.data(), {values.size()}, owner);
}

nb::list mesh_state(nb::handle self) {
  const auto& [measured, georeference] = nb::cast<const Mesh&>(self);
  nb::list state;
  state.append(view(measured.shape.vertices_m, self));
  state.append(view(measured.shape.triangles, self));
  state.append(all_of(measured.shape.levels, self));
  state.append(all_of(measured.sd_m, self));
  state.append(all_of(measured.labels, self));
  state.append(all_of(measured.confidence, self));
  add_georeference(georeference, state);
  return state;
}

template <typename T>
std::vector<glm::vec<3, T>> next_rows(PickledState& state, const char* name) {
  const std::vector<T> values = state.next_array<T, 2>(name);
  if (values.size() % 3 != 0) state.refuse(name, "must have rows of 3 values");
  std::vector<glm::vec<3, T>> rows;
  for (std::size_t i = 0; i < values.size(); i += 3)
    rows.emplace_back(values[i], values[i + 1], values[i + 2]);
  return rows;
}

template <typename T>
std::vector<T> next_column(PickledState& state, const char* name, std::size_t count) {
  std::vector<T> values = state.next_array<T>(name);
  if (!values.empty() && values.size() != count)
    state.refuse(name,
                 fmt::format("has {} values, but must have {} or none", values.size(), count));
  return values;
}

Mesh restored_mesh(const nb::tuple& values) {
  constexpr std::size_t count = 9;
  PickledState state("Mesh", values, count);
  Mesh mesh;
  auto& [shape, sd_m, labels, confidence] = mesh.measured;
  shape.vertices_m = next_rows<double>(state, "vertices_m");
  shape.triangles = next_rows<std::uint32_t>(state, "triangles");
  shape.levels = state.next_array<std::uint8_t>("levels");
  sd_m = next_column<float>(state, "sd_m", shape.vertices_m.size());
  labels = next_column<std::uint16_t>(state, "labels", shape.vertices_m.size());
  confidence = next_column<float>(state, "confidence", shape.vertices_m.size());
  mesh.georeference = read_georeference(state);
  check_mesh(shape, "the pickled Mesh", EmptyMesh::Allow);
  return mesh;
}

constexpr const char* mesh_doc = R"(A triangle mesh with shared vertices, in the frame D.

  vertices_m  n x 3, metres
  triangles   m x 3, vertex indices, counter-clockwise as seen from outside
  sd_m, labels, confidence  of each vertex: standard deviation along its line of sight (m, finite),
              semantic class (0 to 65535) and confidence (0 to 1, highest at normal incidence), or
              None
  origin_w_m  origin of D in W

Arguments are copied; properties are read-only views.
Raises groundray.Error for an invalid mesh.)";

}  // namespace

void bind_mesh(nb::module_& module) {
  nb::class_<Mesh> type(module, "Mesh", mesh_doc);
  add_pickling(type, "mesh", &mesh_state);
  module.def("restore_mesh", &restored_mesh, "state"_a);
  type.def(
          "__init__",
          [](Mesh* place, const GivenPoints& vertices_m, const GivenIndices& triangles,
             const std::optional<GivenNumbers>& sd_m, const std::optional<GivenNumbers>& labels,
             const std::optional<GivenNumbers>& confidence,
             const std::array<double, 3>& origin_w_m) {
            new (place) Mesh(without_gil([&](const StopRequest&) {
              return given_mesh(vertices_m, triangles, sd_m, labels, confidence, origin_w_m);
            }));
          },
          "vertices_m"_a, "triangles"_a, nb::kw_only(), "sd_m"_a = nb::none(),
          "labels"_a = nb::none(), "confidence"_a = nb::none(),
          "origin_w_m"_a = std::array<double, 3>{0, 0, 0})
      .def_prop_ro(
          "vertices_m",
          [](nb::handle_t<Mesh> self) {
            return view(nb::cast<const Mesh&>(self).measured.shape.vertices_m, self);
          },
          "Positions in D, n x 3, metres: a view.")
      .def_prop_ro(
          "triangles",
          [](nb::handle_t<Mesh> self) {
            return view(nb::cast<const Mesh&>(self).measured.shape.triangles, self);
          },
          "Vertex indices, m x 3, counter-clockwise as seen from outside: a view.")
      .def_prop_ro(
          "sd_m", [](nb::handle_t<Mesh> self) { return known(self, &MeasuredMesh::sd_m); },
          "Standard deviation of each vertex along its line of sight, m; or None.")
      .def_prop_ro(
          "labels", [](nb::handle_t<Mesh> self) { return known(self, &MeasuredMesh::labels); },
          "Semantic class of each vertex; or None.")
      .def_prop_ro(
          "confidence",
          [](nb::handle_t<Mesh> self) { return known(self, &MeasuredMesh::confidence); },
          "Confidence of each vertex, 0 to 1, highest at normal incidence; or None.")
      .def_prop_ro(
          "origin_w_m",
          [](const Mesh& mesh) {
            const glm::dvec3 p = mesh.georeference.origin_w_m;
            return std::array<double, 3>{p.x, p.y, p.z};
          },
          "Origin of D in W.")
      .def(
          "save",
          [](const Mesh& mesh, const std::filesystem::path& path) {
            without_gil([&](const StopRequest&) {
              write_measured_mesh(path, mesh.measured, mesh.georeference);
              return true;
            });
          },
          "path"_a,
          "Writes a .ply, .obj, .stl or .glb file, by its extension. It appears only when "
          "complete.")
      .def("__repr__", [](const Mesh& mesh) {
        return fmt::format("<Mesh: {} vertices, {} triangles>",
                           mesh.measured.shape.vertices_m.size(),
                           mesh.measured.shape.triangles.size());
      });
  module.def(
      "load_mesh",
      [](const std::filesystem::path& path) {
        return without_gil([&](const StopRequest&) {
          MeasuredMeshFile file = read_measured_mesh(path);
          return Mesh{std::move(file.mesh), std::move(file.georeference)};
        });
      },
      "path"_a,
      R"(Reads the triangles of a .ply, .obj, .stl, .gltf or .glb file.

Raises groundray.Error if it cannot be read or contains no triangle.)");
}

}  // namespace groundray::python
