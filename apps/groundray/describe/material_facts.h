#pragma once

#include <glm/vec2.hpp>
#include <optional>
#include <string>

#include "apps/groundray/describe/facts.h"
#include "core/appearance/material.h"

namespace groundray {

/// Returns the kind of a material's reflection: "matt", "metal".
std::string kind_of(const Material& material);

/// Returns the wavelengths that a material's spectrum covers, nm; nothing for a retro-reflector,
/// which has none.
std::optional<glm::dvec2> covered_nm(const Material& material);

/// Returns the fraction of uniform illumination that a material reflects at a wavelength; nothing
/// beyond its spectrum, and for retro-reflectors.
std::optional<double> reflectance_at(const Material& material, double wavelength_nm);

/// Returns a material's main figures in one line.
std::string line_of(const Material& material);

/// Describes a material.
Facts facts_of(const Material& material);

}  // namespace groundray
