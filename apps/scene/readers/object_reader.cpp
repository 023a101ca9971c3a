#include <set>
#include <utility>

#include "apps/scene/readers/readers.h"
#include "core/error.h"

namespace groundray::yaml {
namespace {

// Common arguments of the readers below.
struct Reading {
  const fs::path& path;
  const DataFolders& folders;
  Faults& faults;
};

AssetSpec read_asset(Map& entry, const Node& name, Faults& faults) {
  AssetSpec asset;
  if (!is_text(name, "asset", faults)) return asset;
  try {
    asset.kind = asset_kind(name.text);
  } catch (const Error& fault) {
    faults.add(name, "asset", "{}", fault.what());
  }
  const std::size_t before = faults.count();
  entry.read_number("size_m", Need::Optional, asset.size_m, positive);
  entry.read_number("width_m", Need::Optional, asset.width_m, positive);
  entry.read_number("sag_m", Need::Optional, asset.sag_m, positive);
  entry.read_number("square_m", Need::Optional, asset.square_m, positive);
  entry.read_number("leaf_area_index", Need::Optional, asset.leaf_area_index, positive);
  entry.read_whole("variant", Need::Optional, asset.seed.value);
  entry.read_number("detail", Need::Optional, asset.detail, positive);
  if (faults.count() > before) return asset;
  try {
    check_asset(asset);
  } catch (const Error& fault) {
    faults.add(name, "asset", "it cannot be generated:\n{}", fault.what());
  }
  return asset;
}

DisplacementSource read_displacement(Map map, const Reading& with) {
  DisplacementSource displacement;
  read_path(map, "image", Need::Required, with.path, displacement.image);
  map.read_number("amplitude_m", Need::Required, displacement.amplitude_m, positive);
  map.read_number("middle", Need::Optional, displacement.middle);
  map.read_number("cell_m", Need::Required, displacement.cell_m, positive);
  map.close();
  return displacement;
}

ModelSource read_file_source(Map& entry, const Node& file, const Reading& with) {
  ModelSource source;
  if (is_text(file, "model", with.faults)) source.file = beside(with.path, file.text);
  entry.read_number("metres_per_unit", Need::Optional, source.options.metres_per_unit, positive);
  UpAxis up = UpAxis::Z;
  if (entry.read_choice("up", Need::Optional, up, {"x", "y", "z"})) source.options.up = up;
  entry.read_choice("broken", Need::Optional, source.options.broken, {"refuse", "drop"});
  if (auto map = entry.map("displacement", Need::Optional))
    source.displacement = read_displacement(std::move(*map), with);
  return source;
}

// Reads the keys of an entry that give its model and materials.
ModelSpec read_model_spec(Map& entry, const Reading& with) {
  ModelSpec spec;
  const Node* const asset = entry.find("asset", Need::Optional);
  const Node* const file = entry.find("model", Need::Optional);
  if ((asset == nullptr) == (file == nullptr) && entry.node().kind == Node::Kind::Map)
    with.faults.add(entry.node(), "model", "there must be exactly one of 'asset' and 'model'");
  if (asset != nullptr) {
    spec.source = read_asset(entry, *asset, with.faults);
  } else if (file != nullptr) {
    spec.source = read_file_source(entry, *file, with);
  }
  if (const Node* const node = entry.find("material", Need::Optional))
    spec.material = read_material(*node, "material", with.path, with.folders, with.faults);
  const Node* const materials = entry.find("materials", Need::Optional);
  if (materials == nullptr) return spec;
  const Map names(*materials, "materials", with.faults);
  if (materials->kind != Node::Kind::Map) return spec;
  for (std::size_t i = 0; i + 1 < materials->items.size(); i += 2) {
    const std::string& surface = materials->items[i].text;
    if (auto material =
            read_material(materials->items[i + 1], surface, with.path, with.folders, with.faults))
      spec.materials.emplace(surface, std::move(*material));
  }
  return spec;
}

void read_stance(Map& entry, Stance& stance) {
  entry.read_choice("stance", Need::Optional, stance, {"upright", "on_slope"});
}

StandingObject read_standing(Map& entry) {
  StandingObject place;
  entry.read_vector("at_m", Need::Required, place.at_m);
  entry.read_number("height_m", Need::Optional, place.height_m, any_number);
  entry.read_number("yaw_deg", Need::Optional, place.yaw_deg);
  entry.read_number("pitch_deg", Need::Optional, place.pitch_deg);
  entry.read_number("roll_deg", Need::Optional, place.roll_deg);
  read_stance(entry, place.stance);
  return place;
}

// Reads the map `drive` of a platform or object.
DrivenPath read_drive(Map drive, Faults& faults) {
  DrivenPath path;
  const auto waypoints = drive.list("waypoints_m", Need::Required);
  path.waypoints_m = read_points(waypoints, "waypoints_m", faults);
  if (const Node* at = drive.find("waypoints_m", Need::Optional)) {
    path.where = faults.place(*at);
    if (waypoints.size() < 2)
      faults.add(*at, "waypoints_m", "has {} points, but a drive needs at least two",
                 waypoints.size());
  }
  drive.read_number("speed_m_s", Need::Required, path.speed_m_s, positive);
  drive.read_number("height_m", Need::Required, path.height_m, not_negative);
  drive.read_vector("footprint_m", Need::Optional, path.footprint_m, positive);
  drive.close();
  return path;
}

std::variant<StandingObject, RecordedPath, DrivenPath> read_place(Map& entry, const Reading& with) {
  std::string tum;
  const Node* const recorded = entry.read_text("trajectory", Need::Optional, tum);
  auto drive = entry.map("drive", Need::Optional);
  if (recorded != nullptr && drive)
    with.faults.add(*recorded, "trajectory", "must not be given together with 'drive'");
  if (recorded != nullptr)
    return RecordedPath{beside(with.path, tum), with.faults.place(*recorded)};
  if (drive) return read_drive(std::move(*drive), with.faults);
  return read_standing(entry);
}

Clearing read_clearing(Map entry, Faults& faults) {
  Clearing clearing;
  const bool is_line = entry.find("line_m", Need::Optional) != nullptr;
  const std::string_view key = is_line ? "line_m" : "polygon_m";
  if (!is_line) clearing.shape = Clearing::Shape::Polygon;
  clearing.points_D = read_points(entry.list(key, Need::Required), key, faults);
  entry.read_number("half_width_m", is_line ? Need::Required : Need::Optional,
                    clearing.half_width_m, not_negative);
  entry.close();
  return clearing;
}

void read_models(Map& entry, ScatterLayer& layer, const Reading& with) {
  layer.scatter.weights.clear();
  for (const Node& node : entry.list("models", Need::Required)) {
    Map model(node, "models", with.faults);
    double weight = 1;
    model.read_number("weight", Need::Optional, weight, positive);
    layer.models.push_back(read_model_spec(model, with));
    layer.scatter.weights.push_back(weight);
    model.close();
  }
  const Node* const list = entry.find("models", Need::Optional);
  if (list != nullptr && list->kind == Node::Kind::List && layer.models.empty())
    with.faults.add(*list, "models", "is an empty list, but a layer needs at least one");
}

ScatterLayer read_scatter_layer(Map entry, const Reading& with) {
  ScatterLayer layer;
  entry.read_text("name", Need::Required, layer.name);
  entry.read_whole("label", Need::Required, layer.label);
  read_models(entry, layer, with);
  entry.read_number("density_per_m2", Need::Required, layer.density_per_m2, not_negative);
  read_path(entry, "density_map", Need::Optional, with.path, layer.density_map);
  entry.read_number("nodata", Need::Optional, layer.nodata, any_number);
  ScatterSpec& scatter = layer.scatter;
  entry.read_number("min_distance_m", Need::Optional, scatter.min_distance_m, not_negative);
  read_interval(entry, "slope_deg", scatter.slope_deg, slope_rule, with.faults);
  read_interval(entry, "height_m", scatter.height_m, any_number, with.faults);
  read_interval(entry, "scale", scatter.scale, positive, with.faults);
  read_interval(entry, "yaw_deg", scatter.yaw_deg, any_number, with.faults);
  entry.read_number("sink_m", Need::Optional, scatter.sink_m);
  read_stance(entry, scatter.stance);
  for (const Node& node : entry.list("clearings", Need::Optional))
    scatter.clearings.push_back(read_clearing(Map(node, "clearings", with.faults), with.faults));
  entry.close();
  return layer;
}

// FNV-1a hash of a layer's name. It is the layer's key among random numbers, so that its plants do
// not depend on the other layers.
// @see http://www.isthe.com/chongo/tech/comp/fnv
std::uint32_t hash_of(std::string_view name) {
  std::uint32_t hash = 0x811c9dc5;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x01000193;
  return hash;
}

// Records names that an earlier entry already has.
class UniqueNames {
 public:
  UniqueNames(std::string_view what, Faults& faults) : what_(what), faults_(faults) {}
  void add(const Node& entry, const std::string& name) {
    if (!name.empty() && !names_.insert(name).second)
      faults_.add(entry, "name", "'{}' is taken by an earlier {}: names must differ", name, what_);
  }

