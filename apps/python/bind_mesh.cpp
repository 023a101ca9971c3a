#include <fmt/format.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

#include "apps/python/arrays.h"
#include "apps/python/bind.h"
#include "apps/python/given.h"
#include "apps/python/long_call.h"
#include "apps/python/mesh.h"
#include "core/error.h"
#include "core/mesh_check.h"
#include "reconstruction/measured_mesh_io.h"

namespace groundray::python {
namespace {

using nb::literals::operator""_a;

template <typename T>
std::vector<T> values_of(const char* name, const std::optional<GivenNumbers>& given,
                         std::size_t vertices) {
  std::vector<T> values;
  if (!given) return values;
  if (given->rows() != vertices)
    throw Error("mesh: there are {} vertices, but {} values of {}; there must be one for each",
                vertices, given->rows(), name);
  for (std::size_t i = 0; i < vertices; ++i) {
    const double value = (*given)(i);
    if constexpr (std::is_integral_v<T>) {
      if (!(0 <= value && value <= std::numeric_limits<T>::max()) ||
          static_cast<double>(static_cast<T>(value)) != value)
        throw Error("mesh: {} of vertex {}, {}, must be a whole number from 0 to {}", name, i,
                    value, std::numeric_limits<T>::max());
    }
    values.push_back(static_cast<T>(value));
  }
  return values;
}

std::vector<glm::uvec3> triangles_of(const GivenIndices& given, std::size_t vertices) {
  std::vector<glm::uvec3> triangles(given.rows());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const std::int64_t vertex = given(i, static_cast<std::size_t>(k));
      if (vertex < 0 || vertex >= static_cast<std::int64_t>(vertices))
        throw Error("mesh: triangle {} names vertex {}, but vertices are numbered from 0 to {}", i,
                    vertex, static_cast<std::int64_t>(vertices) - 1);
      triangles[i][k] = static_cast<std::uint32_t>(vertex);
    }
  }
  return triangles;
}

Mesh mesh_of(const GivenPoints& vertices_m, const GivenIndices& triangles,
             const std::optional<GivenNumbers>& sd_m, const std::optional<GivenNumbers>& labels,
             const std::optional<GivenNumbers>& confidence,
             const std::array<double, 3>& origin_w_m) {
  const std::size_t count = vertices_m.rows();
  Mesh mesh;
  for (std::size_t i = 0; i < count; ++i)
    mesh.measured.shape.vertices_m.emplace_back(vertices_m(i, 0), vertices_m(i, 1),
                                                vertices_m(i, 2));
  mesh.measured.shape.triangles = triangles_of(triangles, count);
  mesh.measured.sd_m = values_of<float>("sd_m", sd_m, count);
  mesh.measured.labels = values_of<std::uint16_t>("labels", labels, count);
  mesh.measured.confidence = values_of<float>("confidence", confidence, count);
  mesh.georeference.origin_w_m = {origin_w_m[0], origin_w_m[1], origin_w_m[2]};
  check_mesh(mesh.measured.shape, "mesh", EmptyMesh::Allow);
  return mesh;
}

// A view of what is known of each vertex, or None.
template <typename T>
std::optional<AnyArray> known(nb::handle_t<Mesh> self, const std::vector<T> MeasuredMesh::*column) {
  const std::vector<T>& values = nb::cast<const Mesh&>(self).measured.*column;
  if (values.empty()) return std::nullopt;
  return view(values.data(), {values.size()}, self);
}

constexpr const char* mesh_doc = R"(Triangles that share vertices, in the frame D.

  vertices_m  n x 3, metres
  triangles   m x 3, numbers of vertices, counter-clockwise as seen from outside
  sd_m, labels, confidence  of each vertex: standard deviation along its line of sight (m),
              semantic class, and 0 to 1 how squarely it was seen; or None
  origin_w_m  where D begins in W

The arrays given are copied; those asked for are views that may not be written to.
Raises groundray.Error for numbers that are no mesh.)";

}  // namespace

void bind_mesh(nb::module_& module) {
  nb::class_<Mesh>(module, "Mesh", mesh_doc)
      .def(
          "__init__",
          [](Mesh* place, const GivenPoints& vertices_m, const GivenIndices& triangles,
             const std::optional<GivenNumbers>& sd_m, const std::optional<GivenNumbers>& labels,
             const std::optional<GivenNumbers>& confidence,
             const std::array<double, 3>& origin_w_m) {
            new (place) Mesh(mesh_of(vertices_m, triangles, sd_m, labels, confidence, origin_w_m));
          },
          "vertices_m"_a, "triangles"_a, nb::kw_only(), "sd_m"_a = nb::none(),
          "labels"_a = nb::none(), "confidence"_a = nb::none(),
          "origin_w_m"_a = std::array<double, 3>{0, 0, 0})
      .def_prop_ro(
          "vertices_m",
          [](nb::handle_t<Mesh> self) {
            return view(nb::cast<const Mesh&>(self).measured.shape.vertices_m, self);
          },
          "Places in D, n x 3, metres: a view.")
      .def_prop_ro(
          "triangles",
          [](nb::handle_t<Mesh> self) {
            return view(nb::cast<const Mesh&>(self).measured.shape.triangles, self);
          },
          "Numbers of vertices, m x 3, counter-clockwise as seen from outside: a view.")
      .def_prop_ro(
          "sd_m", [](nb::handle_t<Mesh> self) { return known(self, &MeasuredMesh::sd_m); },
          "Standard deviation of each vertex along its line of sight, m; or None.")
      .def_prop_ro(
          "labels", [](nb::handle_t<Mesh> self) { return known(self, &MeasuredMesh::labels); },
          "Semantic class of each vertex; or None.")
      .def_prop_ro(
          "confidence",
          [](nb::handle_t<Mesh> self) { return known(self, &MeasuredMesh::confidence); },
          "Of each vertex, 0 to 1, how squarely it was seen; or None.")
      .def_prop_ro(
          "origin_w_m",
          [](const Mesh& mesh) {
            const glm::dvec3 p = mesh.georeference.origin_w_m;
            return std::array<double, 3>{p.x, p.y, p.z};
          },
          "Where D begins in W.")
      .def(
          "save",
          [](const Mesh& mesh, const std::filesystem::path& path) {
            without_gil([&](const StopRequest&) {
              write_measured_mesh(path, mesh.measured, mesh.georeference);
              return true;
            });
          },
          "path"_a,
          "Writes a .ply, .obj, .stl or .glb, by the name's end. It appears only when whole.")
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
      R"(Reads the triangles of a .ply, .obj, .stl, .gltf or .glb, whoever wrote it.

Raises groundray.Error if it cannot be read or holds no triangle.)");
}

}  // namespace groundray::python
