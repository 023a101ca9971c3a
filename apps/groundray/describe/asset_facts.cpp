#include "apps/groundray/describe/asset_facts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "core/model/model.h"
#include "terrain/assets/asset_defaults.h"

namespace groundray {

std::string line_of(AssetKind kind) {
  const AssetDefaults defaults = asset_defaults(kind);
  std::string text = fmt::format("size_m: {:g} ({})", defaults.size_m, defaults.size_is);
  const auto add = [&](const char* key, const std::optional<double>& value) {
    if (value) text += fmt::format(", {}: {:g}", key, *value);
  };
  add("width_m", defaults.width_m);
  add("sag_m", defaults.sag_m);
  add("per_m2", defaults.per_m2);
  add("leaf_area_index", defaults.leaf_area_index);
  if (defaults.leaf_area_index) text += ", leaves: cards";
  if (defaults.has_health) text += ", health: 1";
  if (defaults.has_squares) text += ", square_m: none (plain)";
  if (defaults.has_variants) text += ", variant: 0";
  if (defaults.has_detail) text += ", detail: 1";
  return text;
}

Facts facts_of(AssetKind kind) {
  const Model model = make_asset({.kind = kind});
  const ModelBounds bounds = bounds_of(model.mesh);
  const glm::dvec3 size_m = bounds.high_m - bounds.low_m;
  std::vector<std::string> surfaces;
  for (const ModelSurface& surface : model.surfaces) surfaces.push_back(surface.name);
  return {{"kind", "asset"},
          {"name", std::string(asset_name(kind))},
          {"keys", line_of(kind)},
          {"triangles", fmt::format("{} by default", model.mesh.triangles.size())},
          {"size", fmt::format("{:.4g} x {:.4g} x {:.4g} m", size_m.x, size_m.y, size_m.z)},
          {"surfaces", fmt::format("{}", fmt::join(surfaces, ", "))}};
}

}  // namespace groundray
