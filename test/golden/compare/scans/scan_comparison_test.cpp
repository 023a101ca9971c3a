#include "apps/golden/compare/scans/scan_comparison.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <random>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/ply_io.h"
#include "test/support/scans/sample_scan.h"
#include "test/support/temporary_folder.h"

namespace groundray::golden::scan_comparison_test {
namespace {

using groundray::testing::direction_of;
using groundray::testing::sample_returns;
using groundray::testing::SampleReturn;
using groundray::testing::SampleReturns;
using groundray::testing::scan_of;
using groundray::testing::TemporaryFolder;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// Ranges of some 10 m are converted to x, y, z and back: a dozen roundings, each of 1e-16 relative.
constexpr double rounding_m = 2e-14;

using Names = std::vector<std::string>;

const std::vector<Names> each_way{{"ring", "time"}, {"ring"}, {}};  // columns for pairing

template <typename F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "no Error was thrown";
}

double value_of(const Section& section, const std::string& name) {
  for (const Measure& measure : section.measures) {
    if (measure.name == name) return measure.value;
  }
  ADD_FAILURE() << "there is no measure " << name;
  return 0;
}

const Table* table_of(const Section& section, const std::string& title) {
  for (const Table& table : section.tables) {
    if (table.title == title) return &table;
  }
  ADD_FAILURE() << "there is no table " << title;
  return nullptr;
}

Section compare(const SampleReturns& reference, const SampleReturns& other, const Names& names) {
  return compare_scans(scan_of(reference, names), scan_of(other, names), {});
}

TEST(CompareScans, EqualScansDoNotDiffer) {
  for (const Names& names : each_way) {
    const Section section = compare(sample_returns(), sample_returns(), names);
    EXPECT_EQ(value_of(section, "pairs of returns"), 720);
    EXPECT_EQ(value_of(section, "missing returns"), 0);
    EXPECT_EQ(value_of(section, "extra returns"), 0);
    EXPECT_EQ(value_of(section, "range error, largest magnitude"), 0);
    EXPECT_EQ(value_of(section, "angle between directions, largest"), 0);
    EXPECT_THAT(section.text, Not(HasSubstr("WARNING")));
    EXPECT_EQ(section.verdict, Verdict::Told);
  }
}

TEST(CompareScans, ShiftAlongTheBeamIsARangeError) {
  SampleReturns other = sample_returns();
  for (SampleReturn& r : other) r.range_m -= 0.05;
  for (const Names& names : each_way) {
    const Section section = compare(sample_returns(), other, names);
    EXPECT_EQ(value_of(section, "pairs of returns"), 720);
    EXPECT_NEAR(value_of(section, "range error, mean"), -0.05, rounding_m);
    EXPECT_NEAR(value_of(section, "range error, median"), -0.05, rounding_m);
    EXPECT_NEAR(value_of(section, "range error, RMS"), 0.05, rounding_m);
    EXPECT_NEAR(value_of(section, "range error, standard deviation"), 0, rounding_m);
    EXPECT_NEAR(value_of(section, "range error, 95th percentile of magnitudes"), 0.05, rounding_m);
    EXPECT_NEAR(value_of(section, "range error, 99th percentile of magnitudes"), 0.05, rounding_m);
    EXPECT_NEAR(value_of(section, "range error, largest magnitude"), 0.05, rounding_m);
    EXPECT_NEAR(value_of(section, "distance from the reference's beam, largest"), 0, rounding_m);
  }
}

// Errors of -2, -1, 0, 1, 2 mm in turn: mean 0, RMS and standard deviation sqrt(2) mm.
TEST(CompareScans, ReportsTheDistributionOfErrors) {
  SampleReturns other = sample_returns();
  for (std::size_t i = 0; i < other.size(); ++i) {
    other[i].range_m += 1e-3 * (static_cast<double>(i % 5) - 2);
  }
  const Section section = compare(sample_returns(), other, {"ring", "time"});
  EXPECT_NEAR(value_of(section, "range error, mean"), 0, rounding_m);
  EXPECT_NEAR(value_of(section, "range error, RMS"), std::sqrt(2) * 1e-3, rounding_m);
  EXPECT_NEAR(value_of(section, "range error, standard deviation"), std::sqrt(2) * 1e-3,
              rounding_m);
  EXPECT_NEAR(value_of(section, "range error, largest magnitude"), 2e-3, rounding_m);
  ASSERT_EQ(section.histograms.size(), 1u);
  std::uint64_t shown = section.histograms[0].below + section.histograms[0].above;
  for (const std::uint64_t count : section.histograms[0].counts) shown += count;
  EXPECT_EQ(shown, 720u);
}

TEST(CompareScans, CountsMissingAndExtraReturns) {
  SampleReturns reference = sample_returns(), other;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    if (i % 10 != 3) other.push_back(reference[i]);
  }
  for (const Names& names : each_way) {
    const Section fewer = compare(reference, other, names);
    EXPECT_EQ(value_of(fewer, "pairs of returns"), 648);
    EXPECT_EQ(value_of(fewer, "missing returns"), 72);
    EXPECT_DOUBLE_EQ(value_of(fewer, "missing share of the reference's"), 0.1);
    EXPECT_EQ(value_of(fewer, "extra returns"), 0);
    EXPECT_EQ(value_of(fewer, "range error, largest magnitude"), 0);
    const Section more = compare(other, reference, names);
    EXPECT_EQ(value_of(more, "missing returns"), 0);
    EXPECT_EQ(value_of(more, "extra returns"), 72);
    EXPECT_DOUBLE_EQ(value_of(more, "extra share of the other's"), 0.1);
  }
}

