#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/scene/scene_spec.h"
#include "core/appearance/materials.h"

namespace groundray {

/// Numbered list of the distinct materials of a scene. A surface without a material gets the
/// built-in material of its name. In a scene without lasers and cameras, all numbers are 0.
class Palette {
 public:
  explicit Palette(const SceneSpec& spec);

  /// Returns the number of a surface's material.
  /// @throws Error if it has none, or its spectrum lacks a laser's wavelength or, for cameras, a
  ///         part of the visible range.
  std::uint16_t index_of(const ModelSpec& model, const std::string& surface);
  /// Returns the number of a material of the ground; 0 if there is none.
  /// @throws Error as for a surface.
  std::uint16_t index_of(const std::optional<Material>& material);

  Materials take() { return Materials(std::move(all_)); }

 private:
  bool is_asked_for() const { return are_colours_seen_ || !wavelengths_nm_.empty(); }
  std::uint16_t add(const Material& material);

  std::vector<double> wavelengths_nm_;  // of the lasers
  bool are_colours_seen_ = false;       // true if there are cameras
  std::vector<Material> all_;
};

}  // namespace groundray
