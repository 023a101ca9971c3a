#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/random.h"
#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/fusion/dem_fusion.h"
#include "test/reconstruction/dem/rolling_ground.h"
#include "test/support/margin.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::dem_fusion_proof_test {
namespace {

using testing::proof_size;
using testing::record_margin;
using testing::RollingGround;

PointSource one_by_one(const std::vector<MeasuredPoints>& blocks) {
  return [&blocks, next = std::size_t{0}](MeasuredPoints& block) mutable {
    if (next == blocks.size()) return false;
    block = blocks[next++];
    return true;
  };
}

// Five lidar poses and twenty stereo pairs all round the ground, directed inwards.
std::vector<MeasuredPoints> measure(const RollingGround& ground, double half_m, int azimuths,
                                    int columns) {
  std::vector<MeasuredPoints> all;
  const auto above = [&](glm::dvec2 p, double eye_m) {
    return glm::dvec3(p, ground.height_m(p) + eye_m);
  };
  for (int i = 0; i < 5; ++i) {
    const double turn = (2 * glm::pi<double>()) * i / 5;
    const glm::dvec2 at = 0.55 * half_m * glm::dvec2(std::cos(turn), std::sin(turn));
    all.push_back(testing::scan_by_lidar(ground, above(at, 2), azimuths,
                                         static_cast<std::uint32_t>(i), Seed{5}));
  }
  for (int i = 0; i < 20; ++i) {
    const double turn = (2 * glm::pi<double>()) * i / 20;
    const glm::dvec2 at =
        (i % 2 == 0 ? 0.9 : 0.4) * half_m * glm::dvec2(std::cos(turn), std::sin(turn));
    const double yaw = turn + (i % 2 == 0 ? glm::pi<double>() : 0.0) + 0.3 * (i % 3 - 1);
    all.push_back(testing::match_by_stereo(ground, above(at, 1.8), yaw, columns,
                                           static_cast<std::uint32_t>(100 + i), Seed{5}));
  }
  return all;
}

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() +
                  static_cast<std::ptrdiff_t>(share * (static_cast<double>(values.size()) - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

std::vector<double> sizes(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return values;
}

double nmad(const std::vector<double>& values) {
  const double middle = quantile(values, 0.5);
  std::vector<double> off = values;
  for (double& value : off) value -= middle;
  return 1.4826 * quantile(sizes(off), 0.5);
}

double share_below(const std::vector<double>& values, double limit) {
  double count = 0;
  for (const double value : values) count += std::abs(value) <= limit ? 1 : 0;
  return count / static_cast<double>(values.size());
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

struct Errors {
  std::vector<double> error_m;
  std::vector<double> in_sd;  // error / stated standard deviation
};

// Excludes cells that a trunk reaches into: there the ground is hidden.
Errors errors_of(const DemLayers& layers, const RollingGround& ground) {
  Errors found;
  const double reach_m = 0.5 * std::hypot(layers.frame.step_m.x, layers.frame.step_m.y);
  for (int row = 0; row < layers.frame.samples.y; ++row) {
    for (int column = 0; column < layers.frame.samples.x; ++column) {
      const auto i = testing::number_of(layers.frame, {column, row});
      const glm::dvec2 p = layers.frame.to_D({column, row});
      if (std::isnan(layers.elevation_m[i]) || ground.is_in_trunk(p, reach_m)) continue;
      const double error_m = double{layers.elevation_m[i]} - ground.height_m(p);
      found.error_m.push_back(error_m);
      found.in_sd.push_back(error_m / std::sqrt(double{layers.variance_m2[i]}));
    }
  }
  return found;
}

// Reference: errors of a plain median in each cell.
std::vector<double> errors_of_medians(const std::vector<MeasuredPoints>& blocks,
                                      const GridFrame& frame, const RollingGround& ground) {
  std::vector<std::vector<double>> cells(
      static_cast<std::size_t>(frame.samples.x * frame.samples.y));
  for (const MeasuredPoints& block : blocks) {
    for (const glm::dvec3& p : block.p_m) {
      const glm::ivec2 cell(glm::floor(frame.to_grid(glm::dvec2(p)) + 0.5));
      if (cell.x < 0 || cell.y < 0 || cell.x >= frame.samples.x || cell.y >= frame.samples.y)
        continue;
      cells[testing::number_of(frame, cell)].push_back(p.z);
    }
  }
  std::vector<double> errors_m;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].empty()) continue;
    const glm::ivec2 cell(static_cast<int>(i) % frame.samples.x,
                          static_cast<int>(i) / frame.samples.x);
    errors_m.push_back(quantile(cells[i], 0.5) - ground.height_m(frame.to_D(cell)));
  }
  return errors_m;
}

// Five lidar poses and twenty stereo pairs see rolling ground with boulders and trunks, with the
// sensors' noise, biases and outliers: the errors that the fusion states must be correct.
TEST(DemFusionProof, ClosedLoopOnRollingGround) {
  const auto scale = static_cast<int>(proof_size(1, 2));
  const double half_m = 13 * scale;
  const RollingGround ground(half_m, 20 * scale * scale, 6 * scale * scale, Seed{11});
  const auto blocks = measure(ground, half_m, 600 * scale, 110 * scale);
  const GridFrame frame = frame_over({{-half_m, -half_m}, {half_m, half_m}}, 0.25);
  const Fusion fusion = fuse(one_by_one(blocks), frame);
  const Errors errors = errors_of(fusion.layers, ground);
  const std::vector<double> medians = errors_of_medians(blocks, frame, ground);
  EXPECT_GT(errors.error_m.size(), 0.9 * static_cast<double>(medians.size()));

  const double nmad_m = nmad(errors.error_m), p95_m = quantile(sizes(errors.error_m), 0.95);
  const double rms_sd = rms(errors.in_sd);
  EXPECT_LE(nmad_m, 0.008);
  EXPECT_LE(p95_m, 0.05);
  EXPECT_LE(nmad_m, 0.8 * nmad(medians));
  EXPECT_LE(p95_m, 0.8 * quantile(sizes(medians), 0.95));
  EXPECT_NEAR(rms_sd, 1, 0.15);
  // At the reduced size with fewer boulders, the ground is smoother than stated: 76.0 %.
  EXPECT_LE(share_below(errors.in_sd, 1), 0.683 + (proof_size(0, 1) == 1 ? 0.07 : 0.085));
  EXPECT_GE(share_below(errors.in_sd, 1), 0.683 - 0.07);
  EXPECT_NEAR(share_below(errors.in_sd, 2), 0.954, 0.03);
  record_margin("NMAD of heights fused in a closed loop", nmad_m, 0.008, "m");
  record_margin("95 % error of heights fused in a closed loop", p95_m, 0.05, "m");
  record_margin("normalised error of heights fused in a closed loop", rms_sd - 1, 0.15);
  RecordProperty(
      "measured",
      fmt::format("{} points, {} of {} cells: NMAD {:.4f} m (median {:.4f}), 95 % {:.4f} m "
                  "(median {:.4f}), RMSE {:.4f} m, 1 and 2 sd cover {:.3f} and {:.3f}, "
                  "rms {:.3f} sd",
                  fusion.counts.points, errors.error_m.size(), medians.size(), nmad_m,
                  nmad(medians), p95_m, quantile(sizes(medians), 0.95), rms(errors.error_m),
                  share_below(errors.in_sd, 1), share_below(errors.in_sd, 2), rms_sd));
}

}  // namespace
}  // namespace groundray::dem_fusion_proof_test
