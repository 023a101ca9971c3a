#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "core/near_names.h"

namespace groundray::yaml {
namespace {

constexpr Rule index_rule{[](double value) { return value > 1 && value <= 4; },
                          "must be > 1 and <= 4"};
constexpr Rule alpha_rule{[](double value) { return value >= 0.01 && value <= 1; },
                          "must be from 0.01 to 1"};

// Spectra on common wavelengths, given as a map of lists.
class Curves {
 public:
  Curves(Map map, std::string_view key, Faults& faults) : map_(std::move(map)), faults_(faults) {
    const auto nodes = map_.list("wavelengths_nm", Need::Required);
    if (nodes.empty() && map_.node().kind == Node::Kind::Map)
      faults_.add(map_.node(), key, "has no samples, but needs at least one");
    double previous_nm = 0;
    for (const Node& node : nodes) {
      const auto nm = number(node, "wavelengths_nm", positive, faults_);
      wavelengths_nm_.push_back(nm.value_or(0));
      if (!nm) continue;
      if (*nm <= previous_nm) {
        faults_.add(node, "wavelengths_nm", "{} follows {}: sort them in ascending order", *nm,
                    previous_nm);
      }
      previous_nm = *nm;
    }
  }

  Map& map() { return map_; }

  // Returns the spectrum at a key; empty if it is missing or invalid.
  Spectrum read(std::string_view key, Need need, Rule rule) {
    std::vector<double> values(wavelengths_nm_.size());
    Spectrum spectrum;
    if (!map_.read_numbers(key, need, values, rule)) return spectrum;
    for (std::size_t i = 0; i < values.size(); ++i)
      spectrum.push_back({wavelengths_nm_[i], values[i]});
    return spectrum;
  }

 private:
  Map map_;
  Faults& faults_;
  std::vector<double> wavelengths_nm_;
};

Coated read_coat(Map coat, Spectrum base) {
  Coated coated{.spectrum = std::move(base)};
  coat.read_number("refractive_index", Need::Required, coated.refractive_index, index_rule);
  coat.read_number("alpha", Need::Required, coated.alpha, alpha_rule);
  coat.close();
  return coated;
}

void check_sum(const PlantLeaf& leaf, const Map& map, Faults& faults) {
  for (std::size_t i = 0; i < leaf.reflectance.size() && i < leaf.transmittance.size(); ++i) {
    if (leaf.reflectance[i].value + leaf.transmittance[i].value <= 1) continue;
    faults.add(map.node(), "spectrum",
               "at {} nm reflectance {} and transmittance {} add up to more than 1",
               leaf.reflectance[i].wavelength_nm, leaf.reflectance[i].value,
               leaf.transmittance[i].value);
    return;
  }
}

// Reads a material with a `spectrum`; at most one of the keys that modify it may be present.
void read_matt(Map& root, Map spectrum, Faults& faults, Material& material) {
  Curves curves(std::move(spectrum), "spectrum", faults);
  const Spectrum reflectance = curves.read("reflectances", Need::Required, share_rule);
  const Spectrum transmittance = curves.read("transmittances", Need::Optional, share_rule);
  curves.read("deviations", Need::Optional, share_rule);
  const bool passes_light = curves.map().find("transmittances", Need::Optional) != nullptr;
  curves.map().close();
  double roughness = 0;
  root.read_number("diffuse_roughness", Need::Optional, roughness, share_rule);
  const bool rough = root.find("diffuse_roughness", Need::Optional) != nullptr;
  auto coat = root.map("coat", Need::Optional);
  if (passes_light + rough + coat.has_value() > 1) {
    faults.add(
        root.node(), "",
        "must have at most one of 'spectrum.transmittances', 'diffuse_roughness' and 'coat'");
  }
  material.reflection = Lambertian{reflectance};
  if (rough) material.reflection = RoughDiffuse{reflectance, roughness};
  if (coat) material.reflection = read_coat(std::move(*coat), reflectance);
  if (!passes_light) return;
  const PlantLeaf leaf{reflectance, transmittance};
  check_sum(leaf, curves.map(), faults);
  material.reflection = leaf;
}

Conductor read_conductor(Map map, Faults& faults) {
  Curves curves(std::move(map), "conductor", faults);
  Conductor metal;
  metal.refractive_index = curves.read("refractive_indices", Need::Required, positive);
  metal.extinction_coefficient =
      curves.read("extinction_coefficients", Need::Required, not_negative);
  curves.map().read_number("alpha", Need::Required, metal.alpha, alpha_rule);
  curves.map().close();
  return metal;
}

void read_reflection(Map& root, Faults& faults, Material& material) {
  auto spectrum = root.map("spectrum", Need::Optional);
  auto conductor = root.map("conductor", Need::Optional);
  RetroReflector retro;
  root.read_number("coefficient_cd_lx_m2", Need::Optional, retro.coefficient_cd_lx_m2, positive);
  const bool retro_reflects = root.find("coefficient_cd_lx_m2", Need::Optional) != nullptr;
  if (spectrum.has_value() + conductor.has_value() + retro_reflects != 1 &&
      root.node().kind == Node::Kind::Map) {
    faults.add(root.node(), "",
               "must have exactly one of 'spectrum', 'conductor' and 'coefficient_cd_lx_m2'");
  }
  if (retro_reflects) material.reflection = retro;
  if (conductor) material.reflection = read_conductor(std::move(*conductor), faults);
  if (spectrum) return read_matt(root, std::move(*spectrum), faults, material);
  for (const char* key : {"diffuse_roughness", "coat"}) {
    if (const Node* node = root.find(key, Need::Optional))
      faults.add(*node, key, "applies to 'spectrum' only");
  }
}

}  // namespace

std::optional<Material> read_material(const Node& node, std::string_view key, const fs::path& path,
                                      const DataFolders& folders, Faults& faults) {
  if (!is_text(node, key, faults)) return std::nullopt;
  const std::string& name = node.text;
  const fs::path folder = folders.materials();
  try {
    if (name.ends_with(".yaml")) return load_material(beside(path, name));
    const auto names = preset_names(folder);
    if (std::ranges::count(names, name) > 0) return load_material(folder / (name + ".yaml"));
    faults.add(node, key, "{} is not in {}, which has {}{}", shown(node), folder.string(),
               fmt::join(names, ", "), suggestion(name, names));
  } catch (const Error& fault) {
    faults.add(node, key, "the material cannot be read:\n{}", fault.what());
  }
  return std::nullopt;
}

}  // namespace groundray::yaml

namespace groundray {

Material load_material(const std::filesystem::path& path) {
  return parse_material(yaml::read_file(path), path);
}

Material parse_material(const std::string& text, const std::filesystem::path& path) {
  const yaml::Node node = yaml::parse(text, path);
  yaml::Faults faults(path);
  yaml::Map root(node, "", faults);
  Material material;
  yaml::check_version(root, "groundray_material", faults);
  root.read_text("name", yaml::Need::Required, material.name);
  yaml::read_reflection(root, faults, material);
  root.read_vector("emission_w_m2_sr", yaml::Need::Optional, material.emitted, yaml::not_negative);
  yaml::check_sources(root, faults);
  root.close();
  faults.throw_if_any();
  return material;
}

}  // namespace groundray
