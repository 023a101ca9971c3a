#include "apps/golden/compare/subject.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/ply_faces.h"

namespace groundray::golden {
namespace {

namespace fs = std::filesystem;

/// Returns the kind by the file name, or nothing if the extension is unknown.
std::optional<Subject> told_subject_of(const fs::path& file) {
  const std::string ending = file_ending(file);
  const auto is_one_of = [&](std::initializer_list<std::string_view> endings) {
    return std::ranges::find(endings, ending) != endings.end();
  };
  if (ending == ".ply") return has_faces(file) ? Subject::Mesh : Subject::Scan;
  if (is_one_of({".pcd", ".npy", ".npz", ".bin", ".las", ".laz", ".mcap", ".e57"}))
    return Subject::Scan;
  if (is_one_of({".exr", ".png", ".hdr", ".jpg", ".jpeg", ".flo", ".pfm"})) return Subject::Image;
  if (is_one_of({".obj", ".glb", ".gltf", ".stl"})) return Subject::Mesh;
  if (is_one_of({".tif", ".tiff", ".asc", ".hgt", ".vrt", ".img", ".nc", ".dem"}))
    return Subject::Dem;
  return std::nullopt;
}

std::string_view name_of(Subject subject) {
  static constexpr std::array<std::string_view, 4> names{"a scan", "an image", "a DEM", "a mesh"};
  return names[static_cast<std::size_t>(subject)];
}

}  // namespace

Subject subject_of(const fs::path& file) {
  if (const auto told = told_subject_of(file)) return *told;
  throw Error("{}: the name does not show the kind of file; give it with --as", file.string());
}

Subject subject_of(const fs::path& reference, const fs::path& other) {
  const Subject subject = subject_of(reference);
  const Subject of_other = told_subject_of(other).value_or(subject);
  if (of_other == subject) return subject;
  throw Error(
      "{} seems to be {} and {} {}: both must be of the same kind; if they are, give it with --as",
      reference.string(), name_of(subject), other.string(), name_of(of_other));
}

}  // namespace groundray::golden