// Pairs are summed in the reference's order, so sums do not depend on the order of the other scan.
TEST(CompareScans, RowOrderDoesNotMatter) {
  SampleReturns other = sample_returns();
  for (std::size_t i = 0; i < other.size(); ++i) {
    other[i].range_m += 1e-4 * static_cast<double>(i % 11);
  }
  for (const Names& names : each_way) {
    const Section before = compare(sample_returns(), other, names);
    SampleReturns shuffled = other;
    std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937_64(7));
    const Section after = compare(sample_returns(), shuffled, names);
    ASSERT_EQ(after.measures.size(), before.measures.size());
    for (std::size_t i = 0; i < before.measures.size(); ++i) {
      EXPECT_EQ(after.measures[i].value, before.measures[i].value) << before.measures[i].name;
    }
    EXPECT_EQ(after.text, before.text);
  }
}

/// Every second pulse has a second return 4 m farther, directly after its first in the file.
SampleReturns with_second_returns() {
  SampleReturns returns;
  for (const SampleReturn& first : sample_returns()) {
    returns.push_back(first);
    if (static_cast<int>(first.ring) % 2 == 0) continue;
    returns.push_back(first);
    returns.back().range_m += 4;
    returns.back().return_index = 2;
  }
  return returns;
}

TEST(CompareScans, PairsReturnsOfAPulseByRangeWithoutIndices) {
  SampleReturns other = with_second_returns();
  std::ranges::reverse(other);
  for (SampleReturn& r : other) r.range_m += r.return_index == 2 ? 0.02 : 0.01;
  for (const Names& names : each_way) {
    const Section section = compare(with_second_returns(), other, names);
    EXPECT_EQ(value_of(section, "pairs of returns"), 720 + 360);
    EXPECT_EQ(value_of(section, "missing returns"), 0);
    EXPECT_NEAR(value_of(section, "range error, mean"), (720 * 0.01 + 360 * 0.02) / 1080,
                rounding_m);
    EXPECT_NEAR(value_of(section, "range error, largest magnitude"), 0.02, rounding_m);
    EXPECT_THAT(section.text, HasSubstr("their returns in order of range"));
  }
}

