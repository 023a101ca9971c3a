#pragma once

#include <vtkLookupTable.h>
#include <vtkSmartPointer.h>

#include <cstdint>
#include <glm/vec3.hpp>

#include "apps/view/layer.h"

namespace groundray {

/// Returns the colour of a share of a scale, 0 to 1: sRGB, each 0 to 1.
glm::dvec3 colour_on(ColourScale scale, double share);

/// Returns the colour that stands for a kind, other ones for the kinds next to it.
glm::dvec3 colour_of_kind(int kind);

/// Returns the colour of a kind of a column that counts kinds.
glm::dvec3 colour_of_kind(const LayerColumn& column, int kind);

/// Returns the table that a column's numbers are painted by; grey where there is no number.
vtkSmartPointer<vtkLookupTable> make_colour_table(const LayerColumn& column);

}  // namespace groundray
