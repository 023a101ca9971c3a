#include "apps/scan/cloud_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <utility>

#include "apps/scan/column_names.h"
#include "apps/scan/python_module.h"
#include "apps/scene/interruption.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/memory.h"
#include "core/io/npy_io.h"
#include "core/io/pcd_reader.h"
#include "core/io/ply_io.h"
#include "core/near_names.h"

namespace groundray {
namespace {

using Names = std::vector<std::string>;

std::string lower(std::string text) {
  for (char& c : text) {
    if ('A' <= c && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

/// Returns names for `count` columns without names.
Names names_for(std::size_t count, const Names& asked) {
  if (!asked.empty()) {
    if (asked.size() == count) return asked;
    throw Error("its points have {} numbers; {} columns are named: {}", count, asked.size(),
                fmt::join(asked, ", "));
  }
  if (count < 3) throw Error("its points have {} numbers; at least x, y and z are needed", count);
  Names names{"x", "y", "z", "intensity"};
  names.resize(std::min<std::size_t>(count, 4));
  for (std::size_t i = names.size(); i < count; ++i)
    names.push_back(fmt::format("number {}", i + 1));
  return names;
}

/// Copies the columns of `from` under new names; omits those with an empty name.
void take_columns(const PointCloud& from, const std::vector<ColumnOrigin>& origins,
                  const Names& names, CloudFile& to) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i].empty()) continue;
    const PointCloud::Column& column = from.columns()[i];
    const auto copy = [&](const auto& values) {
      using T = typename std::decay_t<decltype(values)>::value_type;
      std::ranges::copy(values, to.cloud.add<T>(names[i]).begin());
    };
    std::visit(copy, column.values);
    for (const ColumnOrigin& origin : origins) {
      if (origin.column == column.name) to.origins.push_back({names[i], origin.origin});
    }
  }
}

CloudFile of_ply(std::string_view bytes, const std::string& name) {
  return {.form = "PLY", .cloud = parse_ply(bytes, name).cloud};
}

CloudFile of_pcd(std::string_view bytes, const std::string& name) {
  PcdFile file = parse_pcd(bytes, name);
  return {
      .form = file.height > 1 ? fmt::format("PCD, {} x {} points", file.width, file.height) : "PCD",
      .cloud = std::move(file.cloud),
      .origins = std::move(file.origins),
      .X_FS = file.X_FS,
      .image = file.height > 1 ? ImageLayout{file.height, file.width} : ImageLayout{}};
}

/// Returns the names of an array's columns in a cloud.
Names names_of(const NpyArray& array, const Names& asked) {
  if (array.is_structured) {
    Names names;
    for (const auto& column : array.cloud.columns()) names.push_back(column.name);
    return names;
  }
  return names_for(array.cloud.columns().size(), asked);
}

CloudFile of_npy(const NpyArray& array, const Names& asked) {
  CloudFile file{.form = "NumPy array", .cloud = PointCloud(array.cloud.rows())};
  take_columns(array.cloud, array.origins, names_of(array, asked), file);
  if (array.shape.size() == 3) file.image = {array.shape[0], array.shape[1]};
  for (const std::string& field : array.unread) {
    file.unread.push_back(fmt::format("{} (no numbers)", field));
  }
  return file;
}

bool holds_points(const NpyArray& array) {
  static constexpr std::array<std::string_view, 14> names{
      "xyz",    "points", "point", "positions",  "position", "pos",         "cloud",
      "coords", "pcd",    "p_s",   "pointcloud", "vertices", "point_cloud", "arr_0"};
  return std::ranges::find(names, lower(array.name)) != names.end() && array.shape.size() > 1;
}

/// Returns the number of rows of a cloud, which consists of all arrays of that length: that of the
/// first array that holds points or is called x.
std::size_t rows_of(const NpzFile& file) {
  for (const NpyArray& array : file.arrays) {
    if (array.is_structured || holds_points(array) || find_column({array.name}, "x")) {
      return array.cloud.rows();
    }
  }
  Names names;
  for (const NpyArray& array : file.arrays) names.push_back(array.name);
  throw Error(
      "none of its arrays contains points: name one xyz (n x 3), or three x, y, z; it has: {}",
      fmt::join(names, ", "));
}

void list_unread(const NpzFile& arrays, CloudFile& file) {
  for (const auto& [name, why] : arrays.unread) {
    file.unread.push_back(fmt::format("{} ({})", name, why));
  }
}

/// Returns the numbers of an array of that name and shape, in C order; empty if there is none.
std::vector<double> numbers_of(const NpzFile& file, std::string_view name,
                               const std::vector<std::uint64_t>& shape) {
  const auto found = std::ranges::find(file.arrays, name, &NpyArray::name);
  if (found == file.arrays.end() || found->is_structured || found->shape != shape) return {};
  const PointCloud& table = found->cloud;
  std::vector<double> numbers(table.rows() * table.columns().size());
  for (std::size_t k = 0; k < table.columns().size(); ++k) {
    const auto copy = [&](const auto& values) {
      for (std::size_t i = 0; i < values.size(); ++i)
        numbers[i * table.columns().size() + k] = static_cast<double>(values[i]);
    };
    std::visit(copy, table.columns()[k].values);
  }
  return numbers;
}

constexpr std::string_view pose_name = "X_DS", origin_name = "origin_w_m";

/// Returns the place that groundray-export writes; nothing if there is none, or if it is not a
/// rigid transformation with a finite origin.
std::optional<ScanPlace> place_of(const NpzFile& file) {
  const std::vector<double> pose = numbers_of(file, pose_name, {4, 4});
  if (pose.empty()) return std::nullopt;
  const std::vector<double> origin = numbers_of(file, origin_name, {3});
  constexpr double tolerance = 1e-6;
  const glm::dmat4 matrix = glm::transpose(glm::make_mat4(pose.data()));  // stored row by row
  const glm::dmat3 rotation(matrix);
  const glm::dmat3 excess = glm::transpose(rotation) * rotation - glm::dmat3(1);
  bool is_rigid = std::abs(glm::determinant(rotation) - 1) <= tolerance &&
                  glm::row(matrix, 3) == glm::dvec4(0, 0, 0, 1);
  for (glm::length_t k = 0; k < 3; ++k) is_rigid &= glm::length(excess[k]) <= tolerance;
  ScanPlace place{
      .X_DS = {.rotation = glm::quat_cast(rotation), .translation_m = glm::dvec3(matrix[3])}};
  if (!origin.empty()) place.origin_w_m = {origin[0], origin[1], origin[2]};
  const glm::dvec3 sum_m = place.X_DS.translation_m + place.origin_w_m;
  if (!is_rigid || !std::isfinite(sum_m.x + sum_m.y + sum_m.z)) return std::nullopt;
  return place;
}

CloudFile of_npz(const NpzFile& arrays, const Names& asked) {
  if (arrays.arrays.size() == 1) {
    CloudFile file = of_npy(arrays.arrays[0], asked);
    list_unread(arrays, file);
    return file;
  }
  CloudFile file{.form = "NumPy archive", .cloud = PointCloud(rows_of(arrays))};
  file.place = place_of(arrays);
  for (const NpyArray& array : arrays.arrays) {
    if (file.place && (array.name == pose_name || array.name == origin_name)) continue;
    if (array.cloud.rows() != file.cloud.rows()) {
      file.unread.push_back(fmt::format("{} (of {} rows)", array.name, array.cloud.rows()));
      continue;
    }
    Names names;
    if (array.is_structured || holds_points(array)) {
      names = names_of(array, asked);
      if (array.shape.size() == 3) file.image = {array.shape[0], array.shape[1]};
    } else if (array.shape.size() < 2) {
      names = {array.name};
    } else {
      for (std::size_t i = 0; i < array.cloud.columns().size(); ++i) {
        names.push_back(fmt::format("{}_{}", array.name, i));
      }
    }
    take_columns(array.cloud, array.origins, names, file);
  }
  list_unread(arrays, file);
  return file;
}

CloudFile of_floats(std::string_view bytes, const Names& asked) {
  const Names names = asked.empty() ? Names{"x", "y", "z", "intensity"} : asked;
  const std::size_t point_bytes = names.size() * sizeof(float);
  if (bytes.size() % point_bytes != 0) {
    throw Error(
        "its {} bytes are not a multiple of {}, for points of {} floats ({}): if the columns "
        "differ, name them (--columns; for the reference, --reference-columns)",
        bytes.size(), point_bytes, names.size(), fmt::join(names, ", "));
  }
  CloudFile file{.form = fmt::format("KITTI's, {} floats a point", names.size()),
                 .cloud = PointCloud(bytes.size() / point_bytes)};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i].empty()) continue;
    add_column(file.cloud, names[i], {bytes.data() + i * sizeof(float), point_bytes}, file.origins);
  }
  return file;
}

