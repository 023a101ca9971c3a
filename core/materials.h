#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <span>
#include <vector>

#include "core/material.h"

namespace groundray {

/// The materials of a scene, by index. Immutable; copies share them, and any number of threads may
/// ask.
class Materials {
 public:
  Materials() = default;
  Materials(std::initializer_list<Material> all);
  explicit Materials(std::vector<Material> all);

  std::span<const Material> all() const noexcept;

  /// Returns what each sends back at a wavelength, found when it is asked for first.
  /// @throws Error as retro_brdf.
  std::span<const RetroBrdf> retro_brdfs(double wavelength_nm) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace groundray
