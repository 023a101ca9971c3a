#include "apps/groundray/describe/named_facts.h"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <utility>

#include "apps/groundray/describe/asset_facts.h"
#include "apps/groundray/describe/material_facts.h"
#include "apps/groundray/describe/sensor_facts.h"
#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/simulation.h"
#include "apps/scene/yaml_reader.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 2> data_kinds{"sensors", "materials"};

bool is_asset(std::string_view name) {
  return std::ranges::find(asset_names(), name) != asset_names().end();
}

}  // namespace

std::optional<Facts> yaml_facts(const fs::path& file) {
  const yaml::Node node = yaml::parse(yaml::read_file(file), file);
  yaml::Faults faults(file);
  yaml::Map root(node, "", faults);
  const auto has = [&](std::string_view key) {
    return root.find(key, yaml::Need::Optional) != nullptr;
  };
  if (has("groundray_lidar")) return facts_of(load_lidar(file));
  if (has("groundray_camera")) return facts_of(load_camera(file));
  if (has("groundray_material")) return facts_of(load_material(file));
  return std::nullopt;
}

std::vector<Facts> named_facts(const std::string& name) {
  std::vector<Facts> all;
  for (const char* kind : data_kinds) {
    const std::vector<std::string> names = preset_names(data_folder() / kind);
    if (std::ranges::find(names, name) == names.end()) continue;
    const fs::path file = data_folder() / kind / (name + ".yaml");
    auto facts = yaml_facts(file);
    if (!facts) continue;
    facts->emplace_back("file", file.string());
    all.push_back(std::move(*facts));
  }
  if (is_asset(name)) all.push_back(facts_of(asset_kind(name)));
  return all;
}

std::vector<std::string> names_of_data() {
  std::set<std::string> names(asset_names().begin(), asset_names().end());
  for (const char* kind : data_kinds) {
    for (std::string& name : preset_names(data_folder() / kind)) names.insert(std::move(name));
  }
  return {names.begin(), names.end()};
}

}  // namespace groundray