// The other scan lacks the first return of 360 pulses; pairing by index still pairs the second
// returns.
TEST(CompareScans, PairsReturnsOfAPulseByIndexIfBothHaveIt) {
  SampleReturns other = with_second_returns();
  std::erase_if(other, [](const SampleReturn& r) {
    return r.return_index == 1 && static_cast<int>(r.ring) % 2 == 1;
  });
  for (Names names : each_way) {
    const Section by_range = compare(with_second_returns(), other, names);
    EXPECT_NEAR(value_of(by_range, "range error, largest magnitude"), 4, rounding_m);
    names.emplace_back("return_index");
    const Section section = compare(with_second_returns(), other, names);
    EXPECT_EQ(value_of(section, "pairs of returns"), 720);
    EXPECT_EQ(value_of(section, "missing returns"), 360);
    EXPECT_EQ(value_of(section, "range error, largest magnitude"), 0);
    EXPECT_THAT(section.text, HasSubstr("their returns by their index"));
  }
}

// Turned about z by 1 mrad, a beam at elevation e moves by 2 asin(cos e sin 0.5 mrad).
TEST(CompareScans, SensorRotationAffectsDirectionsOnly) {
  constexpr double turn_rad = 1e-3;
  SampleReturns other = sample_returns();
  double squares = 0, largest_m = 0;
  for (SampleReturn& r : other) {
    const double elevation_rad = std::asin(r.direction.z);
    r.direction = direction_of(std::atan2(r.direction.y, r.direction.x) + turn_rad, elevation_rad);
    const double angle_rad = 2 * std::asin(std::cos(elevation_rad) * std::sin(turn_rad / 2));
    squares += angle_rad * angle_rad;
    largest_m = std::max(largest_m, r.range_m * std::sin(angle_rad));
  }
  for (const Names& names : each_way) {
    const Section section = compare(sample_returns(), other, names);
    EXPECT_EQ(value_of(section, "pairs of returns"), 720);
    EXPECT_NEAR(value_of(section, "range error, largest magnitude"), 0, rounding_m);
    EXPECT_NEAR(value_of(section, "angle between directions, RMS"), std::sqrt(squares / 720),
                1e-14);
    EXPECT_NEAR(value_of(section, "distance from the reference's beam, largest"), largest_m, 1e-13);
    // The small-angle approximation is not exact: the sine of 1 mrad is 1.7e-10 below 1 mrad.
    EXPECT_NEAR(value_of(section, "turn of the other as a whole"), turn_rad, 1e-9);
    EXPECT_THAT(section.text, HasSubstr("rotated back by 0.001 rad about (0, 0, 1)"));
  }
}

TEST(CompareScans, ReportsErrorsByRangeIncidenceAndLabel) {
  SampleReturns reference = sample_returns(), other;
  for (const SampleReturn& r : reference) {
    if (r.ring == 7) continue;  // incidence 1.4 rad, label 1, ranges 12 to 18 m
    other.push_back(r);
    other.back().range_m += 0.01 * r.label;
  }
  const Section section = compare(reference, other, {"ring", "time", "label", "incidence"});
  const Table* const by_label = table_of(section, "By the reference's label");
  ASSERT_EQ(by_label->rows.size(), 3u);
  EXPECT_EQ(by_label->rows[0],
            (std::vector<std::string>{"0", "270", "270", "0", "0", "0", "0.00 %"}));
  EXPECT_EQ(by_label->rows[1],
            (std::vector<std::string>{"1", "270", "180", "0.01", "0.01", "0.01", "33.33 %"}));
  EXPECT_EQ(by_label->rows[2],
            (std::vector<std::string>{"2", "180", "180", "0.02", "0.02", "0.02", "0.00 %"}));
  // Incidence per bin: 0, 0.2 | 0.4 | 0.6 | 0.8, 1.0 | 1.2 | 1.4 rad.
  const Table* const by_incidence = table_of(section, "By the reference's angle of incidence");
  ASSERT_EQ(by_incidence->rows.size(), 6u);
  const char* const counts[] = {"180", "90", "90", "180", "90", "90"};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(by_incidence->rows[i][1], counts[i]);
  EXPECT_EQ(by_incidence->rows[5],
            (std::vector<std::string>{"75 - 90", "90", "0", "", "", "", "100.00 %"}));
  const Table* const by_range = table_of(section, "By range");
  ASSERT_EQ(by_range->rows.size(), 2u);
  EXPECT_EQ(by_range->rows[0][0], "5 - 10");
  EXPECT_EQ(by_range->rows[1][0], "10 - 20");
  EXPECT_EQ(by_range->rows[1].back(), "0");
}

