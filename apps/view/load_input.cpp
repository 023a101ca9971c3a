#include "apps/view/load_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>

#include "apps/scene/interruption.h"
#include "apps/scene/readers/scene_reader.h"
#include "apps/view/layers/cloud_layer.h"
#include "apps/view/layers/dem_layer.h"
#include "apps/view/layers/mesh_layer.h"
#include "apps/view/layers/scene_layers.h"
#include "apps/view/rendering/picture_file.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/ply_faces.h"
#include "core/model/mesh_reader.h"
#include "core/near_names.h"
#include "terrain/dem/band_file.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

bool is_one_of(const std::string& text, std::initializer_list<std::string_view> words) {
  return std::ranges::find(words, text) != words.end();
}

InputKind kind_of_raster(const fs::path& path) {
  try {
    return inspect_raster(path).is_picture ? InputKind::Picture : InputKind::Dem;
  } catch (const Error& fault) {
    throw Error(
        "{}: it cannot be shown: it is not a scene (.yaml), a dataset's folder, a mesh (.ply, "
        ".obj, .stl, .gltf, .glb), a cloud (.ply, .pcd, .npy, .npz, .bin, .las, .laz, .mcap), a "
        "picture (.png, .jpg, .exr, .hdr), or a DEM ({})",
        path.string(), fault.what());
  }
}

void stop_if_asked(const std::stop_token& stop) {
  if (stop.stop_requested()) throw Interrupted{};
}

void check_size(const fs::path& path, const OpenLimits& limits) {
  std::error_code fault;
  const auto bytes = fs::file_size(path, fault);
  if (fault || bytes <= limits.file_bytes) return;
  throw Error("{}: {:.1f} GB exceed the limit of {:.1f} GB: thin it out or split it first",
              path.string(), static_cast<double>(bytes) / 1e9,
              static_cast<double>(limits.file_bytes) / 1e9);
}

// Floats could hold larger coordinates, but the picture would be empty. Meshes have the same limit.
void check_places(const Layer& layer, const fs::path& path) {
  constexpr double most_m = 1e15;
  const std::span<const float> at = coordinates(*layer.data);
  std::array<bool, 3> is_near{true, true, true};
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double origin = layer.origin_w_m[static_cast<glm::length_t>(i % 3)];
    is_near[i % 3] &= std::abs(origin + static_cast<double>(at[i])) <= most_m;
  }
  if (is_near[0] && is_near[1] && is_near[2]) return;
  throw Error("{}: a point in '{}' is more than {:g} m from the origin: does it mark missing data?",
              path.string(), layer.name, most_m);
}

// Loads a world as load_simulation(), but stops on request.
Simulation load_until(const fs::path& scene, const std::stop_token& stop) {
  SceneSpec spec = load_scene(scene, data_folder() / "sensors");
  stop_if_asked(stop);
  Certifying progress;
  return build_simulation(std::move(spec), [&](double share) {
    stop_if_asked(stop);
    progress.update(share);
  });
}

void open_scene(Opened& opened, const OpenLimits& limits, const std::stop_token& stop) {
  auto simulation = std::make_shared<const Simulation>(load_until(opened.path, stop));
  stop_if_asked(stop);
  opened.simulation = simulation;
  opened.look = look_at_platform(*simulation);
  opened.follower = std::make_shared<TerrainFollower>(simulation, TerrainDrawing{}, stop);
  stop_if_asked(stop);
  FollowedTerrain terrain = opened.follower->follow(opened.look->from_w_m);
  stop_if_asked(stop);
  opened.layers.push_back(std::move(terrain.layer));
  const glm::dvec3 middle_m = middle_of_run(*simulation);
  for (Layer& layer : object_layers(*simulation, first_frame(*simulation).begin, middle_m,
                                    limits.objects_triangles))
    opened.layers.push_back(std::move(layer));
  for (Layer& layer : sensor_layers(*simulation)) opened.layers.push_back(std::move(layer));
}

void name_label_categories(Layer& layer, const RecordedNames& names) {
  for (LayerColumn& column : layer.columns) {
    if (column.name != "label" && column.name != "second_label") continue;
    for (auto& [kind, name] : column.categories) {
      const auto found = names.labels.find(static_cast<std::uint32_t>(kind));
      if (found != names.labels.end()) name = found->second;
    }
  }
}

void open_dataset(Opened& opened, const std::stop_token& stop) {
  // Absolute, because the last component becomes the dataset's name: that of "." would be empty.
  opened.path = fs::absolute(opened.path);
  if (!fs::is_directory(opened.path)) opened.path = opened.path.parent_path();
  opened.path = (opened.path / "").lexically_normal().parent_path();
  opened.dataset = std::make_shared<const RecordedDataset>(read_dataset(opened.path));
  opened.run = std::make_shared<const RecordedRun>(read_recorded_run(opened.path));
  for (const RecordedLidar& lidar : opened.dataset->lidars) {
    if (lidar.frames.empty()) continue;
    stop_if_asked(stop);
    Layer layer = scan_layer(*opened.dataset, lidar, lidar.frames.front(), "lidar/" + lidar.name);
    name_label_categories(layer, opened.run->names);
    if (!opened.look) {
      const Pose X_DS = lidar.X_DS.pose_at(lidar.X_DS.begin_time());
      opened.look = look_at(X_DS.translation_m + opened.dataset->georeference.origin_w_m,
                            X_DS.rotation * glm::dvec3(1, 0, 0), 30);
    }
    opened.layers.push_back(std::move(layer));
  }
  for (Layer& layer : sensor_layers(*opened.run)) opened.layers.push_back(std::move(layer));
}

