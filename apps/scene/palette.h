#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/materials.h"
#include "sensors/scene_spec.h"

namespace groundray {

/// Gathers the materials that a scene uses, each once, and numbers them. Surfaces without one take
/// the built-in material of their name; in a scene without lasers and cameras all have number 0.
class Palette {
 public:
  explicit Palette(const SceneSpec& spec);

  /// Returns the number of a surface's material. @throws Error if it has none, or its spectrum
  /// lacks a laser's wavelength or, for cameras, some of what is visible.
  std::uint16_t index_of(const ModelSpec& model, const std::string& surface);
  /// Returns the number of a material of the ground. @throws Error likewise.
  std::uint16_t index_of(const std::optional<Material>& material);

  Materials take() { return Materials(std::move(all_)); }

 private:
  bool is_asked_for() const { return are_colours_seen_ || !wavelengths_nm_.empty(); }
  std::uint16_t add(const Material& material);

  std::vector<double> wavelengths_nm_;  // of lasers
  bool are_colours_seen_ = false;       // by cameras
  std::vector<Material> all_;
};

}  // namespace groundray