TEST(CompareScans, ReportsTheShareOfEqualLabels) {
  const Names names{"ring", "time", "label"};
  const SampleReturns reference = sample_returns();
  const Section equal = compare(reference, reference, names);
  EXPECT_EQ(value_of(equal, "share of equal labels"), 100);
  EXPECT_THAT(equal.headline, Not(HasSubstr("labels")));
  SampleReturns other = reference;
  for (std::size_t i = 0; i < other.size(); i += 4) other[i].label += 1;
  const Section section = compare(reference, other, names);
  EXPECT_NEAR(value_of(section, "share of equal labels"), 75,
              100.0 / static_cast<double>(other.size()));
  EXPECT_THAT(section.headline, HasSubstr("% of the labels are equal."));
  EXPECT_THAT(section.main, Contains("share of equal labels"));
}

TEST(CompareScans, ReportsTheScaleOfIntensities) {
  SampleReturns other = sample_returns();
  for (SampleReturn& r : other) r.intensity *= -2.5;
  const Section section = compare(sample_returns(), other, {"ring", "time", "intensity"});
  EXPECT_NEAR(value_of(section, "intensity, best factor to the reference's"), -2.5, 1e-14);
  EXPECT_NEAR(value_of(section, "intensity, correlation"), -1, 1e-14);
}

TEST(CompareScans, ComparesErrorsWithLimits) {
  SampleReturns other = sample_returns();
  for (SampleReturn& r : other) r.range_m -= 0.05;
  const Scan a = scan_of(sample_returns(), {"ring"}), b = scan_of(other, {"ring"});
  ScanOptions options{.limits = {.range_mean_m = 0.051, .range_rms_m = 0.051}};
  EXPECT_EQ(compare_scans(a, b, options).verdict, Verdict::Passed);
  options.limits.range_mean_m = 0.049;  // the mean is -0.05 m
  EXPECT_EQ(compare_scans(a, b, options).verdict, Verdict::Failed);
  options.limits = {.missing_share = 0, .extra_share = 0};
  EXPECT_EQ(compare_scans(a, b, options).verdict, Verdict::Passed);
}

TEST(CompareScans, EmptyScanMissesAllReturns) {
  const Scan reference = scan_of(sample_returns(), {"ring"}), empty = scan_of({}, {"ring"});
  ScanOptions options;
  const Section section = compare_scans(reference, empty, options);
  EXPECT_EQ(value_of(section, "missing share of the reference's"), 1);
  EXPECT_EQ(section.verdict, Verdict::Failed);
  EXPECT_EQ(value_of(section, "pairs of returns"), 0);
  EXPECT_EQ(value_of(compare_scans(empty, reference, options), "extra returns"), 720);
  const Section both_empty = compare_scans(empty, empty, options);
  EXPECT_EQ(value_of(both_empty, "pairs of returns"), 0);
  EXPECT_EQ(both_empty.verdict, Verdict::Told);
  options.limits.range_rms_m = 1;
  EXPECT_EQ(compare_scans(reference, empty, options).verdict, Verdict::Failed);
}

