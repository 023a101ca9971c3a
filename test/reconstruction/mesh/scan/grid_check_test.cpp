#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <variant>

#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "reconstruction/mesh/scan/beam_columns.h"
#include "sensors/lidar/pattern/scan_pattern.h"
#include "test/support/scans/beam_fan.h"
#include "test/support/scans/organised_cells.h"
#include "test/support/temporary_folder.h"

namespace groundray::grid_check_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace groundray::testing;  // NOLINT(google-build-using-namespace)

std::string refusal(const ScanReturns& returns) {
  try {
    organise(returns);
  } catch (const Error& fault) {
    return fault.what();
  }
  return "";
}

// Returns of a lidar in a room, with the rings and times of its pulses.
ScanReturns in_a_room(const PatternSpec& spec) {
  const ScanPattern pattern(spec);
  PulseBatch pulses;
  pattern.fill(0, 0, pattern.pulses(0), pulses);
  ScanReturns returns;
  for (const PulseBatch::Volley& volley : pulses.volleys) {
    for (std::size_t i = volley.begin; i < volley.end; ++i) {
      returns.p_S.push_back(room(pulses.direction[i]) * pulses.direction[i]);
      returns.rings.push_back(pulses.ring[i]);
      returns.times_s.push_back(volley.time_s);
    }
  }
  return returns;
}

// A rosette's pulses have rings and come at equal time steps: that alone would make a grid of 4
// rows.
TEST(GridCheck, RejectsRosettes) {
  const PatternSpec spec = load_lidar(data_folder() / "scenes/rosette_lidar.yaml").pattern;
  ScanReturns rosette = in_a_room(spec);
  EXPECT_THAT(refusal(rosette),
              AllOf(HasSubstr("as in a rosette"), HasSubstr("link them as points without order")));
  for (std::size_t i = 0; i < rosette.p_S.size(); ++i)
    rosette.columns.push_back(static_cast<std::int32_t>(i / 4));
  EXPECT_THAT(refusal(rosette), HasSubstr("as in a rosette"));
  rosette.columns.clear();
  rosette.times_s.clear();
  EXPECT_THAT(refusal(rosette), HasSubstr("link them as points without order"));
  rosette.rings.clear();
  EXPECT_THAT(refusal(rosette), HasSubstr("link them as points without order"));
}

TEST(GridCheck, RejectsRosettesOfOneBeam) {
  RisleyPattern one =
      std::get<RisleyPattern>(load_lidar(data_folder() / "scenes/rosette_lidar.yaml").pattern);
  one.beams.resize(1);
  EXPECT_THAT(refusal(in_a_room(one)), AllOf(HasSubstr("all returns have the same ring"),
                                             HasSubstr("link them as points without order")));
}

// Neither range noise nor a lens offset from the axis turns beams, whatever the scene.
TEST(GridCheck, AcceptsGridsWithNoiseAndLensOffsets) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 0.05);
  BeamFan fan{.rings = 64,
              .lowest_rad = -25 * degree,
              .highest_rad = 2 * degree,
              .columns = 900,
              .columns_per_turn = 900};
  for (int ring = 0; ring < fan.rings; ++ring) fan.aside_columns.push_back(9 * (ring % 4) - 13.4);
  for (const int direction : {1, -1}) {
    fan.direction = direction;
    ScanReturns fired = seen(fan, room);
    for (glm::dvec3& p : fired.p_S) {
      p += normal(random) * glm::normalize(p);
      p += 0.03 * glm::normalize(glm::dvec3(-p.y, p.x, 0));
    }
    EXPECT_EQ(refusal(fired), "");
    EXPECT_EQ(refusal(without_columns(fired)), "");
  }
}

// Rows that cross each other at half of all positions are not rows.
TEST(GridCheck, ReportsNeighboursByTurningDirection) {
  const BeamFan fan{.rings = 9, .columns = 20};
  OrganisedScan scan = organise(seen(fan, room)).scan;
  check_beams_turn(scan);
  for (std::size_t row = 1; row < 9; row += 4) {  // rows 1 and 2, and 5 and 6
    for (std::size_t column = 0; column < 20; ++column)
      std::swap(scan.points_m[row * 20 + column], scan.points_m[(row + 1) * 20 + column]);
  }
  check_beams_turn(scan);  // 2 of 8 pairs of rows: not more than a quarter
  const std::size_t seventh = 140, eighth = 160;
  for (std::size_t column = 0; column < 20; ++column)
    std::swap(scan.points_m[seventh + column], scan.points_m[eighth + column]);
  try {
    check_beams_turn(scan);
    FAIL();
  } catch (const Error& fault) {
    EXPECT_THAT(fault.what(), HasSubstr("of 152 neighbours 95 turn one way and 57 the other"));
  }
}

}  // namespace
}  // namespace groundray::grid_check_test
