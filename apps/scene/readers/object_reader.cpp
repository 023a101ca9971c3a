#include <utility>

#include "apps/scene/readers/readers.h"
#include "core/error.h"

namespace groundray::yaml {
namespace {

StandingObject read_standing(Map& entry, Faults& faults) {
  StandingObject place;
  if (const Node* const line = entry.find("line_m", Need::Optional)) {
    place.line_m = read_points(entry.list("line_m", Need::Required), "line_m", faults);
    if (line->kind == Node::Kind::List && place.line_m.size() < 2)
      faults.add(*line, "line_m", "has {} points, but a fence needs at least two",
                 place.line_m.size());
    return place;
  }
  entry.read_vector("at_m", Need::Required, place.at_m);
  entry.read_number("height_m", Need::Optional, place.height_m, any_number);
  entry.read_number("yaw_deg", Need::Optional, place.yaw_deg);
  entry.read_number("pitch_deg", Need::Optional, place.pitch_deg);
  entry.read_number("roll_deg", Need::Optional, place.roll_deg);
  read_stance(entry, place.stance);
  return place;
}

// Reads the map `drive` of a platform or object.
DrivenPath read_drive(Map drive, std::span<const TrailSpec> trails, Faults& faults) {
  DrivenPath path;
  const Node* const trail = drive.find("trail", Need::Optional);
  const Node* const waypoints = drive.find("waypoints_m", Need::Optional);
  if (trail != nullptr && waypoints != nullptr)
    faults.add(*trail, "trail", "must not be given together with 'waypoints_m'");
  if (const Node* const at = trail != nullptr ? trail : waypoints) path.where = faults.place(*at);
  if (trail == nullptr) {
    path.waypoints_m = read_waypoints(drive, "drive", faults);
  } else if (const TrailSpec* const along = find_trail(drive, "trail", trails, faults)) {
    path.trail = along->name;
  }
  drive.read_number("from_m", Need::Optional, path.from_m, not_negative);
  drive.read_number("speed_m_s", Need::Required, path.speed_m_s, positive);
  drive.read_number("height_m", Need::Required, path.height_m, not_negative);
  drive.read_vector("footprint_m", Need::Optional, path.footprint_m, positive);
  drive.close();
  return path;
}

std::variant<StandingObject, RecordedPath, DrivenPath> read_place(Map& entry, const fs::path& path,
                                                                  std::span<const TrailSpec> trails,
                                                                  Faults& faults) {
  std::string tum;
  const Node* const recorded = entry.read_text("trajectory", Need::Optional, tum);
  auto drive = entry.map("drive", Need::Optional);
  if (recorded != nullptr && drive)
    faults.add(*recorded, "trajectory", "must not be given together with 'drive'");
  if (recorded != nullptr) return RecordedPath{beside(path, tum), faults.place(*recorded)};
  if (drive) return read_drive(std::move(*drive), trails, faults);
  return read_standing(entry, faults);
}

// Checks that only fences follow a line.
void check_line(Map& entry, const ObjectSpec& object, Faults& faults) {
  const Node* const line = entry.find("line_m", Need::Optional);
  if (line == nullptr) return;
  const auto* const asset = std::get_if<AssetSpec>(&object.model.source);
  if (asset == nullptr || asset->kind != AssetKind::Fence) {
    faults.add(*line, "line_m", "is only for asset: fence; place other objects by at_m");
  } else if (asset->size_m) {
    faults.add(*line, "line_m", "must not be given together with size_m: the line has a length");
  }
  if (!std::holds_alternative<StandingObject>(object.place))
    faults.add(*line, "line_m", "must not be given together with 'trajectory' or 'drive'");
  if (object.scale != 1)
    faults.add(*line, "line_m", "must not be given together with scale: remove one");
}

}  // namespace

std::variant<RecordedPath, DrivenPath> read_platform(Map platform, const fs::path& path,
                                                     std::span<const TrailSpec> trails,
                                                     Faults& faults) {
  std::variant<RecordedPath, DrivenPath> result;
  std::string tum;
  if (const Node* const at = platform.read_text("trajectory", Need::Optional, tum))
    result = RecordedPath{beside(path, tum), faults.place(*at)};
  auto drive = platform.map("drive", Need::Optional);
  const bool recorded = platform.find("trajectory", Need::Optional) != nullptr;
  if (recorded == drive.has_value() && platform.node().kind == Node::Kind::Map) {
    faults.add(platform.node(), "platform", "must have exactly one of 'trajectory' and 'drive'");
  }
  if (drive) result = read_drive(std::move(*drive), trails, faults);
  platform.close();
  return result;
}

std::vector<ObjectSpec> read_objects(Map& root, const fs::path& path, const DataFolders& folders,
                                     std::span<const TrailSpec> trails, Faults& faults) {
  std::vector<ObjectSpec> objects;
  UniqueNames names("object", faults);
  for (const Node& node : root.list("objects", Need::Optional)) {
    Map entry(node, "objects", faults);
    ObjectSpec& object = objects.emplace_back();
    object.where = faults.place(node);
    entry.read_text("name", Need::Required, object.name);
    entry.read_whole("label", Need::Required, object.label);
    entry.read_number("scale", Need::Optional, object.scale, positive);
    object.model = read_model_spec(entry, path, folders, faults);
    object.place = read_place(entry, path, trails, faults);
    check_line(entry, object, faults);
    const bool moves = !std::holds_alternative<StandingObject>(object.place);
    if (const Node* const at = entry.find("sway", Need::Optional); at != nullptr && moves) {
      faults.add(*at, "sway", "'{}' moves along a path, and only objects that stand can sway",
                 object.name);
    }
    entry.close();
    names.add(node, object.name);
  }
  return objects;
}
}  // namespace groundray::yaml
