#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace groundray {

/// Inpainting method of OpenCV.
enum class Inpainting : std::uint8_t {
  Telea,        ///< fast marching (Telea 2004)
  NavierStokes  ///< continuation of lines of equal brightness (Bertalmio and others 2001)
};

/// Returns the heights with missing ones filled by OpenCV's inpainting from samples up to three
/// cells away, for comparison. Heights are scaled to a suitable range meanwhile.
/// @param size  columns and rows.
/// @param heights_m  in row order; NaN for none.
/// @throws Error if the sizes disagree or OpenCV fails.
std::vector<float> fill_by_inpainting(glm::ivec2 size, std::span<const float> heights_m,
                                      Inpainting by);

}  // namespace groundray
