#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "core/model/mesh_reader.h"

/// For any bytes, parse_stored_mesh returns a mesh with at least one triangle and valid vertex
/// indices, or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const groundray::StoredMesh stored =
        groundray::parse_stored_mesh({reinterpret_cast<const char*>(data), size}, "fuzz.ply");
    const std::size_t vertices = stored.mesh.vertices_m.size();
    bool is_sound = !stored.mesh.triangles.empty() && stored.vertices.rows() == vertices;
    for (const glm::uvec3& t : stored.mesh.triangles)
      is_sound = is_sound && t.x < vertices && t.y < vertices && t.z < vertices;
    if (!is_sound) __builtin_trap();
  } catch (const groundray::Error&) {
  }
  return 0;
}
