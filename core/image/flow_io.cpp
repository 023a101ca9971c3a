#include "core/image/flow_io.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/image/png_io.h"
#include "core/io/file_io.h"

namespace groundray {
namespace {

void check_flow_channels(const std::filesystem::path& path, const ImageF& flow_px) {
  if (flow_px.channels() == 2) return;
  throw Error("{}: optical flow must have 2 channels, u and v; this has {}", path.string(),
              flow_px.channels());
}

bool is_known(std::span<const float> flow_px) {
  constexpr float most_px = 1e9f;
  return std::abs(flow_px[0]) <= most_px && std::abs(flow_px[1]) <= most_px;
}

// KITTI's code of one component; nothing if it is out of range.
std::optional<std::uint16_t> kitti_code(float flow_px) {
  const double code = std::round(64.0 * flow_px) + 32768;
  if (!(0 <= code && code <= 65535)) return std::nullopt;
  return static_cast<std::uint16_t>(code);
}

}  // namespace

void write_flo(const std::filesystem::path& path, const ImageF& flow_px) {
  check_flow_channels(path, flow_px);
  static_assert(std::endian::native == std::endian::little, "the format's bytes are");
  constexpr float tag = 202021.25f;  // the bytes "PIEH"
  const std::array<std::int32_t, 3> head{std::bit_cast<std::int32_t>(tag), flow_px.width(),
                                         flow_px.height()};
  std::vector<float> values(flow_px.values().begin(), flow_px.values().end());
  for (std::size_t i = 0; i < values.size(); i += 2) {
    if (!is_known({values.data() + i, 2})) values[i] = values[i + 1] = 1e10f;
  }
  std::string bytes(reinterpret_cast<const char*>(head.data()), sizeof head);
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  write_text(path, bytes);
}

std::size_t write_kitti_flow(const std::filesystem::path& path, const ImageF& flow_px) {
  check_flow_channels(path, flow_px);
  Image16 codes(flow_px.width(), flow_px.height(), 3);
  std::size_t left_out = 0;
  for (int y = 0; y < flow_px.height(); ++y) {
    for (int x = 0; x < flow_px.width(); ++x) {
      const auto flow = flow_px.at(x, y);
      if (!is_known(flow)) continue;
      const auto u = kitti_code(flow[0]), v = kitti_code(flow[1]);
      if (u && v) {
        const auto code = codes.at(x, y);
        code[0] = *u;
        code[1] = *v;
        code[2] = 1;
      } else {
        ++left_out;
      }
    }
  }
  write_png(path, codes);
  return left_out;
}

}  // namespace groundray
