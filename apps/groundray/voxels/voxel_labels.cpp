#include "apps/groundray/voxels/voxel_labels.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <vector>

#include "apps/scene/simulation.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Labels of all surfaces of a scene.
std::set<std::uint16_t> surface_labels(const Scene& scene) {
  std::set<std::uint16_t> labels;
  if (scene.cover.empty()) labels.insert(scene.terrain.label);
  for (const CoverLayer& layer : scene.cover.layers()) labels.insert(layer.label);
  for (const ModelTruth& model : scene.models) labels.insert(model.label);
  return labels;
}

fs::path set_file(const std::string& name) {
  std::vector<std::string> names, found;
  const fs::path folder = data_folder() / "labels";
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  for (const std::string& known : names) {
    if (known == name) return folder / (name + ".yaml");
    if (known.starts_with(name)) found.push_back(known);
  }
  if (found.size() == 1) return folder / (found[0] + ".yaml");
  throw Error("--labels {}: it {}; there are {}", name,
              found.empty() ? "is no set of labels" : "begins several sets",
              fmt::join(found.empty() ? names : found, ", "));
}

// Numbers of the classes of a set.
std::map<std::string, std::uint16_t> class_numbers(const fs::path& file,
                                                   const std::set<std::string>& classes) {
  const yaml::Node document = yaml::parse(yaml::read_file(file), file);
  yaml::Faults faults(file);
  yaml::Map root(document, "", faults);
  std::map<std::string, std::uint16_t> numbers;
  if (auto of = root.map("of", yaml::Need::Required)) {
    for (const std::string& name : classes)
      of->read_whole(name, yaml::Need::Required, numbers[name]);
    of->close_partly();
  }
  root.close_partly();
  faults.throw_if_any();
  return numbers;
}

}  // namespace

VoxelLabelMap voxel_labels(const SceneSpec& spec, const Scene& scene, const std::string& set) {
  VoxelLabelMap map;
  const std::set<std::uint16_t> labels = surface_labels(scene);
  if (set.empty()) {
    for (const std::uint16_t label : labels) map[label] = label;
  } else {
    std::set<std::string> classes;
    for (const std::uint16_t label : labels) {
      if (!spec.classes.contains(label)) {
        throw Error("--labels {}: label {} has no class; add it to the scene's key 'classes'", set,
                    label);
      }
      classes.insert(spec.classes.at(label));
    }
    const auto numbers = class_numbers(set_file(set), classes);
    for (const std::uint16_t label : labels) map[label] = numbers.at(spec.classes.at(label));
  }
  for (const auto& [label, number] : map) {
    if (number != 0) continue;
    throw Error("label {} of a surface would be 0 in voxels, which stands for empty ones; {}",
                label,
                set.empty() ? "set 'label' of the terrain and of each object, or use --labels"
                            : "use another set");
  }
  return map;
}

}  // namespace groundray
