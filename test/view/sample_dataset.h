#pragma once

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "apps/groundray/generate.h"
#include "test/support/temporary_folder.h"

namespace groundray::testing {

/// Writes hilly ground of 161 x 161 m, without a CRS, as an ESRI ASCII grid with its corner at (0,
/// 0).
inline void write_hills(const std::filesystem::path& path) {
  constexpr int samples = 161;
  std::ofstream file(path);
  file << "ncols 161\nnrows 161\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
  for (int row = 0; row < samples; ++row) {
    for (int column = 0; column < samples; ++column) {
      file << fmt::format("{:.4f} ", 50 + 2 * std::sin(column * 0.08) + 1.5 * std::cos(row * 0.11));
    }
    file << '\n';
  }
}

/// Sample scene on those hills. For half a second, a body with a lidar and a rolling-shutter camera
/// turns and rolls over them; there are a post and a moving vehicle.
inline std::string sample_scene() {
  return "groundray: 1\n"
         "seed: 11\n"
         "duration_s: 0.5\n"
         "terrain: {dem: hills.asc, material: dry_soil, label: 3}\n"
         "platform: {trajectory: body.tum}\n"
         "objects:\n"
         "  - {name: post, label: 12, asset: fence_post, at_m: [90, 83]}\n"
         "  - name: cart\n"
         "    label: 10\n"
         "    asset: vehicle\n"
         "    drive: {waypoints_m: [[95, 70], [95, 100]], speed_m_s: 8, height_m: 0}\n"
         "lidars:\n"
         "  - name: top\n"
         "    preset: velodyne_vlp16\n"
         "    mount: {translation_m: [0.2, 0, 1.6], pitch_deg: 3}\n"
         "    range_noise_sigma_m: 0.02\n"
         "    beam: {divergence_mrad: [3, 1.5], aperture_mm: [12, 8]}\n"
         "cameras:\n"
         "  - name: eye\n"
         "    file: eye.yaml\n"
         "    mount: {translation_m: [0.5, 0.1, 1.4], pitch_deg: 8}\n";
}

/// Writes the scene and the files that it names. @return path of the scene file.
inline std::filesystem::path write_sample_scene(const std::filesystem::path& folder,
                                                const std::string& text) {
  write_hills(folder / "hills.asc");
  std::ofstream(folder / "body.tum") << "0 80 80 54 0 0 0 1\n"
                                        "0.6 84 81 54.3 0.02 0 0.1 0.99478\n";
  std::ofstream(folder / "eye.yaml") << "groundray_camera: 1\n"
                                        "model: Eye\n"
                                        "size_px: [64, 48]\n"
                                        "lens: {kannala_brandt: {focal_px: [40, 41], centre_px: "
                                        "[31, 24], coefficients: [0.02, -0.003, 0, 0]}}\n"
                                        "rate_hz: 5\n"
                                        "first_ms: 20\n"
                                        "shutter: {exposure_ms: 2, row_us: 500}\n"
                                        "products: [truth, flow]\n"
                                        "sources: {all: made up}\n";
  std::ofstream(folder / "scene.yaml") << text;
  return folder / "scene.yaml";
}

/// Dataset of the sample scene, generated once per test program.
class SampleDataset {
 public:
  static const SampleDataset& get() {
    static const SampleDataset dataset;
    return dataset;
  }

  std::filesystem::path scene() const { return folder_ / "scene.yaml"; }
  std::filesystem::path path() const { return folder_ / "dataset"; }

 private:
  SampleDataset() {
    groundray::generate(write_sample_scene(folder_.path(), sample_scene()), path(), {});
  }

  TemporaryFolder folder_;
};

}  // namespace groundray::testing
