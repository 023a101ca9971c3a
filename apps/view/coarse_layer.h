#pragma once

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <cstddef>

#include "apps/view/layer.h"

namespace groundray {

/// No layer is thinned below so many points or triangles: small things stay in sight.
inline constexpr std::size_t fewest_elements = 500;

/// Returns some of a cloud's points with all their numbers: about so many (or `fewest_elements`, if
/// that is more), picked at random but always the same; and of more points, those and others. Of no
/// more points than that, the cloud's own data.
vtkSmartPointer<vtkPolyData> thin_points(const Layer& cloud, std::size_t points);

/// Returns a surface with at most so many triangles (or `fewest_elements`, if that is more) or, if
/// it has no more, itself: vertices of one cell of a grid become one of them, and triangles that
/// have no area then, or are there twice, are left out. Where that would leave next to nothing, as
/// of many things smaller than a cell, the largest triangles stay instead. Numbers of points and
/// triangles stay with those that stay.
/// @see Rossignac, Borrel, Multi-resolution 3D approximations for rendering complex scenes (1993).
vtkSmartPointer<vtkPolyData> thin_triangles(const Layer& surface, std::size_t triangles);

}  // namespace groundray