TEST(CompareScans, WarnsOfAnotherUnitOrFrame) {
  const SampleReturns reference = sample_returns();
  const auto text_at = [&](double unit) {
    SampleReturns other = reference;
    for (SampleReturn& r : other) r.range_m *= unit;
    return compare(reference, other, {"ring"}).text;
  };
  EXPECT_THAT(text_at(1000), HasSubstr("Is sample in millimetres? Then give its unit (--unit-m "
                                       "0.001)."));
  EXPECT_THAT(text_at(1 / 0.3048),
              HasSubstr("Is sample in feet? Then give its unit (--unit-m 0.3048)."));
  EXPECT_THAT(text_at(0.02), HasSubstr("Units or frames differ"));
  EXPECT_THAT(text_at(1.5), Not(HasSubstr("WARNING")));
  const auto file = groundray::testing::file_of(reference, {"ring"});
  ScanReading moved;  // points that lie around (-20, 0, 0) m
  std::get<Pose>(moved.X_FS).translation_m = {20, 0, 0};
  const Scan other = scan_of(file, "other.ply", moved);
  EXPECT_THAT(
      compare_scans(scan_of(reference, {}), other, {.pairing = {.tolerance_rad = 0.02}}).text,
      AllOf(HasSubstr("Are the points in the world frame?"), HasSubstr("(--sensor-pose)")));
}

TEST(CompareScans, WarnsOfAnotherRingNumbering) {
  SampleReturns other = sample_returns();
  for (SampleReturn& r : other) r.ring = 7 - r.ring;
  EXPECT_THAT(compare(sample_returns(), other, {"ring"}).text,
              HasSubstr("number rings, times or pulses differently"));
}

TEST(CompareScans, RejectsScansWithoutPairs) {
  SampleReturns other = sample_returns();
  for (SampleReturn& r : other) r.direction = direction_of(1, r.direction.z / 10 + 1.4);
  EXPECT_THAT(
      message_of([&] { compare(sample_returns(), other, {}); }),
      HasSubstr("none of its 720 returns could be paired with the 720 of sample by direction"));
}

TEST(CompareScans, RejectsUnusableTolerances) {
  const Scan scan = scan_of(sample_returns(), {"ring", "time"});
  EXPECT_THAT(message_of([&] {
                compare_scans(scan, scan,
                              {.pairing = {.rule = PairingRule::Direction, .tolerance_rad = 3}});
              }),
              HasSubstr("the tolerance permits more than 64 partners per pulse"));
  EXPECT_THAT(message_of([&] {
                compare_scans(scan, scan,
                              {.pairing = {.rule = PairingRule::RingTime, .tolerance_s = 0}});
              }),
              HasSubstr("the tolerance, 0, must be positive (--pair-s)"));
  EXPECT_THAT(
      message_of([&] { compare_scans(scan, scan, {.pairing = {.rule = PairingRule::Pulse}}); }),
      HasSubstr("pairing by pulse number requires a usable column pulse"));
}

// The half with y < 0 is 0.5 m too far; the sensor stands at (100, 200, 0) in W. Ring 4 and above
// have ranges of 9 m and more.
TEST(CompareScans, ComparesOnlyWhatIsInTheScope) {
  SampleReturns other = sample_returns();
  std::size_t left = 0;
  for (SampleReturn& r : other) {
    if (r.direction.y < 0) r.range_m += 0.5;
    left += r.direction.y >= 0 ? 1 : 0;
  }
  Scan a = scan_of(sample_returns(), {"ring", "time"}), b = scan_of(other, {"ring", "time"});
  a.X_WS.translation_m = {100, 200, 0};
  constexpr double all = Scope::unbounded;
  const Scope box{.low_m = {-all, 200, -all}, .high_m = {all, all, all}};
  const Section upper = compare_scans(a, b, {.scope = box});
  EXPECT_EQ(value_of(upper, "pairs of returns"), left);
  EXPECT_EQ(value_of(upper, "range error, largest magnitude"), 0);
  EXPECT_EQ(value_of(upper, "reference: outside the area and heights"), 720 - left);
  EXPECT_EQ(value_of(upper, "missing returns"), 0);
  EXPECT_THAT(upper.text, HasSubstr("Only y of at least 200 m of the frame of the reference"));
  EXPECT_THAT(upper.headline, HasSubstr(fmt::format("All {} pairs of returns have equal", left)));
  EXPECT_THAT(message_of([&] {
                compare_scans(a, b, {.scope = {.low_m = {-1, -1, -1}, .high_m = {1, 1, 1}}});
              }),
              HasSubstr("720 of the reference's are outside the area and heights"));
}