void open_mesh(Opened& opened, const OpenLimits& limits) {
  check_size(opened.path, limits);
  StoredMesh file;
  if (file_ending(opened.path) == ".ply") {
    file = read_stored_mesh(opened.path);
  } else {
    static_cast<MeshFile&>(file) = read_mesh(opened.path);
  }
  Layer layer = mesh_layer(opened.path.filename().string(), file.mesh, file.georeference.origin_w_m,
                           file.vertices);
  if (file.dropped > 0)
    opened.notes.push_back(fmt::format("{} broken triangles omitted", file.dropped));
  if (file.skipped > 0)
    opened.notes.push_back(fmt::format("{} points, lines or patches omitted", file.skipped));
  limit_triangles(layer, limits.triangles);
  if (!file.georeference.crs_name.empty()) layer.facts.push_back(file.georeference.crs_name);
  opened.layers.push_back(std::move(layer));
}

// Returns the truth of a scan's points in D, columns world_x_m, world_y_m and world_z_m; empty if
// it lacks them.
std::vector<glm::dvec3> true_positions(const PointCloud& table) {
  std::vector<glm::dvec3> points(table.rows());
  for (glm::length_t k = 0; k < 3; ++k) {
    const std::string name = fmt::format("world_{}_m", "xyz"[k]);
    if (!table.has(name)) return {};
    const auto column = std::ranges::find(table.columns(), name, &PointCloud::Column::name);
    std::visit(
        [&](const auto& values) {
          for (std::size_t i = 0; i < values.size(); ++i)
            points[i][k] = static_cast<double>(values[i]);
        },
        column->values);
  }
  return points;
}

// Transforms the points of an exported scan from S to D. One pose does not suffice for a sensor
// that moves during the scan.
// @return method, as a fact of the layer.
std::string place_scan(const ScanPlace& place, const PointCloud& table, CloudContent& content) {
  content.origin_w_m = place.origin_w_m;
  if (std::vector<glm::dvec3> p_DQ_m = true_positions(table); !p_DQ_m.empty()) {
    content.p_m = std::move(p_DQ_m);
    return "placed by world_x_m, world_y_m, world_z_m: the true points, without noise";
  }
  for (glm::dvec3& p_m : content.p_m) p_m = place.X_DS * p_m;
  return "placed by X_DS, the sensor's pose at the stamp";
}

void open_cloud(Opened& opened, const OpenLimits& limits) {
  check_size(opened.path, limits);
  const CloudFile file = read_cloud(opened.path, {});
  CloudContent content{.name = opened.path.filename().string(),
                       .p_m = positions_of(file.cloud),
                       .most_points = limits.points};
  if (content.p_m.empty())
    throw Error("{}: {}: a cloud needs points with columns x, y and z", opened.path.string(),
                file.cloud.rows() == 0 ? "it has no point" : "no columns x, y, z");
  std::string placing;
  if (file.place) placing = place_scan(*file.place, file.cloud, content);
  Layer layer = cloud_layer(content, file.cloud);
  if (layer.points() == 0)
    throw Error("{}: none of its {} points has a finite position", opened.path.string(),
                content.p_m.size());
  layer.facts.push_back(file.form);
  if (!placing.empty()) layer.facts.push_back(placing);
  for (const std::string& unread : file.unread) opened.notes.push_back(unread);
  opened.layers.push_back(std::move(layer));
}

void open_dem(Opened& opened, const OpenLimits& limits, const std::stop_token& stop) {
  const std::string name = opened.path.filename().string();
  const RasterKind kind = inspect_raster(opened.path);
  if (kind.is_geographic)
    opened.notes.emplace_back("in degrees: reprojected to the UTM zone of its centre");
  if (kind.bands > 1 && kind.is_geographic)
    opened.notes.push_back(fmt::format(
        "of its {} bands the first is shown: reproject it to metres to see all", kind.bands));
  if (kind.bands > 1 && !kind.is_geographic) {
    opened.layers.push_back(dem_layer(name, opened.path, limits.triangles / 2));
    return;
  }
  opened.follower = std::make_shared<TerrainFollower>(opened.path, TerrainDrawing{}, stop);
  stop_if_asked(stop);
  FollowedTerrain terrain = opened.follower->follow(opened.follower->overview_w_m());
  if (terrain.triangles == 0)
    throw Error("{}: no three neighbouring samples have heights", opened.path.string());
  opened.layers.push_back(std::move(terrain.layer));
}

