#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace groundray {

/// How images are inpainted.
enum class Inpainting : std::uint8_t {
  Telea,        ///< by fast marching (Telea 2004)
  NavierStokes  ///< by lines of equal brightness that go on (Bertalmio and others 2001)
};

/// Returns the heights with those missing filled by OpenCV's inpainting from samples up to three
/// cells away, to compare with. Heights are scaled meanwhile to what suits it.
/// @param size       columns and rows.
/// @param heights_m  row by row; NaN where there is none.
/// @throws Error if the sizes disagree or OpenCV fails.
std::vector<float> fill_by_inpainting(glm::ivec2 size, std::span<const float> heights_m,
                                      Inpainting by);

}  // namespace groundray