 private:
  std::string_view what_;
  Faults& faults_;
  std::set<std::string> names_;
};

}  // namespace

std::variant<RecordedPath, DrivenPath> read_platform(Map platform, const fs::path& path,
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
  if (drive) result = read_drive(std::move(*drive), faults);
  platform.close();
  return result;
}

std::vector<ObjectSpec> read_objects(Map& root, const fs::path& path, const DataFolders& folders,
                                     Faults& faults) {
  const Reading with{path, folders, faults};
  std::vector<ObjectSpec> objects;
  UniqueNames names("object", faults);
  for (const Node& node : root.list("objects", Need::Optional)) {
    Map entry(node, "objects", faults);
    ObjectSpec& object = objects.emplace_back();
    object.where = faults.place(node);
    entry.read_text("name", Need::Required, object.name);
    entry.read_whole("label", Need::Required, object.label);
    entry.read_number("scale", Need::Optional, object.scale, positive);
    object.model = read_model_spec(entry, with);
    object.place = read_place(entry, with);
    entry.close();
    names.add(node, object.name);
  }
  return objects;
}

std::vector<ScatterLayer> read_scatter(Map& root, const fs::path& path, const DataFolders& folders,
                                       Faults& faults) {
  std::vector<ScatterLayer> layers;
  UniqueNames names("layer", faults);
  for (const Node& node : root.list("scatter", Need::Optional)) {
    ScatterLayer layer = read_scatter_layer(Map(node, "scatter", faults), {path, folders, faults});
    layer.where = faults.place(node);
    layer.scatter.layer = hash_of(layer.name);
    names.add(node, layer.name);
    for (const ScatterLayer& other : layers) {
      if (other.scatter.layer == layer.scatter.layer && other.name != layer.name) {
        faults.add(
            node, "name",
            "'{}' has the same hash as '{}', so their random positions would be equal: rename one",
            layer.name, other.name);
      }
    }
    layers.push_back(std::move(layer));
  }
  return layers;
}

}  // namespace groundray::yaml