void open_picture(Opened& opened) {
  const auto file = std::make_shared<const PictureFile>(read_picture(opened.path));
  opened.notes = file->notes;
  opened.picture = std::shared_ptr<const Image8>(file, &file->picture);
  const Image8& picture = *opened.picture;
  opened.layers.push_back(picture_layer(opened.path.filename().string(), file));
  const glm::dvec3 centre(picture.width() / 2.0, picture.height() / 2.0, 0);
  const double back = 2.1 * std::max<double>(picture.height(), 0.75 * picture.width());
  opened.look = Look{centre + glm::dvec3(0, 0, back), centre, {0, 1, 0}};
}

}  // namespace

InputKind kind_of(const fs::path& path) {
  std::error_code fault;
  const fs::file_status status = fs::status(path, fault);
  // GDAL's virtual paths, e.g. into archives, do not exist as files.
  if (!fs::exists(status) && !path.string().starts_with("/vsi"))
    throw Error("{}: {}", path.string(), why_no_file(path));
  if (fs::is_directory(status)) {
    if (fs::exists(path / "dataset.yaml")) return InputKind::Dataset;
    throw Error("{}: the folder is not a dataset: it has no dataset.yaml", path.string());
  }
  if (path.filename() == "dataset.yaml") return InputKind::Dataset;
  const std::string end = file_ending(path);
  if (is_one_of(end, {".yaml", ".yml"})) return InputKind::Scene;
  if (end == ".ply") return has_faces(path) ? InputKind::Mesh : InputKind::Cloud;
  if (is_one_of(end, {".obj", ".stl", ".gltf", ".glb"})) return InputKind::Mesh;
  if (is_one_of(end, {".pcd", ".npy", ".npz", ".bin", ".las", ".laz", ".mcap", ".e57"}))
    return InputKind::Cloud;
  if (is_one_of(end, {".png", ".jpg", ".jpeg", ".exr", ".hdr"})) return InputKind::Picture;
  return kind_of_raster(path);
}

Opened open_any(const fs::path& path, const OpenLimits& limits, const std::stop_token& stop) {
  Opened opened{.kind = kind_of(path), .path = path};
  try {
    switch (opened.kind) {
      case InputKind::Scene:
        open_scene(opened, limits, stop);
        break;
      case InputKind::Dataset:
        open_dataset(opened, stop);
        break;
      case InputKind::Mesh:
        open_mesh(opened, limits);
        break;
      case InputKind::Cloud:
        open_cloud(opened, limits);
        break;
      case InputKind::Dem:
        open_dem(opened, limits, stop);
        break;
      case InputKind::Picture:
        open_picture(opened);
        break;
    }
  } catch (const std::bad_alloc&) {
    throw Error("{}: there is not enough memory: thin it out or split it first", path.string());
  }
  stop_if_asked(stop);
  for (const Layer& layer : opened.layers) {
    check_places(layer, path);
    for (const std::string& fact : layer.facts) {
      if (fact.starts_with("thinned") || fact.starts_with("shown with"))
        opened.notes.push_back(fmt::format("{}: {}", layer.name, fact));
    }
  }
  return opened;
}

bool place_input(Opened& opened, const FrameOrigin& origin) {
  if (opened.kind != InputKind::Mesh && opened.kind != InputKind::Cloud) return false;
  Layer& layer = opened.layers.front();
  const bool is_named =
      origin.input == opened.path.string() || origin.input == opened.path.filename().string();
  if (!is_named && (!origin.input.empty() || layer.frame_w_m != glm::dvec3(0))) return false;
  move_frame(layer, origin.origin_w_m);
  return true;
}

Layer scan_layer(const RecordedDataset& dataset, const RecordedLidar& lidar,
                 const RecordedFrame& frame, const std::string& name) {
  const CloudFile file = read_cloud(frame.file, {});
  CloudContent content{
      .name = name, .p_m = positions_of(file.cloud), .origin_w_m = dataset.georeference.origin_w_m};
  if (content.p_m.empty() && file.cloud.rows() > 0)
    throw Error("{}: it has no columns x, y, z", frame.file.string());
  PointCloud table = file.cloud;
  std::span<float> range_m;
  if (!table.has("range")) range_m = table.add<float>("range");
  const bool moves = lidar.points == LidarSpec::Points::AsFired && table.has("time");
  const std::span<const float> time_s =
      moves ? table.column<float>("time") : std::span<const float>();
  for (std::size_t i = 0; i < content.p_m.size(); ++i) {
    if (!range_m.empty()) range_m[i] = static_cast<float>(glm::length(content.p_m[i]));
    const auto after =
        moves ? time_of(static_cast<double>(time_s[i])) : std::chrono::nanoseconds(0);
    const auto time =
        std::clamp(frame.stamp + after, lidar.X_DS.begin_time(), lidar.X_DS.end_time());
    content.p_m[i] = lidar.X_DS.pose_at(time) * content.p_m[i];
  }
  Layer layer = cloud_layer(content, table);
  check_places(layer, frame.file);
  layer.coloured_by = "range";
  layer.point_size_px = 3;
  return layer;
}

}  // namespace groundray