/// Throws an Error that suggests how to convert a file in an unsupported format.
[[noreturn]] void refuse(const std::string& ending) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 8> others{
      {{".las", "LAS can only be read from a file, not from memory"},
       {".laz", "LAZ can only be read from a file, not from memory"},
       {".mcap", "MCAP can only be read from a file, not from memory"},
       {".e57", "E57 is not read: save it as PLY by CloudCompare, or by pye57 and plyfile"},
       {".pcap", "packets are not read: decode them to PLY or PCD by the sensor's own tools"},
       {".bag", "ROS bags are not read: save the messages as PCD, as pcl_ros' bag_to_pcd does"},
       {".db3", "ROS bags are not read: save the messages as PCD, as pcl_ros' bag_to_pcd does"},
       {".osf", "OSF is not read: save the scan as PLY or PCD by ouster-cli"}}};
  for (const auto& [other, advice] : others) {
    if (ending == other) throw Error("{}", advice);
  }
  throw Error(
      "the extension {:?} is not one of the supported point files: .ply, .pcd, .npy, .npz, .bin, "
      ".las, .laz, .mcap",
      ending);
}

/// Reads a file through groundray's Python package, whose module prints a line with the name of the
/// format and then a NumPy array.
CloudFile read_by_python(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) throw Error("{}: {}", path.string(), why_no_file(path));
  const std::string printed =
      run_python_module("groundray.foreign.cloud", {std::filesystem::absolute(path).string()}, path,
                        {.most_bytes = available_memory_bytes() / 2, .check = stop_if_interrupted});
  const std::size_t end = std::min(printed.find('\n'), printed.size());
  const std::string_view rest = std::string_view(printed).substr(std::min(end + 1, printed.size()));
  CloudFile file = of_npy(parse_npy(rest, path.string()), {});
  file.form = printed.substr(0, end);
  return file;
}

}  // namespace

