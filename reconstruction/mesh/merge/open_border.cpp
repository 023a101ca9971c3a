// Triangles are added here rather than to a SurfaceMesh, because OpenMesh's add_face rejects those
// that close one of several fans at a vertex; make_manifold parts these fans later.
#include "reconstruction/mesh/merge/open_border.h"

#include <algorithm>

#include "reconstruction/mesh/surface_mesh.h"

namespace groundray {

OpenBorder::OpenBorder(const StitchedMesh& stitched)
    : number_of_(stitched.vertices.size(), no_vertex) {
  const SurfaceMesh surface = surface_of(stitched);
  const auto number = [&](std::uint32_t vertex) {
    if (number_of_[vertex] == no_vertex) {
      number_of_[vertex] = static_cast<std::uint32_t>(vertices_.size());
      vertices_.push_back(vertex);
      after_.emplace_back();
      before_.emplace_back();
    }
    return number_of_[vertex];
  };
  for (const auto border : surface.halfedges()) {
    if (!surface.is_boundary(border)) continue;
    const std::uint32_t from = number_of(surface.to_vertex_handle(border));
    const std::uint32_t to = number_of(surface.from_vertex_handle(border));
    after_[number(from)].push_back(to);
    before_[number(to)].push_back(from);
  }
  for (const auto h : surface.halfedges()) {
    if (surface.is_boundary(surface.edge_handle(h))) continue;
    const std::uint32_t from = number_of(surface.from_vertex_handle(h));
    const std::uint32_t to = number_of(surface.to_vertex_handle(h));
    if (number_of_[from] != no_vertex && number_of_[to] != no_vertex)
      inner_.insert(key_of(from, to));
  }
}

bool OpenBorder::has(std::uint32_t from, std::uint32_t to) const {
  return std::ranges::find(after(from), to) != after(from).end();
}

bool OpenBorder::is_free(std::uint32_t from, std::uint32_t to) const {
  return !has(from, to) && !inner_.contains(key_of(from, to));
}

void OpenBorder::add(const glm::uvec3& triangle) {
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t from = triangle[k], to = triangle[(k + 1) % 3];
    if (has(to, from)) {
      std::erase(after_[number_of_[to]], from);
      std::erase(before_[number_of_[from]], to);
      inner_.insert(key_of(from, to));
      inner_.insert(key_of(to, from));
    } else {
      after_[number_of_[from]].push_back(to);
      before_[number_of_[to]].push_back(from);
    }
  }
}

}  // namespace groundray
