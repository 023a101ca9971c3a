#include "reconstruction/mesh/measured_mesh_io.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/io/file_io.h"
#include "core/io/point_cloud.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

/// Valid values of a column.
struct ColumnRule {
  std::string_view name;
  double most = 0;  // the minimum is 0
  bool whole = false;
  std::string_view says;
};

constexpr ColumnRule sd_rule{"sd_m", std::numeric_limits<float>::max(), false,
                             "must be 0 or more, and finite"};
constexpr ColumnRule label_rule{"label", std::numeric_limits<std::uint16_t>::max(), true,
                                "must be a whole number from 0 to 65535"};
constexpr ColumnRule confidence_rule{"confidence", 1, false, "must be from 0 to 1"};

template <typename T>
void check_value(const std::string& name, const ColumnRule& rule, std::size_t vertex, T value) {
  const auto number = static_cast<double>(value);
  const bool is_sound =
      number >= 0 && number <= rule.most && (!rule.whole || number == std::floor(number));
  if (!is_sound)
    throw Error("{}: vertex {}: {} = {} {}", name, vertex, rule.name, number, rule.says);
}

template <typename T>
void add_column(const std::string& name, const ColumnRule& rule, const std::vector<T>& values,
                PointCloud& columns) {
  if (values.empty()) return;
  if (values.size() != columns.rows()) {
    throw Error(
        "{}: there are {} values of {} for {} vertices; there must be one per vertex or none", name,
        values.size(), rule.name, columns.rows());
  }
  for (std::size_t i = 0; i < values.size(); ++i) check_value(name, rule, i, values[i]);
  std::ranges::copy(values, columns.add<T>(rule.name).begin());
}

template <typename T>
std::vector<T> column_of(const std::string& name, const ColumnRule& rule,
                         const PointCloud& columns) {
  const auto found = std::ranges::find(columns.columns(), rule.name, &PointCloud::Column::name);
  if (found == columns.columns().end()) return {};
  std::vector<T> out;
  out.reserve(columns.rows());
  const auto take = [&](const auto& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      check_value(name, rule, i, values[i]);
      out.push_back(static_cast<T>(values[i]));
    }
  };
  std::visit(take, found->values);
  return out;
}

/// Moves D's origin to the mesh where single precision about it would be coarse.
void come_near(TriangleMesh& mesh, Georeference& georeference) {
  constexpr double most_m = 4096;
  if (mesh.vertices_m.empty()) return;
  glm::dvec3 low = mesh.vertices_m[0], high = low;
  for (const glm::dvec3& p : mesh.vertices_m) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  for (int k = 0; k < 3; ++k) {
    if (std::max(-low[k], high[k]) <= most_m) continue;
    const double shift_m = std::round(0.5 * (low[k] + high[k]));
    for (glm::dvec3& p : mesh.vertices_m) p[k] -= shift_m;
    georeference.origin_w_m[k] += shift_m;
  }
}

}  // namespace

void write_measured_mesh(const fs::path& path, const MeasuredMesh& mesh,
                         const Georeference& georeference) {
  const std::string form = file_ending(path), name = path.string();
  MeshColumns columns{.vertices = PointCloud(mesh.shape.vertices_m.size())};
  add_column(name, sd_rule, mesh.sd_m, columns.vertices);
  add_column(name, label_rule, mesh.labels, columns.vertices);
  add_column(name, confidence_rule, mesh.confidence, columns.vertices);
  if (form == ".ply") return write_ply(path, mesh.shape, georeference, columns);
  if (form == ".obj") return write_obj(path, mesh.shape, georeference);
  if (form != ".stl" && form != ".glb")
    throw Error("{}: the name of a mesh must end in .ply, .obj, .stl or .glb", name);
  check_mesh(mesh.shape, name, EmptyMesh::Allow);
  TriangleMesh near = mesh.shape;
  Georeference where = georeference;
  come_near(near, where);
  form == ".stl" ? write_stl(path, near, where) : write_glb(path, near, where);
}

MeasuredMeshFile read_measured_mesh(const fs::path& path) {
  MeasuredMeshFile file;
  const auto take = [&](MeshFile&& read) {
    file.mesh.shape = std::move(read.mesh);
    file.georeference = std::move(read.georeference);
    file.dropped = read.dropped;
    file.skipped = read.skipped;
    file.rounding_m = read.rounding_m;
  };
  if (file_ending(path) != ".ply") {
    take(read_mesh(path));
    return file;
  }
  StoredMesh stored = read_stored_mesh(path);
  const std::string name = path.string();
  file.mesh.sd_m = column_of<float>(name, sd_rule, stored.vertices);
  file.mesh.labels = column_of<std::uint16_t>(name, label_rule, stored.vertices);
  file.mesh.confidence = column_of<float>(name, confidence_rule, stored.vertices);
  take(std::move(stored));
  return file;
}

}  // namespace groundray
