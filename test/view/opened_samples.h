#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "core/image/exr_io.h"
#include "core/image/png_io.h"
#include "core/io/mesh_io.h"
#include "core/io/npy_io.h"
#include "terrain/dem/layers_io.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"
#include "test/view/sample_dataset.h"

namespace groundray::testing {

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

inline TriangleMesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}},
          {}};
}

// Writes elevations 10 + column / 2 with a void of 2 x 2 samples, and a second band of 2 * row.
inline void write_two_bands(const std::filesystem::path& path) {
  constexpr int columns = 12, rows = 9;
  std::vector<float> height, other;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const bool is_void = (row == 4 || row == 5) && (column == 6 || column == 7);
      height.push_back(is_void ? std::numeric_limits<float>::quiet_NaN()
                               : 10 + 0.5f * static_cast<float>(column));
      other.push_back(2 * static_cast<float>(row));
    }
  }
  const GridFrame frame{{columns, rows}, {0, 0}, {2, -2}, {0.5, -0.5}};
  const std::vector<RasterLayer> layers = {{"elevation", "m", height}, {"confidence", "", other}};
  write_layers(path, frame, {.origin_w_m = {500'000, 4'000'000, 0}}, layers);
}

/// One file of each supported kind, written once per program.
class OpenedSamples {
 public:
  static const OpenedSamples& get() {
    static const OpenedSamples samples;
    return samples;
  }
  std::filesystem::path operator[](const char* name) const { return folder_ / name; }

 private:
  OpenedSamples() {
    write_meshes_and_clouds();
    write_dems_and_pictures();
  }
  void write_meshes_and_clouds() const {
    for (const char* const name : {"mesh.ply", "mesh.obj", "mesh.stl", "mesh.glb"})
      write_mesh(folder_ / name, tetrahedron(), {.origin_w_m = {500'000, 4'000'000, 7}});
    write_bytes(folder_ / "cloud.pcd",
                "VERSION .7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
                "WIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ascii\n1 2 3 0.5\n4 5 6 0.25\nnan nan nan 0\n");
    write_bytes(folder_ / "cloud.ply",
                "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\n"
                "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                "property ushort label\nend_header\n"
                "500000.125 4000000.25 7 255 0 0 3\n500001 4000001 8 0 255 0 9\n");
    const std::vector<float> kitti = {1, 2, 3, 0.5f, -4, 5, 6, 0.25f};
    const std::string bytes(reinterpret_cast<const char*>(kitti.data()), 32);
    write_bytes(folder_ / "cloud.bin", bytes);
    const std::vector<NpyField> fields = {
        {"x", "<f4"}, {"y", "<f4"}, {"z", "<f4"}, {"intensity", "<f4"}};
    write_npy(folder_ / "cloud.npy", fields, 2, std::as_bytes(std::span(kitti)));
    const std::filesystem::path corpus = data_folder().parent_path() / "test/fuzz/corpus";
    std::filesystem::copy_file(corpus / "npy/stored.npz", folder_ / "cloud.npz");
    std::filesystem::copy_file(corpus / "image/grey.jpg", folder_ / "picture.jpg");
  }
  void write_dems_and_pictures() const {
    write_two_bands(folder_ / "fused.tif");
    write_hills(folder_ / "hills.asc");
    Image8 picture(40, 30, 3);
    for (std::size_t i = 0; i < picture.values().size(); ++i)
      picture.values()[i] = static_cast<std::uint8_t>(i * 7);
    write_png(folder_ / "picture.png", picture);
    ImageF light(16, 8, 3), depth(16, 8, 1);
    for (std::size_t i = 0; i < depth.values().size(); ++i)
      depth.values()[i] = static_cast<float>(i);
    // Red is 1 in the first pixel and 2 in the second; blue is half of red (RGBE: mantissa / 256 *
    // 2^(e - 128)).
    write_bytes(folder_ / "light.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" +
                                           std::string("\x80\0\x40\x81\x80\0\x40\x82", 8));
    write_exr(folder_ / "light.exr", {{{"R", "G", "B"}, &light}, {{"Z"}, &depth}});
    write_exr(folder_ / "depth.exr", {{{"Z"}, &depth}});
    GeoTiff photo{.size = {20, 10}, .type = GDT_Byte};
    photo.values.assign(600, 77);
    photo.save(folder_ / "photo.tif");
  }
  TemporaryFolder folder_;
};

}  // namespace groundray::testing
