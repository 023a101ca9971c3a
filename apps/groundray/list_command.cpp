#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/groundray/command.h"
#include "apps/groundray/describe/asset_facts.h"
#include "apps/groundray/describe/material_facts.h"
#include "apps/groundray/describe/sensor_facts.h"
#include "apps/scan/word_option.h"
#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/simulation.h"
#include "core/io/print_error.h"
#include "terrain/assets/asset_defaults.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Entry of a list: its line for people, and its figures for programs.
struct Listed {
  std::string name, line;
  Json figures;
};

// Group of entries under one heading.
struct ListedGroup {
  std::string_view kind, heading;
  std::vector<Listed> entries;
};

Json figures_json(const LidarSpec& lidar) {
  const LidarFigures figures = figures_of(lidar);
  const Json far_m = std::isinf(lidar.gate.far_m) ? Json() : Json(lidar.gate.far_m);
  return {{"model", lidar.model},
          {"channels", figures.channels},
          {"azimuth_span_deg", figures.azimuth_span_deg},
          {"elevation_deg", {figures.elevation_deg.x, figures.elevation_deg.y}},
          {"range_m", {Json(lidar.gate.near_m), far_m}},
          {"rate_hz", figures.rate_hz},
          {"pulses", figures.pulses}};
}

Json figures_json(const CameraSpec& camera) {
  const glm::dvec2 view = view_deg(camera);
  return {{"model", camera.model},
          {"size_px", {camera.size_px.x, camera.size_px.y}},
          {"view_deg", {view.x, view.y}},
          {"lens", lens_name(camera)},
          {"rate_hz", camera.rate_hz},
          {"filter", camera.imager ? Json(filter_name(camera.imager->filter)) : Json()}};
}

Json figures_json(const Material& material) {
  const auto covered = covered_nm(material);
  Json reflectances = Json::object();
  for (const int nm : {532, 905, 1550}) {
    if (const auto reflectance = reflectance_at(material, nm))
      reflectances[std::to_string(nm)] = *reflectance;
  }
  return {{"surface", kind_of(material)},
          {"spectrum_nm", covered ? Json({covered->x, covered->y}) : Json()},
          {"reflectance_by_nm", reflectances}};
}

Json figures_json(AssetKind kind) {
  const AssetDefaults defaults = asset_defaults(kind);
  Json figures{{"size_m", defaults.size_m}};
  if (defaults.width_m) figures["width_m"] = *defaults.width_m;
  if (defaults.sag_m) figures["sag_m"] = *defaults.sag_m;
  if (defaults.per_m2) figures["per_m2"] = *defaults.per_m2;
  if (defaults.leaf_area_index) figures["leaf_area_index"] = *defaults.leaf_area_index;
  return figures;
}

template <typename Spec>
std::vector<Listed> entries_of(const fs::path& folder, const std::vector<std::string>& names,
                               Spec (*load)(const fs::path&)) {
  std::vector<Listed> entries;
  for (const std::string& name : names) {
    const Spec spec = load(folder / (name + ".yaml"));
    entries.push_back({name, line_of(spec), figures_json(spec)});
  }
  return entries;
}

void add_lidars(std::vector<ListedGroup>& groups) {
  const fs::path folder = data_folder() / "sensors";
  groups.push_back({"lidar", "lidars (preset: NAME in an entry of lidars)",
                    entries_of(folder, preset_names(folder, SensorKind::Lidar), load_lidar)});
}

void add_cameras(std::vector<ListedGroup>& groups) {
  const fs::path folder = data_folder() / "sensors";
  groups.push_back({"camera", "cameras (preset: NAME in an entry of cameras)",
                    entries_of(folder, preset_names(folder, SensorKind::Camera), load_camera)});
}

void add_materials(std::vector<ListedGroup>& groups) {
  const fs::path folder = data_folder() / "materials";
  groups.push_back({"material", "materials (material: NAME)",
                    entries_of(folder, preset_names(folder), load_material)});
}

void add_assets(std::vector<ListedGroup>& groups) {
  ListedGroup group{"asset", "assets (asset: NAME in an entry of objects or scatter)", {}};
  for (const std::string_view name : asset_names()) {
    const AssetKind kind = asset_kind(name);
    group.entries.push_back({std::string(name), line_of(kind), figures_json(kind)});
  }
  groups.push_back(std::move(group));
}

void print_table(const std::vector<ListedGroup>& groups) {
  std::size_t width = 0;
  for (const ListedGroup& group : groups)
    for (const Listed& entry : group.entries) width = std::max(width, entry.name.size());
  for (const ListedGroup& group : groups) {
    print_text(stdout, "{}{}\n", &group == groups.data() ? "" : "\n", group.heading);
    for (const Listed& entry : group.entries)
      print_text(stdout, "  {:<{}}  {}\n", entry.name, width, entry.line);
  }
}

void print_json(const std::vector<ListedGroup>& groups) {
  Json list = Json::array();
  for (const ListedGroup& group : groups) {
    for (const Listed& entry : group.entries) {
      Json object{{"kind", group.kind}, {"name", entry.name}};
      object.update(entry.figures);
      list.push_back(std::move(object));
    }
  }
  print_text(stdout, "{}\n", list.dump(1, ' ', false, Json::error_handler_t::replace));
}

// Kinds of what a scene file can name.
enum class Listing { Presets, Lidars, Cameras, Materials, Assets };

struct ListOptions {
  std::optional<Listing> kind;  // all if there is none
  bool as_json = false;

  CLI::App* add(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "list", "List what a scene file can name: presets of sensors, materials, assets");
    add_words(command, "KIND", kind, "Kind to list (all)",
              Words<Listing>{{"presets", Listing::Presets},
                             {"lidars", Listing::Lidars},
                             {"cameras", Listing::Cameras},
                             {"materials", Listing::Materials},
                             {"assets", Listing::Assets}});
    command->add_flag("--json", as_json, "Print a list of JSON objects");
    return command;
  }

  void run() const {
    std::vector<ListedGroup> groups;
    const auto includes = [&](Listing one) { return !kind || *kind == one; };
    const bool presets = includes(Listing::Presets);
    if (presets || kind == Listing::Lidars) add_lidars(groups);
    if (presets || kind == Listing::Cameras) add_cameras(groups);
    if (includes(Listing::Materials)) add_materials(groups);
    if (includes(Listing::Assets)) add_assets(groups);
    if (as_json) {
      print_json(groups);
    } else {
      print_table(groups);
    }
  }
};

}  // namespace

Command add_list_command(CLI::App& app) {
  const auto options = std::make_shared<ListOptions>();
  return {options->add(app), [options] { options->run(); }};
}

}  // namespace groundray
