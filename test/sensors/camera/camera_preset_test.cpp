#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <string>
#include <vector>

#include "apps/scene/calibration/camera_calibration.h"
#include "apps/scene/readers/scene_reader.h"
#include "sensors/camera/lens/lens.h"
#include "test/support/temporary_folder.h"

namespace groundray::camera_preset_test {
namespace {

using groundray::testing::data_folder;
using groundray::testing::shared_data_folder;

CameraSpec preset(const std::string& name) {
  return load_camera(data_folder() / "sensors" / (name + ".yaml"));
}

std::vector<std::string> names() {
  return preset_names(data_folder() / "sensors", SensorKind::Camera);
}

TEST(CameraPreset, ListIsComplete) {
  EXPECT_THAT(names(), ::testing::ElementsAre(
                           "action_camera", "automotive_2mp3", "euroc_mav_cam0", "euroc_mav_cam1",
                           "fisheye_190", "realsense_d455_color", "tum_vi_cam0", "tum_vi_cam1"));
}

// Largest distance between a pixel and the image of its ray, and the number of pixels without a
// ray.
struct RoundTrip {
  double worst_px = 0;
  std::size_t invalid = 0;
};

RoundTrip round_trip(const Lens& lens) {
  const glm::ivec2 size = lens.size_px();
  RoundTrip result;
  std::vector<PixelRay> rays(static_cast<std::size_t>(size.x * size.y));
  lens.fill(0, size.y, rays);
  for (int i = 0; i < size.x * size.y; ++i) {
    const glm::dvec3& direction = rays[static_cast<std::size_t>(i)].direction;
    if (direction == glm::dvec3(0)) {
      ++result.invalid;
      continue;
    }
    const auto pixel = lens.project(direction);
    const double off_px = pixel ? glm::distance(*pixel, glm::dvec2(i % size.x, i / size.x)) : 1e9;
    result.worst_px = std::max(result.worst_px, off_px);
  }
  return result;
}

TEST(CameraPreset, ProjectsTheRayOfEachPixelToThePixel) {
  for (const std::string& name : names()) {
    const CameraSpec camera = preset(name);
    const RoundTrip result = round_trip(Lens(camera.lens, camera.size_px));
    EXPECT_LE(result.worst_px, 1e-9) << name;  // the accuracy that Lens guarantees
    EXPECT_EQ(result.invalid, 0u) << name;
  }
}

double field_of_view_deg(const CameraSpec& camera) {
  const Lens lens(camera.lens, camera.size_px);
  const double middle = (camera.size_px.y - 1) / 2.0;
  const auto left = lens.ray({-0.5, middle}), right = lens.ray({camera.size_px.x - 0.5, middle});
  const auto angle = [](const PixelRay& ray) {
    return std::atan2(ray.direction.x, ray.direction.z);
  };
  return glm::degrees(angle(*right) - angle(*left));
}

TEST(CameraPreset, FieldsOfViewMatchTheirNames) {
  EXPECT_NEAR(field_of_view_deg(preset("automotive_2mp3")),
              2 * glm::degrees(std::atan(964. / 2648)), 1e-9);
  EXPECT_NEAR(field_of_view_deg(preset("automotive_2mp3")), 40, 0.1);
  EXPECT_NEAR(field_of_view_deg(preset("fisheye_190")), 190, 0.5);
}

TEST(CameraPreset, MatchThePublishedCalibrationsToTheLastBit) {
  const std::string folder = "camera/kalibr_yaml/";
  const std::map<std::string, std::pair<std::string, std::size_t>> sources{
      {"euroc_mav_cam0", {folder + "euroc_mav__kalibr_imucam_chain.yaml", 0}},
      {"euroc_mav_cam1", {folder + "euroc_mav__kalibr_imucam_chain.yaml", 1}},
      {"tum_vi_cam0", {folder + "tum_vi__kalibr_imucam_chain.yaml", 0}},
      {"tum_vi_cam1", {folder + "tum_vi__kalibr_imucam_chain.yaml", 1}},
      {"realsense_d455_color", {folder + "rs_d455__kalibr_imucam_chain.yaml", 0}}};
  for (const auto& [name, source] : sources) {
    const auto path = shared_data_folder() / source.first;
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no published calibrations at hand";
    const CameraCalibration published = load_camera_calibrations(path).at(source.second);
    const CameraSpec camera = preset(name);
    EXPECT_EQ(camera.size_px, published.size_px) << name;
    // Equal models image directions equally, to the last bit.
    const Lens ours(camera.lens, camera.size_px), theirs(published.model, published.size_px);
    EXPECT_EQ(camera.lens.index(), published.model.index()) << name;
    for (const glm::dvec3 p_C : {glm::dvec3(0.3, -0.2, 0.9), {-0.4, 0.1, 1}, {0.1, 0.5, 0.7}})
      EXPECT_EQ(ours.project(p_C), theirs.project(p_C)) << name;
  }
}

}  // namespace
}  // namespace groundray::camera_preset_test
