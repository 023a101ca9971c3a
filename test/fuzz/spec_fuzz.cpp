#include <cstddef>
#include <cstdint>
#include <string>

#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"

// For any bytes, reading them as a scene or a lidar yields a spec or an Error: no crash, no hang.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    groundray::parse_scene(text, "scene.yaml", "data/sensors");
  } catch (const groundray::Error&) {
  }
  try {
    groundray::parse_lidar(text, "lidar.yaml");
  } catch (const groundray::Error&) {
  }
  return 0;
}
