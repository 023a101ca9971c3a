#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <cstddef>

#include "apps/view/layer.h"

namespace groundray {

/// Returns some of a cloud's points with all their numbers: about so many, picked at random but
/// always the same; and of more points, those and others.
vtkSmartPointer<vtkPolyData> thin_points(const Layer& cloud, std::size_t points);

/// Returns a surface with at most so many triangles or, if it has no more, itself: vertices of one
/// cell of a grid become one of them, and triangles that have no area then are left out. Numbers of
/// points and triangles stay with those that stay.
/// @see Rossignac, Borrel, Multi-resolution 3D approximations for rendering complex scenes (1993).
vtkSmartPointer<vtkPolyData> thin_triangles(const Layer& surface, std::size_t triangles);

}  // namespace groundray
