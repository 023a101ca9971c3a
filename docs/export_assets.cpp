// Writes one asset of each kind for draw_assets.py: OUT/<kind>.ply with a linear colour for each
// face, and OUT/<kind>.rgba, the one image that some of the faces wear. See draw_assets.py. Also
// writes OUT/<kind>_walk_<i>.ply, half a stride of those that walk, for draw_walk.py.
#include <fmt/format.h>
#include <fmt/os.h>

#include <chrono>
#include <cstddef>
#include <fstream>
#include <string>
#include <string_view>

#include "terrain/assets/asset.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/figure.h"

namespace {

using groundray::Model;

void write_model(const std::string& stem, const Model& model) {
  auto ply = fmt::output_file(stem + ".ply");
  ply.print("ply\nformat ascii 1.0\nelement vertex {}\n", model.mesh.vertices_m.size());
  ply.print("property float x\nproperty float y\nproperty float z\n");
  ply.print("property float s\nproperty float t\n");
  ply.print("element face {}\n", model.mesh.triangles.size());
  ply.print("property list uchar uint vertex_indices\nproperty float red\n");
  ply.print("property float green\nproperty float blue\nproperty uchar image\nend_header\n");
  for (std::size_t i = 0; i < model.mesh.vertices_m.size(); ++i) {
    const glm::dvec3& p = model.mesh.vertices_m[i];
    const glm::vec2 uv = model.uv.empty() ? glm::vec2(0) : model.uv[i];
    ply.print("{} {} {} {} {}\n", p.x, p.y, p.z, uv.x, uv.y);
  }
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    const glm::uvec3& t = model.mesh.triangles[i];
    const groundray::ModelSurface& surface = model.surfaces[model.surface_of[i]];
    ply.print("3 {} {} {} {} {} {} {}\n", t.x, t.y, t.z, surface.color.r, surface.color.g,
              surface.color.b, surface.albedo.exists() ? 1 : 0);
    if (!surface.albedo.exists() || (i > 0 && model.surface_of[i] == model.surface_of[i - 1])) {
      continue;
    }
    const auto values = surface.albedo.pixels.values();
    std::ofstream(stem + ".rgba", std::ios::binary)
        .write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(values.size()));
  }
}

void write_walk(const std::string& folder, groundray::AssetKind kind, double speed_m_s,
                std::chrono::milliseconds stride) {
  using namespace std::chrono_literals;
  const groundray::Trajectory path({{0s, {}}, {10s, {{1, 0, 0, 0}, {10 * speed_m_s, 0, 0}}}});
  const auto parts = groundray::walk([](const glm::dvec2&) { return 0; }, {{.kind = kind}}, path);
  for (int i = 0; i < 4; ++i) {
    groundray::AssetBuilder builder;
    for (std::size_t part = 0; part < parts.size(); ++part)
      builder.append(groundray::make_figure_part({.kind = kind}, part),
                     parts[part].pose_at(5s + i * stride / 8));
    write_model(fmt::format("{}/{}_walk_{}", folder, groundray::asset_name(kind), i),
                builder.model());
  }
}

}  // namespace

int main(int, char** arguments) {
  for (const std::string_view name : groundray::asset_names()) {
    groundray::AssetSpec spec{.kind = groundray::asset_kind(name)};
    if (spec.kind == groundray::AssetKind::Wire) spec.size_m = 5, spec.sag_m = 0.8;
    if (spec.kind == groundray::AssetKind::Fence) spec.size_m = 8.5;
    if (spec.kind == groundray::AssetKind::CalibrationBoard) spec.square_m = 0.1;
    if (spec.kind >= groundray::AssetKind::Spruce && spec.kind <= groundray::AssetKind::Bush) {
      spec.leaves = groundray::LeafModel::Geometry;
      spec.detail = 0.25;
    }
    const Model model = groundray::make_asset(spec);
    write_model(fmt::format("{}/{}", arguments[1], name), model);
    const groundray::FoliageArea area = groundray::foliage_area(model);
    fmt::print("{:18} {:6} triangles, {:6.2f} m2 of leaves, index {:.2f}\n", name,
               model.mesh.triangles.size(), area.leaf_m2, area.index());
  }
  using std::chrono::milliseconds;
  write_walk(arguments[1], groundray::AssetKind::Person, 1.37, milliseconds(1030));
  write_walk(arguments[1], groundray::AssetKind::Deer, 1, milliseconds(1212));
}
