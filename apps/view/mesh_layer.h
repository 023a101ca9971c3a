#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "apps/view/layer.h"
#include "core/mesh.h"
#include "core/mesh_io.h"
#include "core/point_cloud.h"

namespace groundray {

/// Returns the layer of a mesh, smooth if it has many triangles, in a frame whose origin is at
/// `origin_w_m`, with the column "height" and one for each of `vertices`, which has a row for each
/// vertex or no column.
Layer mesh_layer(const std::string& name, const TriangleMesh& mesh, const glm::dvec3& origin_w_m,
                 const PointCloud& vertices = PointCloud());

/// Gives a surface smooth normals: of each vertex the mean of its triangles' by their areas.
void add_normals(Layer& surface);

/// Leaves at most so many triangles, and says so among the facts.
void limit_triangles(Layer& surface, std::size_t triangles);

}  // namespace groundray
