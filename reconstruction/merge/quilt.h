#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/mesh.h"

namespace groundray {

constexpr std::uint32_t no_vertex = 0xffffffff;

/// A vertex of a mesh that is sewn together from scans.
struct QuiltVertex {
  glm::dvec3 p{0};
  glm::vec3 normal{0};  ///< unit, as its scan has it
  float sd_m = 0, confidence = 1;
  std::uint16_t label = 0;
  std::uint32_t scan = 0;
  std::uint32_t vertex = no_vertex;   ///< of that scan; none if it lies on an edge
  std::uint32_t nearest = no_vertex;  ///< of that scan, on the edge
  bool is_shared = true;  ///< another scan covers it, or a triangle of it covers another's
};

/// Triangles of several scans, in the making.
struct Quilt {
  std::vector<QuiltVertex> vertices;
  std::vector<glm::uvec3> triangles;
};

/// Returns the vertex at a share of the way from one to another.
QuiltVertex between(const QuiltVertex& from, const QuiltVertex& to, double share);

TriangleMesh mesh_of(const Quilt& quilt);
std::vector<float> sds_of(const Quilt& quilt);

/// Makes a surface with borders, each edge that of at most two triangles which run along it in
/// opposite directions, and the triangles at each vertex one fan. Triangles that name a vertex
/// twice, or that run along an edge as an earlier one does, are left out; fans are parted by
/// vertices in the same place. Returns how many triangles were left out.
std::size_t make_manifold(Quilt& quilt);

/// A place on the edge between two vertices.
struct EdgePlace {
  std::uint32_t from = 0, to = 0;  ///< vertices; the edge may run either way
  double share = 0;                ///< of the way, above 0 and below 1
};

/// Splits edges: puts a vertex at each place, all different, and cuts the triangles of the edge.
/// Returns the vertices' numbers in the order of the places.
std::vector<std::uint32_t> split_edges(Quilt& quilt, std::span<const EdgePlace> places);

}  // namespace groundray
