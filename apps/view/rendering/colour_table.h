#pragma once

#include <vtkLookupTable.h>
#include <vtkSmartPointer.h>

#include <cstdint>
#include <glm/vec3.hpp>

#include "apps/view/rendering/layer.h"

namespace groundray {

/// Returns the colour at a fraction of a scale, 0 to 1: sRGB, each component 0 to 1.
glm::dvec3 colour_on(ColourScale scale, double share);

/// Returns the colour of a kind; neighbouring kinds have different colours.
glm::dvec3 colour_of_kind(int kind);

/// Returns the colour of a kind in a column of categories.
glm::dvec3 colour_of_kind(const LayerColumn& column, int kind);

/// Returns the lookup table that maps a column's values to colours; NaN is grey.
vtkSmartPointer<vtkLookupTable> make_colour_table(const LayerColumn& column);

}  // namespace groundray