// The other scan covers the front half only. Points of the rear are farther than 0.5 m from all of
// its points, except near the border: an azimuth step is 0.07 rad, of 8 m to 18 m.
TEST(CompareScans, LeavesOutWhatIsFarFromTheOtherScan) {
  const SampleReturns reference = sample_returns();
  SampleReturns other;
  for (const SampleReturn& r : reference) {
    if (r.direction.x > 0) other.push_back(r);
  }
  const Scan a = scan_of(reference, {"ring", "time"}), b = scan_of(other, {"ring", "time"});
  std::size_t far = 0;
  for (const glm::dvec3& p : a.p_S) {
    const bool is_near =
        std::ranges::any_of(b.p_S, [&](const glm::dvec3& q) { return glm::distance(p, q) <= 0.5; });
    far += is_near ? 0 : 1;
  }
  const Section section = compare_scans(a, b, {.scope = {.ignore_beyond_m = 0.5}});
  EXPECT_EQ(value_of(section, "pairs of returns"), other.size());
  const std::string left_out = "reference: left out, farther than 0.5 m from the other surface";
  EXPECT_EQ(value_of(section, left_out), far);
  EXPECT_EQ(value_of(section, "missing returns"), 720 - other.size() - far);
  EXPECT_NEAR(value_of(section, left_out + ", share"), 100. * static_cast<double>(far) / 720, 1e-9);
  EXPECT_GT(far, 300u);
}

// One ring is 0.2 m off: only its row of the picture by ring is coloured.
TEST(CompareScans, DrawErrorsByAzimuthAndRing) {
  SampleReturns other = sample_returns();
  for (SampleReturn& r : other) r.range_m += r.ring == 2 ? 0.2 : 0;
  const Section section = compare(sample_returns(), other, {"ring", "time"});
  ASSERT_EQ(section.pictures.size(), 2u);
  const Picture& picture = section.pictures[0];
  EXPECT_EQ(picture.up->label, "ring");
  EXPECT_EQ(picture.up->low, -0.5);
  EXPECT_EQ(picture.up->high, 7.5);
  std::array<std::size_t, 8> red{};
  const int row_px = picture.image.height() / 8;
  for (int y = 0; y < picture.image.height(); ++y) {
    for (int x = 0; x < picture.image.width(); ++x)
      red[static_cast<std::size_t>(7 - y / row_px)] += picture.image.at(x, y)[2] < 100 ? 1 : 0;
  }
  for (std::size_t ring = 0; ring < red.size(); ++ring) EXPECT_EQ(red[ring] > 0, ring == 2) << ring;
  const Section by_direction = compare(sample_returns(), other, {});
  EXPECT_EQ(by_direction.pictures.at(0).up->label, "elevation, deg");
}

TEST(CompareScans, ComparesFilesOfDifferentFormats) {
  const TemporaryFolder folder;
  const SampleReturns returns = sample_returns();
  write_ply(folder / "reference.ply",
            groundray::testing::file_of(returns, {"ring", "time", "label"}).cloud, {});
  std::string floats;
  for (const SampleReturn& r : returns) {
    const glm::dvec3 p = r.direction * (r.range_m + 0.25);
    for (const double value : {p.x, p.y, p.z, r.intensity}) {
      const auto number = static_cast<float>(value);
      floats.append(reinterpret_cast<const char*>(&number), sizeof number);
    }
  }
  write_text(folder / "other.bin", floats);
  const Section section = compare_scans(folder / "reference.ply", folder / "other.bin", {});
  EXPECT_EQ(value_of(section, "pairs of returns"), 720);
  // Coordinates up to 20 m in single precision: half an ulp of 2^-19 m in each.
  EXPECT_NEAR(value_of(section, "range error, mean"), 0.25, 2e-6);
  EXPECT_THAT(section.text, HasSubstr("Pulses were paired by direction"));
  EXPECT_EQ(table_of(section, "What is in the files")->rows[1][2], "KITTI's, 4 floats a point");
}

}  // namespace
}  // namespace groundray::golden::scan_comparison_test
