#include <cstddef>
#include <cstdint>
#include <string>

#include "core/error.h"
#include "core/model/polygon_soup.h"

/// For any bytes, read_stl returns a model whose indices are valid, or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const groundray::PolygonSoup soup =
        groundray::read_stl("fuzz.stl", std::string(reinterpret_cast<const char*>(data), size));
    groundray::ModelFaults faults;
    const groundray::Model model = groundray::model_of(soup, faults);
    const std::size_t vertices = model.mesh.vertices_m.size();
    for (const glm::uvec3& t : model.mesh.triangles)
      if (t.x >= vertices || t.y >= vertices || t.z >= vertices) __builtin_trap();
  } catch (const groundray::Error&) {
  }
  return 0;
}
