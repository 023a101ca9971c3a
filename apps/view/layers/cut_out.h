#pragma once

#include <vtkSmartPointer.h>
#include <vtkTexture.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/model/model.h"

namespace groundray {

/// Masks of the surfaces that images cut out, such as leaves on cards, side by side in one texture:
/// white texels that are opaque or transparent, with an opaque column before the first mask.
class CutOuts {
 public:
  /// Packs the masks of all surfaces of the models. Masks are reduced to at most 1024 px and, if
  /// they are many, further.
  /// @param models  without null; they must outlive this.
  /// @throws Error if an image file cannot be read.
  explicit CutOuts(std::span<const Model* const> models);

  /// Returns true if no surface is cut out.
  bool empty() const noexcept { return places_.empty(); }
  /// Returns the texture coordinates of an opaque texel.
  glm::vec2 opaque() const noexcept { return opaque_; }
  /// Returns the texture coordinates of a triangle's corners; std::nullopt if its surface is not
  /// cut out, or if the triangle spans more than one repeat of the image.
  /// @param model  index in the constructor's models.
  std::optional<std::array<glm::vec2, 3>> corners(std::size_t model, std::uint32_t triangle) const;
  /// Returns the texture; null if empty().
  vtkSmartPointer<vtkTexture> texture() const { return texture_; }

 private:
  struct Place {
    glm::dvec2 first{0},
        size{0};  // texture coordinates of the mask's lower left corner, and extent
  };
  std::vector<const Model*> models_;
  std::map<std::pair<std::size_t, std::size_t>, Place> places_;  // by model and surface
  glm::vec2 opaque_{0};
  vtkSmartPointer<vtkTexture> texture_;
};

}  // namespace groundray
