#include "apps/groundray/describe/file_facts.h"

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>

#include "core/io/file_io.h"
#include "core/io/ply_faces.h"

namespace groundray {

namespace fs = std::filesystem;

std::optional<FileKind> file_kind_of(const fs::path& file) {
  if (fs::exists(file / "metadata.yaml")) return FileKind::Bag;
  const std::string ending = file_ending(file);
  const auto is_one_of = [&](std::initializer_list<std::string_view> endings) {
    return std::ranges::find(endings, ending) != endings.end();
  };
  if (ending == ".ply") return has_faces(file) ? FileKind::Mesh : FileKind::Cloud;
  if (is_one_of({".obj", ".stl", ".gltf", ".glb"})) return FileKind::Mesh;
  if (is_one_of({".pcd", ".npy", ".npz", ".bin", ".las", ".laz", ".e57", ".pcap", ".osf"}))
    return FileKind::Cloud;
  if (is_one_of({".png", ".jpg", ".jpeg", ".exr", ".hdr"})) return FileKind::Image;
  if (is_one_of({".mcap", ".db3", ".bag"})) return FileKind::Bag;
  return std::nullopt;
}

Facts facts_of(const fs::path& file, FileKind kind) {
  switch (kind) {
    case FileKind::Mesh:
      return mesh_facts(file);
    case FileKind::Cloud:
      return cloud_facts(file);
    case FileKind::Image:
      return image_facts(file);
    case FileKind::Bag:
      break;
  }
  return bag_facts(file);
}

}  // namespace groundray
