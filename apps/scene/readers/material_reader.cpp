#include "apps/scene/readers/material_reader.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "apps/scene/readers/material_io.h"
#include "apps/scene/readers/pattern_reader.h"
#include "apps/scene/readers/spec_io.h"
#include "core/error.h"

namespace groundray {

std::optional<Material> read_material(const yaml::Node& node, std::string_view key,
                                      const std::filesystem::path& path, const DataFolders& folders,
                                      yaml::Faults& faults) {
  if (!yaml::is_text(node, key, faults)) return std::nullopt;
  const std::string& name = node.text;
  const std::filesystem::path folder = folders.materials();
  try {
    if (name.ends_with(".yaml")) return load_material(beside(path, name));
    const auto names = preset_names(folder);
    if (std::ranges::count(names, name) > 0) return load_material(folder / (name + ".yaml"));
    faults.add(node, key, "{} is not in {}{}; it has {}", yaml::shown(node), folder.string(),
               yaml::suggestion(name, names), fmt::join(names, ", "));
  } catch (const Error& fault) {
    faults.add(node, key, "the material cannot be read:\n{}", fault.what());
  }
  return std::nullopt;
}

}  // namespace groundray
