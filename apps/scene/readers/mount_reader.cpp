#include <fmt/ranges.h>

#include <algorithm>
#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "core/near_names.h"

namespace groundray::yaml {
namespace {

// Kinds of a scene's sensors and stereo pairs, by name.
using SensorNames = std::map<std::string, std::string_view>;

Pose read_mount(Map mount) {
  Pose X_BS;
  mount.read_vector("translation_m", Need::Optional, X_BS.translation_m);
  glm::dvec3 angles_deg(0);
  mount.read_number("yaw_deg", Need::Optional, angles_deg.x);
  mount.read_number("pitch_deg", Need::Optional, angles_deg.y);
  mount.read_number("roll_deg", Need::Optional, angles_deg.z);
  mount.close();
  const glm::dvec3 angles_rad = glm::radians(angles_deg);
  X_BS.rotation = rotation_from_yaw_pitch_roll(angles_rad.x, angles_rad.y, angles_rad.z);
  return X_BS;
}

bool is_file_name(std::string_view name) {
  return std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
}

constexpr std::size_t most_letters = 100;  // a file system's limit is 255 bytes

// Reads the name of a sensor or pair, which must be unique.
std::string read_name(Map& entry, std::string_view kind, SensorNames& names, Faults& faults) {
  std::string name;
  const Node* const at = entry.read_text("name", Need::Required, name);
  if (!at) return name;
  if (!is_file_name(name)) {
    faults.add(*at, "name",
               "is {}, but is used in file names: use only letters, digits, '_' and '-'",
               shown(*at));
  }
  if (name.size() > most_letters) {
    faults.add(*at, "name", "has {} characters, but is used in file names: use at most {}",
               name.size(), most_letters);
  }
  if (const auto [first, fresh] = names.emplace(name, kind); !fresh) {
    faults.add(entry.node(), "name", "'{}' is taken by an earlier {}: names must differ", name,
               first->second);
  }
  return name;
}

// Reads the sensor that a scene's entry names by `preset` or `file`.
// @param read  reads the sensor from mounted.text; its argument is the path of the file.
template <typename Mounted, typename Read>
void read_source(Map& entry, std::string_view list, SensorKind kind, const fs::path& path,
                 const fs::path& preset_folder, Mounted& mounted, Faults& faults,
                 const Read& read) {
  const Node* preset = entry.find("preset", Need::Optional);
  const Node* file = entry.find("file", Need::Optional);
  if (!preset == !file) {
    faults.add(entry.node(), list, "must have exactly one of 'preset' and 'file'");
    return;
  }
  const Node& node = preset ? *preset : *file;
  const std::string_view key = preset ? "preset" : "file";
  const std::string_view word = kind == SensorKind::Lidar ? "lidar" : "camera";
  if (!is_text(node, key, faults)) return;
  mounted.source = node.text;
  try {
    const fs::path place = preset ? preset_folder / (node.text + ".yaml") : beside(path, node.text);
    // Presets of the other kind are reported by `read`.
    if (preset && (!is_file_name(node.text) || !fs::exists(place))) {
      const auto names = preset_names(preset_folder, kind);
      faults.add(node, key, "{} is not in {}, which has {}{}", shown(node), preset_folder.string(),
                 fmt::join(names, ", "), suggestion(node.text, names));
      return;
    }
    mounted.text = read_file(place);
    read(place);
  } catch (const Error& fault) {
    std::error_code ignored;
    if (file && is_file_name(node.text) && !fs::exists(beside(path, node.text), ignored) &&
        fs::exists(preset_folder / (node.text + ".yaml"), ignored)) {
      faults.add(node, key, "there is no such file, but a preset of this name: write 'preset: {}'",
                 node.text);
      return;
    }
    faults.add(node, key, "the {} cannot be read:\n{}", word, fault.what());
  }
}

MountedLidar read_mounted_lidar(Map entry, const fs::path& path, const fs::path& preset_folder,
                                SensorNames& names, Faults& faults) {
  MountedLidar mounted;
  mounted.where = faults.place(entry.node());
  mounted.name = read_name(entry, "lidar", names, faults);
  read_source(entry, "lidars", SensorKind::Lidar, path, preset_folder, mounted, faults,
              [&](const fs::path& place) { mounted.lidar = parse_lidar(mounted.text, place); });
  if (auto mount = entry.map("mount", Need::Required)) mounted.X_BS = read_mount(std::move(*mount));
  change_lidar(entry, path, mounted.lidar, faults);
  entry.close();
  return mounted;
}

// Returns the pose of C: z is the mount's x, and x and y are its -y and -z.
Pose of_camera(const Pose& X_BS) {
  const Pose X_SC{glm::dquat(0.5, -0.5, 0.5, -0.5), {}};
  return X_BS * X_SC;
}

// Reads a text that names a sensor of the given kind.
std::string read_reference(const Node& node, std::string_view key, std::string_view kind,
                           const SensorNames& names, Faults& faults) {
  if (!is_text(node, key, faults)) return {};
  const auto found = names.find(node.text);
  if (found != names.end() && found->second == kind) return node.text;
  std::vector<std::string> known;
  for (const auto& [name, its_kind] : names)
    if (its_kind == kind) known.push_back(name);
  faults.add(node, key, "is {}, but the scene has {}{}{}", shown(node),
             known.empty() ? fmt::format("no {}", kind)
                           : fmt::format("the {}s {}", kind, fmt::join(known, ", ")),
             found == names.end() ? "" : fmt::format("; that is a {}", found->second),
             suggestion(node.text, known));
  return {};
}

MountedCamera::Trigger read_trigger(Map map, const SensorNames& names, Faults& faults) {
  MountedCamera::Trigger trigger;
  if (const Node* at = map.find("lidar", Need::Required))
    trigger.lidar = read_reference(*at, "lidar", "lidar", names, faults);
  map.read_scaled("delay_ms", Need::Optional, 1e-3, trigger.delay_s, not_negative);
  map.close();
  return trigger;
}

void read_projected(Map& entry, const SensorNames& names, std::vector<std::string>& into,
                    Faults& faults) {
  for (const Node& item : entry.list("project", Need::Optional)) {
    const std::string name = read_reference(item, "project", "lidar", names, faults);
    if (name.empty()) continue;
    if (std::ranges::count(into, name) > 0) faults.add(item, "project", "has '{}' twice", name);
    into.push_back(name);
  }
}

MountedCamera read_mounted_camera(Map entry, const fs::path& path, const fs::path& preset_folder,
                                  SensorNames& names, Faults& faults) {
  MountedCamera mounted;
  mounted.where = faults.place(entry.node());
  mounted.name = read_name(entry, "camera", names, faults);
  const std::size_t before = faults.count();
  read_source(entry, "cameras", SensorKind::Camera, path, preset_folder, mounted, faults,
              [&](const fs::path& place) {
                const Node node = parse(mounted.text, place);
                Faults of_file(place);
                mounted.camera = read_camera(node, place, of_file);
                of_file.throw_if_any();
              });
  if (faults.count() > before) {  // avoids follow-up faults: the file may well have both
    mounted.camera.aperture.emplace();
    mounted.camera.imager.emplace();
  }
  if (auto mount = entry.map("mount", Need::Required))
    mounted.X_BC = of_camera(read_mount(std::move(*mount)));
  change_camera(entry, mounted.camera, faults);
  if (auto trigger = entry.map("trigger", Need::Optional)) {
    mounted.trigger = read_trigger(std::move(*trigger), names, faults);
    for (const char* key : {"rate_hz", "first_ms"}) {
      if (const Node* at = entry.find(key, Need::Optional))
        faults.add(*at, key, "applies to cameras without 'trigger', but this one has it");
    }
  }
  read_projected(entry, names, mounted.lidars, faults);
  entry.close();
  if (faults.count() == before && !mounted.trigger)
    check_rate(entry.node(), mounted.camera, faults);
  if (faults.count() == before) complete_camera(entry.node(), mounted.camera, faults);
  return mounted;
}

// True if the images of two cameras begin at the same times.
bool are_in_step(const MountedCamera& a, const MountedCamera& b) {
  if (a.trigger && b.trigger)
    return a.trigger->lidar == b.trigger->lidar && a.trigger->delay_s == b.trigger->delay_s;
  return !a.trigger && !b.trigger && a.camera.rate_hz == b.camera.rate_hz &&
         a.camera.first_s == b.camera.first_s;
}

StereoSpec read_stereo_pair(Map entry, std::span<const MountedCamera> cameras, SensorNames& names,
                            Faults& faults) {
  StereoSpec pair;
  pair.where = faults.place(entry.node());
  const auto camera = [&](const char* key, std::string& into) -> const MountedCamera* {
    if (const Node* at = entry.find(key, Need::Required))
      into = read_reference(*at, key, "camera", names, faults);
    const auto found = std::ranges::find(cameras, into, &MountedCamera::name);
    return into.empty() || found == cameras.end() ? nullptr : &*found;
  };
  pair.name = read_name(entry, "stereo pair", names, faults);
  const MountedCamera* const left = camera("left", pair.left);
  const MountedCamera* const right = camera("right", pair.right);
  if (left && left == right) {
    faults.add(entry.node(), "stereo", "'{}' has the same camera twice", pair.name);
  } else if (left && right && faults.count() == 0 && !are_in_step(*left, *right)) {
    faults.add(entry.node(), "stereo",
               "'{}' and '{}' are not exposed at the same times: give them the same rate_hz and "
               "first_ms, or the same trigger",
               pair.left, pair.right);
  }
  entry.read_choice("images", Need::Optional, pair.images, {"as_mounted", "rectified"});
  entry.close();
  return pair;
}

}  // namespace

void read_sensors(Map& root, const fs::path& path, const fs::path& preset_folder, SceneSpec& scene,
                  Faults& faults) {
  SensorNames names;
  for (const Node& entry : root.list("lidars", Need::Optional))
    scene.lidars.push_back(
        read_mounted_lidar(Map(entry, "lidars", faults), path, preset_folder, names, faults));
  for (const Node& entry : root.list("cameras", Need::Optional))
    scene.cameras.push_back(
        read_mounted_camera(Map(entry, "cameras", faults), path, preset_folder, names, faults));
  for (const Node& entry : root.list("stereo", Need::Optional))
    scene.stereo.push_back(
        read_stereo_pair(Map(entry, "stereo", faults), scene.cameras, names, faults));
  if (!scene.lidars.empty() || !scene.cameras.empty()) return;
  const Node* const lidars = root.find("lidars", Need::Optional);
  const bool is_list = lidars && lidars->kind == Node::Kind::List;
  if (lidars && !is_list) return;  // already reported
  faults.add(is_list ? *lidars : root.node(), "lidars",
             "{}, but a scene needs at least one lidar or camera",
             is_list ? "is an empty list" : "missing");
}

}  // namespace groundray::yaml
