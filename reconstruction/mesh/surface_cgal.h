#pragma once

#include <CGAL/boost/graph/graph_traits_TriMesh_ArrayKernelT.h>
#include <CGAL/boost/graph/helpers.h>
#include <CGAL/boost/graph/properties_TriMesh_ArrayKernelT.h>

#include <boost/property_map/property_map.hpp>

#include "reconstruction/mesh/surface_mesh.h"

namespace groundray {

/// Lets those of CGAL's algorithms find `is_border` that do not include it: they look here, because
/// SurfaceTraits is declared here.
using CGAL::is_border;

/// Temporary properties of CGAL's algorithms, with an initial value: CGAL 6 asks for them, and its
/// adaptor to OpenMesh does not have them.
template <typename Value>
typename boost::property_map<SurfaceMesh, CGAL::dynamic_vertex_property_t<Value>>::const_type get(
    const CGAL::dynamic_vertex_property_t<Value>&, const SurfaceMesh& surface,
    const Value& initial) {
  return {surface.n_vertices(), initial};
}
template <typename Value>
typename boost::property_map<SurfaceMesh, CGAL::dynamic_halfedge_property_t<Value>>::const_type get(
    const CGAL::dynamic_halfedge_property_t<Value>&, const SurfaceMesh& surface,
    const Value& initial) {
  return {surface.n_halfedges(), initial};
}

/// Positions of a surface as points of a CGAL kernel, for `vertex_point_map`. CGAL's own map
/// rounds what it writes to single precision.
template <typename Kernel>
struct SurfacePoints {
  using key_type = SurfaceMesh::VertexHandle;
  using value_type = typename Kernel::Point_3;
  using reference = value_type;
  using category = boost::read_write_property_map_tag;

  SurfaceMesh* mesh = nullptr;

  friend value_type get(const SurfacePoints& points, key_type vertex) {
    const glm::dvec3& p_m = points.mesh->point(vertex);
    return {p_m.x, p_m.y, p_m.z};
  }
  friend void put(const SurfacePoints& points, key_type vertex, const value_type& p) {
    points.mesh->set_point(vertex, {p.x(), p.y(), p.z()});
  }
};

}  // namespace groundray
