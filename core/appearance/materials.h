#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "core/appearance/bsdf.h"
#include "core/appearance/material.h"

namespace groundray {

/// Materials of a scene, by index. Immutable; copies share them, and any number of threads may
/// query them.
class Materials {
 public:
  Materials() = default;
  Materials(std::initializer_list<Material> all);
  explicit Materials(std::vector<Material> all);

  std::span<const Material> all() const noexcept;

  /// Returns the backscatter of each material at a wavelength, computed at the first request.
  /// @throws Error as retro_brdf.
  std::span<const RetroBrdf> retro_brdfs(double wavelength_nm) const;

  /// BSDFs for the colours of linear sRGB, and their albedos: the fractions of uniform illumination
  /// that are reflected to the side it came from.
  struct InColour {
    std::vector<Bsdf> bsdfs;
    std::vector<glm::vec3> albedos;

    /// Returns the albedo of a material with a texture.
    /// @param tint  as for Bsdf.
    glm::vec3 albedo(std::uint16_t material, const glm::vec3& tint) const noexcept {
      const Bsdf& bsdf = bsdfs[material];
      if (tint == glm::vec3(1) || std::holds_alternative<ConductorBsdf>(bsdf.surface))
        return albedos[material];
      return glm::vec3(bsdf.albedo(glm::dvec3(tint)));
    }
  };
  /// Returns the BSDF and albedo of each material, computed at the first request.
  /// @throws Error as bsdf_in_colour.
  const InColour& in_colour() const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace groundray
