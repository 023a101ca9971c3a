#include "sensors/material_io.h"

#include <cstdint>
#include <utility>
#include <vector>

#include "core/error.h"
#include "sensors/yaml_reader.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;
using yaml::positive;
using yaml::Rule;

constexpr Rule share_rule{[](double value) { return value >= 0 && value <= 1; },
                          "must be from 0 to 1"};

Lambertian read_lambertian(Map spectrum, Faults& faults) {
  const auto wavelengths = spectrum.list("wavelengths_nm", Need::Required);
  std::vector<double> reflectances(wavelengths.size());
  spectrum.read_numbers("reflectances", Need::Required, reflectances, share_rule);
  std::vector<double> deviations(wavelengths.size());
  spectrum.read_numbers("deviations", Need::Optional, deviations, share_rule);
  if (wavelengths.empty() && spectrum.node().kind == Node::Kind::Map) {
    faults.add(spectrum.node(), "spectrum", "has no samples, but needs at least one");
  }
  spectrum.close();
  Lambertian surface;
  double previous_nm = 0;
  for (std::size_t i = 0; i < wavelengths.size(); ++i) {
    const auto wavelength_nm = yaml::number(wavelengths[i], "wavelengths_nm", positive, faults);
    if (!wavelength_nm) continue;
    if (*wavelength_nm <= previous_nm) {
      faults.add(wavelengths[i], "wavelengths_nm", "{} follows {}: sort them in ascending order",
                 *wavelength_nm, previous_nm);
    }
    previous_nm = *wavelength_nm;
    surface.spectrum.push_back({*wavelength_nm, reflectances[i]});
  }
  return surface;
}

void check_sources(Map& root, Faults& faults) {
  const Node* sources = root.find("sources", Need::Optional);
  if (!sources) return;
  const Map texts(*sources, "sources", faults);
  for (std::size_t i = 1; sources->kind == Node::Kind::Map && i < sources->items.size(); i += 2) {
    yaml::is_text(sources->items[i], sources->items[i - 1].text, faults);
  }
}

}  // namespace

Material load_material(const fs::path& path) { return parse_material(yaml::read_file(path), path); }

Material parse_material(const std::string& text, const fs::path& path) {
  const Node node = yaml::parse(text, path);
  Faults faults(path);
  Map root(node, "", faults);
  Material material;
  yaml::check_version(root, "groundray_material", faults);
  root.read_text("name", Need::Required, material.name);
  auto spectrum = root.map("spectrum", Need::Optional);
  RetroReflector retro;
  root.read_number("coefficient_cd_lx_m2", Need::Optional, retro.coefficient_cd_lx_m2, positive);
  const bool retro_reflects = root.find("coefficient_cd_lx_m2", Need::Optional) != nullptr;
  if (retro_reflects == spectrum.has_value() && node.kind == Node::Kind::Map) {
    faults.add(node, "", "must have exactly one of 'spectrum' and 'coefficient_cd_lx_m2'");
  }
  if (retro_reflects) material.reflection = retro;
  if (spectrum) material.reflection = read_lambertian(std::move(*spectrum), faults);
  check_sources(root, faults);
  root.close();
  faults.throw_if_any();
  return material;
}

}  // namespace groundray
