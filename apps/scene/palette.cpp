#include "apps/scene/palette.h"

#include <filesystem>
#include <optional>

#include "apps/scene/fingerprint.h"
#include "apps/scene/readers/material_io.h"
#include "apps/scene/simulation.h"
#include "core/appearance/bsdf.h"
#include "core/error.h"

namespace groundray {

Palette::Palette(const SceneSpec& spec) {
  for (const MountedLidar& mounted : spec.lidars) {
    if (mounted.lidar.light) wavelengths_nm_.push_back(mounted.lidar.light->wavelength_nm);
  }
  are_colours_seen_ = !spec.cameras.empty();
  if (spec.terrain.material) add(*spec.terrain.material);
}

std::uint16_t Palette::index_of(const ModelSpec& model, const std::string& surface) {
  if (!is_asked_for()) return 0;
  if (const auto found = model.materials.find(surface); found != model.materials.end())
    return add(found->second);
  if (model.material) return add(*model.material);
  const std::filesystem::path built_in = data_folder() / "materials" / (surface + ".yaml");
  if (!surface.empty() && std::filesystem::exists(built_in)) return add(load_material(built_in));
  throw Error(
      "its surface '{}' has no material, which lasers and cameras need: add material: NAME, or "
      "materials: {{{}: NAME}}, to the entry",
      surface, surface);
}

std::uint16_t Palette::index_of(const std::optional<Material>& material) {
  return !is_asked_for() || !material ? std::uint16_t{0} : add(*material);
}

namespace {

void check_colours(const Material& material) {
  try {
    bsdf_in_colour(material);
  } catch (const Error& fault) {
    throw Error("its material cannot be used with cameras: {}", fault.what());
  }
}

}  // namespace

std::uint16_t Palette::add(const Material& material) {
  const std::uint64_t print = fingerprint_of(material);
  for (std::size_t i = 0; i < all_.size(); ++i) {
    if (fingerprint_of(all_[i]) == print) return static_cast<std::uint16_t>(i);
  }
  for (const double wavelength_nm : wavelengths_nm_) retro_brdf(material, wavelength_nm);  // throws
  if (are_colours_seen_) check_colours(material);
  all_.push_back(material);
  return static_cast<std::uint16_t>(all_.size() - 1);
}

}  // namespace groundray