CloudFile parse_cloud(std::string_view bytes, const std::string& name,
                      const std::vector<std::string>& columns) {
  const std::string ending = lower(std::filesystem::path(name).extension().string());
  if (ending == ".ply") return of_ply(bytes, name);
  if (ending == ".pcd") return of_pcd(bytes, name);
  const NpyArray array = ending == ".npy" ? parse_npy(bytes, name) : NpyArray{};
  const NpzFile archive = ending == ".npz" ? parse_npz(bytes, name) : NpzFile{};
  try {
    if (ending == ".npy") return of_npy(array, columns);
    if (ending == ".npz") return of_npz(archive, columns);
    if (ending == ".bin") return of_floats(bytes, columns);
    refuse(ending);
  } catch (const Error& rule) {
    throw Error("{}: {}", name, rule.what());
  }
}

CloudFile read_cloud(const std::filesystem::path& path, const std::vector<std::string>& columns) {
  const std::string ending = lower(path.extension().string());
  if (ending == ".las" || ending == ".laz" || ending == ".mcap") return read_by_python(path);
  static constexpr std::array<std::string_view, 5> read{".ply", ".pcd", ".npy", ".npz", ".bin"};
  const bool is_read = std::ranges::find(read, ending) != read.end();
  return parse_cloud(is_read ? read_text(path) : "", path.string(), columns);
}

}  // namespace groundray
