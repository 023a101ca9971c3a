#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "apps/view/rendering/layer.h"
#include "core/geometry/mesh.h"
#include "core/io/mesh_io.h"
#include "core/io/point_cloud.h"

namespace groundray {

/// Returns the layer of a mesh, with smooth normals if it has many triangles. It has the column
/// "height" and one for each column of `vertices`.
/// @param origin_w_m  origin of the mesh's frame, in W.
/// @param vertices    one row per vertex, or no columns.
Layer mesh_layer(const std::string& name, const TriangleMesh& mesh, const glm::dvec3& origin_w_m,
                 const PointCloud& vertices = PointCloud());

/// Adds smooth normals to a surface: at each vertex the area-weighted mean of its triangles'
/// normals.
void add_normals(Layer& surface);

/// Adds the cell column "slope": the angle of each triangle from the horizontal, degrees.
void add_slopes(Layer& surface);

/// Reduces a surface to at most `triangles` triangles and reports that in its facts.
void limit_triangles(Layer& surface, std::size_t triangles);

}  // namespace groundray
