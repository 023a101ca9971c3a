#include "apps/groundray/describe/material_facts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <variant>
#include <vector>

namespace groundray {
namespace {

// Lines of common lasers: green of bathymetry and cameras, and those of lidars.
constexpr std::array shown_nm{532.0, 905.0, 1550.0};

std::string words_for(const Lambertian& /*matt*/) { return "matt"; }
std::string words_for(const RoughDiffuse& rough) {
  return fmt::format("rough, {:.4g}", rough.roughness);
}
std::string words_for(const Coated& coated) {
  return fmt::format("coated, index {:.4g}, alpha {:.4g}", coated.refractive_index, coated.alpha);
}
std::string words_for(const Conductor& metal) {
  return fmt::format("metal, alpha {:.4g}", metal.alpha);
}
std::string words_for(const PlantLeaf& /*leaf*/) { return "leaf, lets light through"; }
std::string words_for(const RetroReflector& retro) {
  return fmt::format("retro-reflector, {:.4g} cd/(lx m2)", retro.coefficient_cd_lx_m2);
}

const Spectrum& spectrum_of(const Lambertian& matt) { return matt.spectrum; }
const Spectrum& spectrum_of(const RoughDiffuse& rough) { return rough.spectrum; }
const Spectrum& spectrum_of(const Coated& coated) { return coated.spectrum; }
const Spectrum& spectrum_of(const Conductor& metal) { return metal.refractive_index; }
const Spectrum& spectrum_of(const PlantLeaf& leaf) { return leaf.reflectance; }
const Spectrum& spectrum_of(const RetroReflector& /*retro*/) {
  static const Spectrum none;
  return none;
}

std::string reflectances_text(const Material& material) {
  std::vector<std::string> parts;
  for (const double nm : shown_nm) {
    if (const auto reflectance = reflectance_at(material, nm))
      parts.push_back(fmt::format("{:.3g} % at {:g} nm", 100 * *reflectance, nm));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace

std::string kind_of(const Material& material) {
  return std::visit([](const auto& kind) { return words_for(kind); }, material.reflection);
}

std::optional<glm::dvec2> covered_nm(const Material& material) {
  const Spectrum& spectrum = std::visit(
      [](const auto& kind) -> const Spectrum& { return spectrum_of(kind); }, material.reflection);
  if (spectrum.empty()) return std::nullopt;
  return glm::dvec2(spectrum.front().wavelength_nm, spectrum.back().wavelength_nm);
}

std::optional<double> reflectance_at(const Material& material, double wavelength_nm) {
  const auto covered = covered_nm(material);
  if (!covered || wavelength_nm < covered->x || wavelength_nm > covered->y) return std::nullopt;
  return retro_brdf(material, wavelength_nm).albedo;
}

std::string line_of(const Material& material) {
  const std::string reflectances = reflectances_text(material);
  return kind_of(material) + (reflectances.empty() ? "" : "; reflects " + reflectances);
}

Facts facts_of(const Material& material) {
  Facts facts{{"kind", "material"}, {"name", material.name}, {"surface", kind_of(material)}};
  if (const auto covered = covered_nm(material))
    facts.emplace_back("spectrum", fmt::format("{:g} to {:g} nm", covered->x, covered->y));
  if (const std::string text = reflectances_text(material); !text.empty())
    facts.emplace_back("reflects", text);
  if (material.emitted != glm::dvec3(0)) {
    facts.emplace_back("emits",
                       fmt::format("({:.4g}, {:.4g}, {:.4g}) W/(m2 sr)", material.emitted.x,
                                   material.emitted.y, material.emitted.z));
  }
  return facts;
}

}  // namespace groundray
