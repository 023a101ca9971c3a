// Scans of real Ouster lidars, as their packets hold them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "apps/scene/calibration/calibration_io.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/text_lines.h"
#include "reconstruction/mesh/scan/scan_mesh.h"
#include "sensors/lidar/pattern/scan_pattern.h"
#include "test/support/scans/organised_cells.h"
#include "test/support/temporary_folder.h"

namespace groundray::ouster_scan_proof_test {
namespace {

using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

constexpr int rings = 32, columns = 1024;
constexpr std::size_t pulse_count = std::size_t{rings} * columns;

template <typename T>
T value_at(std::string_view bytes, std::size_t place) {
  T value{};
  if (place + sizeof(T) > bytes.size()) throw Error("the packets are cut short");
  std::memcpy(&value, bytes.data() + place, sizeof(T));  // little-endian, like the machine
  return value;
}

// For each pulse its origin and its end after 1 m.
struct Pulses {
  std::vector<glm::dvec3> origins_m, directions;  // index: ring + rings * column
};

Pulses pulses_of(const std::filesystem::path& metadata) {
  const ScanPattern pattern(load_ouster_metadata(metadata));
  PulseBatch batch;
  pattern.fill(0, 0, pattern.pulses(0), batch);
  Pulses pulses;
  pulses.origins_m.assign(batch.origin_m.begin(), batch.origin_m.end());
  pulses.directions.assign(batch.direction.begin(), batch.direction.end());
  return pulses;
}

// Reads the returns of a pcap file of the legacy profile: packets of 16 columns, each with a header
// of 16 bytes, 12 bytes per pixel, whose first 20 bits are the range in millimetres, and 4 bytes
// that are all ones in valid columns.
ScanReturns returns_of(const std::filesystem::path& pcap, const Pulses& pulses) {
  constexpr std::size_t file_head = 24, packet_head = 16, network_head = 42,
                        block = 16 + std::size_t{rings} * 12 + 4;
  const std::string bytes = read_text(pcap);
  ScanReturns returns;
  for (std::size_t at = file_head; at + packet_head <= bytes.size();) {
    const std::size_t size = value_at<std::uint32_t>(bytes, at + 8);
    const std::string_view packet = std::string_view(bytes).substr(at + packet_head, size);
    at += packet_head + size;
    for (std::size_t b = network_head; b + block <= packet.size(); b += block) {
      if (value_at<std::uint32_t>(packet, b + block - 4) != 0xffffffff) continue;
      const auto column = value_at<std::uint16_t>(packet, b + 8);
      for (std::size_t ring = 0; ring < rings; ++ring) {
        const auto range_mm = value_at<std::uint32_t>(packet, b + 16 + 12 * ring) & 0xfffff;
        const std::size_t pulse = ring + std::size_t{rings} * column;
        const glm::dvec3 flown_m = 1e-3 * range_mm * pulses.directions[pulse];
        returns.p_S.push_back(range_mm == 0 ? glm::dvec3(0) : pulses.origins_m[pulse] + flown_m);
        returns.rings.push_back(static_cast<std::int32_t>(ring));
        returns.columns.push_back(column);
        returns.times_s.push_back(1e-9 * static_cast<double>(value_at<std::uint64_t>(packet, b)));
      }
    }
  }
  return returns;
}

// Number of columns by which the manufacturer shifts each row so that pixels with the same azimuth
// are adjacent.
std::vector<int> pixel_shifts(const std::filesystem::path& metadata) {
  const std::string text = read_text(metadata);
  const std::size_t key = text.find("pixel_shift_by_row"), begin = text.find('[', key) + 1;
  std::string list = text.substr(begin, text.find(']', begin) - begin);
  for (char& c : list) c = c == ',' ? ' ' : c;
  std::vector<int> shifts;
  for (const std::string_view word : words_of(list)) shifts.push_back(number_of<int>(word).value());
  return shifts;
}

// Each return gets a cell, and rows are shifted as the manufacturer states; the manufacturer rounds
// the angles of all beams of a kind to one number of columns, hence a difference of up to one
// column. The mesh is the same from the packets' columns and from times alone.
TEST(OusterScanProof, RowShiftsMatchTheManufacturersValues) {
  const auto folder = shared_data_folder() / "lidar/ouster";
  if (!std::filesystem::exists(folder))
    GTEST_SKIP() << "there are no Ouster scans in " << folder << "; set GROUNDRAY_SHARED_DATA";
  for (const std::string name : {"OS-1-32-G_v2.1.1_1024x10", "OS-2-32-U0_v2.0.0_1024x10"}) {
    SCOPED_TRACE(name);
    const auto metadata = folder / (name + ".json");
    const ScanReturns all = returns_of(folder / (name + ".pcap"), pulses_of(metadata));
    ASSERT_EQ(all.p_S.size(), pulse_count);
    const std::vector<int> shifts = pixel_shifts(metadata);
    ASSERT_EQ(shifts.size(), static_cast<std::size_t>(rings));
    std::vector<std::size_t> faces;
    ScanReturns timed = without_columns(all), numbered = all, bare = timed;
    numbered.times_s.clear();
    bare.times_s.clear();
    for (const ScanReturns& table : {numbered, timed, bare}) {
      const OrganisedReturns made = organise(table);
      EXPECT_LE(made.scan.rows, rings);
      EXPECT_LE(std::abs(made.scan.columns - columns), 1);
      EXPECT_TRUE(made.scan.is_round);
      EXPECT_EQ(made.counts.other_returns, 0u);
      EXPECT_LE(made.counts.crowded,
                table.times_s.empty() && table.columns.empty() ? all.p_S.size() / 200 : 0);
      const ScanMesh mesh = link(made.scan, ScreeningLimits::ground());
      faces.push_back(mesh.mesh.shape.triangles.size());
      fmt::print("{}: {} x {}, {} of {} are returns, {} faces and {} of occlusion\n", name,
                 made.scan.rows, made.scan.columns, all.p_S.size() - made.counts.no_returns,
                 all.p_S.size(), faces.back(), mesh.occlusion.shape.triangles.size());
      if (faces.size() == 3) continue;  // azimuths alone determine a column only up to a whole one
      const auto cells = cells_of(made.scan, all.p_S.size());
      std::vector<int> off;
      for (std::size_t i = 0; i < cells.size(); ++i) {
        if (cells[i].x < 0) continue;
        const int shifted = all.columns[i] + shifts[static_cast<std::size_t>(all.rings[i])];
        off.push_back(((cells[i].x - shifted) % columns + columns) % columns);
      }
      const auto [low, high] = std::ranges::minmax(off);
      EXPECT_TRUE(high - low <= 2 || high - low >= columns - 2) << low << ' ' << high;
    }
    EXPECT_EQ(faces[0], faces[1]);
    EXPECT_GT(static_cast<double>(faces[2]), 0.97 * static_cast<double>(faces[0]));
  }
}

}  // namespace
}  // namespace groundray::ouster_scan_proof_test
