#pragma once

// Private to the library: rectangles of values, stored row by row.
#include <cstddef>
#include <glm/vec2.hpp>

namespace groundray {

/// Returns the number of values in a rectangle of `size` columns and rows.
inline std::size_t value_count(glm::ivec2 size) {
  return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
}

/// Returns the index of the value at a column and row of a rectangle of `columns` columns.
inline std::size_t value_index(glm::ivec2 place, int columns) {
  return static_cast<std::size_t>(place.y) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(place.x);
}

}  // namespace groundray
