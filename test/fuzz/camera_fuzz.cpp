#include <cstddef>
#include <cstdint>
#include <string>

#include "apps/scene/calibration/camera_calibration.h"
#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "sensors/camera/lens/lens.h"

// For any bytes, the readers of cameras and calibrations return a result or throw Error, and a lens
// that is read either images the rays of its pixels or reports none: no crash, no hang.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const groundray::CameraSpec camera = groundray::parse_camera(text, "camera.yaml");
    const groundray::Lens lens(camera.lens, camera.size_px);
    if (const auto ray = lens.ray({0, 0})) lens.project(ray->direction);
  } catch (const groundray::Error&) {
  }
  try {
    groundray::parse_camera_calibrations(text, "calibration");
  } catch (const groundray::Error&) {
  }
  return 0;
}
