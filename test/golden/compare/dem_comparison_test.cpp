#include "apps/golden/compare/dem_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string_view>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/text_lines.h"
#include "test/support/temporary_folder.h"

namespace groundray::golden::dem_comparison_test {
namespace {

using groundray::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

constexpr float hole = std::numeric_limits<float>::quiet_NaN();

/// A DEM with rows from north to south and heights `height(x, y)`, with x and y in D.
template <typename Height>
Dem dem(glm::ivec2 size, glm::dvec2 first_m, double step_m, const Height& height) {
  std::vector<float> heights_m;
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column)
      heights_m.push_back(
          static_cast<float>(height(first_m.x + column * step_m, first_m.y - row * step_m)));
  }
  return {HeightGrid(size, first_m, {step_m, -step_m}, std::move(heights_m)), {}, {}, {}};
}

/// Returns a copy of a DEM with its heights modified by `change`.
template <typename Change>
Dem changed(const Dem& from, const Change& change) {
  std::vector<float> heights_m(from.grid.heights_m().begin(), from.grid.heights_m().end());
  change(heights_m);
  Dem result = from;
  result.grid = HeightGrid(from.grid.frame().samples, from.grid.origin_m(), from.grid.step_m(),
                           std::move(heights_m));
  return result;
}

double hills(double x, double y) {
  return 20 * std::sin(x / 17) + 15 * std::cos(y / 23) + 5 * std::sin((x + 2 * y) / 9);
}

double figure(const Section& section, const std::string& name) {
  for (const Measure& measure : section.measures) {
    if (measure.name == name) return measure.value;
  }
  ADD_FAILURE() << "there is no figure '" << name << "'";
  return 0;
}

TEST(CompareDems, FindsNoDifferenceBetweenEqualDems) {
  const Dem one = dem({30, 20}, {0, 100}, 2, hills);
  const Section section = compare_dems(one, one, "a");
  for (const char* name : {"height: RMS error", "slope of triangles: largest error",
                           "angle between triangles: largest",
                           "holes in the other alone, and "
                           "what lies beyond it"})
    EXPECT_EQ(figure(section, name), 0) << name;
  EXPECT_EQ(figure(section, "samples that both have"), 600);
  EXPECT_THAT(section.text, AllOf(HasSubstr("sample by sample"), Not(HasSubstr("SHIFTED"))));
  EXPECT_EQ(section.pictures.size(), 1u);
}

// A level plane against itself with 0.5 m added everywhere; one sample has an error of -2 m, and
// there are three holes.
TEST(CompareDems, ReportsKnownErrors) {
  const Dem flat = dem({20, 10}, {0, 0}, 2, [](double, double) { return 100.0; });
  const Dem reference = changed(flat, [](std::vector<float>& heights) { heights[0] = hole; });
  const Dem other = changed(flat, [](std::vector<float>& heights) {
    for (float& height : heights) height += 0.5f;
    heights[3 * 20 + 7] = 98;
    heights[0] = heights[1] = heights[199] = hole;
  });
  const Section section = compare_dems(reference, other, "a");
  EXPECT_EQ(figure(section, "samples that both have"), 197);
  EXPECT_EQ(figure(section, "holes in both"), 1);
  EXPECT_EQ(figure(section, "holes in the reference alone"), 0);
  EXPECT_EQ(figure(section, "holes in the other alone, and what lies beyond it"), 2);
  EXPECT_NEAR(figure(section, "height: mean error"), (196 * 0.5 - 2) / 197, 1e-12);
  EXPECT_NEAR(figure(section, "height: RMS error"), std::sqrt((196 * 0.25 + 4) / 197), 1e-12);
  EXPECT_NEAR(figure(section, "height: median error"), 0.5, 1e-12);
  EXPECT_EQ(figure(section, "height: NMAD, 1.4826 times the median of |error - median|"), 0);
  EXPECT_NEAR(figure(section, "height: largest error"), 2, 1e-12);
  EXPECT_THAT(section.text,
              HasSubstr("The largest height error is in column 7, row 3 (east 14.000 m, north "
                        "-6.000 m): 98 m where the reference has 100 m."));
  EXPECT_THAT(section.tables[0].rows,
              ElementsAre(ElementsAre("0 to 5", "197", ::testing::_, ::testing::_, "0", "0.5")));
}

// The plane z = x tan(30 degrees) against z = x tan(40 degrees), and against its mirror image.
TEST(CompareDems, MeasuresSlopesOfTriangles) {
  const auto tilted = [](double slope_deg) {
    const double slope = std::tan(slope_deg * std::numbers::pi / 180);
    return dem({8, 8}, {0, 0}, 2, [slope](double x, double) { return x * slope; });
  };
  const Section steeper = compare_dems(tilted(30), tilted(40), "a");
  EXPECT_NEAR(figure(steeper, "slope of triangles: mean error"), 10, 1e-5);  // heights are floats
  EXPECT_NEAR(figure(steeper, "angle between triangles: mean"), 10, 1e-5);
  const Section mirrored = compare_dems(tilted(30), tilted(-30), "a");
  EXPECT_NEAR(figure(mirrored, "slope of triangles: mean error"), 0, 1e-5);
  EXPECT_NEAR(figure(mirrored, "angle between triangles: mean"), 60, 1e-5);
  EXPECT_THAT(steeper.tables[0].rows[0][0], "20 to 30");
}

// The fine grid has half the step and heights of its own between the coarse samples: a coarse
// reference compares only its own samples. A fine reference is compared with the coarse grid's
// triangles, split from north-east to south-west: at a cell's centre their height is the mean of
// these two corners.
TEST(CompareDems, ComparesOtherGridsAtTheReferencesSamples) {
  const auto saddle = [](double x, double y) { return x * y / 4; };
  const Dem coarse = dem({2, 2}, {0, 2}, 2, saddle), fine = dem({3, 3}, {0, 2}, 1, saddle);
  EXPECT_EQ(figure(compare_dems(coarse, fine, "a"), "height: largest error"), 0);
  const Section section = compare_dems(fine, coarse, "a");
  EXPECT_EQ(figure(section, "samples that both have"), 9);
  EXPECT_THAT(section.text, HasSubstr("at 5 of the reference's samples the other's height is "
                                      "interpolated on its triangles"));
  // The north-east corner is at 1 m, the south-west one at 0; the saddle is at 1/4 m there.
  EXPECT_NEAR(figure(section, "height: largest error"), 0.25, 1e-12);
  EXPECT_THAT(section.text, HasSubstr("column 1, row 1"));
  EXPECT_NEAR(figure(section, "height: mean error"), 0.25 / 9, 1e-12);
}

TEST(CompareDems, AlignsGridsWithDifferentOriginsAndExtents) {
  const Dem whole = dem({30, 20}, {0, 100}, 2, hills);
  Dem part = dem({10, 10}, {20, 90}, 2, hills);
  part.grid = HeightGrid({10, 10}, {20 - 7 + 1e-7, 90 + 3 - 1e-7}, {2, -2},
                         {part.grid.heights_m().begin(), part.grid.heights_m().end()});
  part.origin_w_m = {7, -3, 0};
  const Section section = compare_dems(whole, part, "a");
  EXPECT_EQ(figure(section, "samples that both have"), 100);
  EXPECT_EQ(figure(section, "beyond the other's extent"), 500);
  EXPECT_EQ(figure(section, "height: largest error"), 0);
  EXPECT_THAT(section.text, HasSubstr("sample by sample"));
}

TEST(CompareDems, DetectsAShiftOfHalfACell) {
  const Dem reference = dem({60, 50}, {0, 100}, 2, hills);
  const Dem shifted =
      dem({60, 50}, {0, 100}, 2, [](double x, double y) { return hills(x - 1, y + 1) + 0.3; });
  const Section section = compare_dems(reference, shifted, "a");
  EXPECT_THAT(section.text,
              AllOf(HasSubstr("THE OTHER SEEMS TO BE SHIFTED"), HasSubstr("PixelIs")));
  // Reads "by EAST m to the east and NORTH m to the north".
  const std::string_view text = section.text;
  const auto words = words_of(text.substr(text.find("by ", text.find("SHIFTED"))));
  ASSERT_GT(words.size(), 7u);
  const double east_m = number_of<double>(words[1]).value_or(0);
  const double north_m = number_of<double>(words[7]).value_or(0);
  EXPECT_NEAR(east_m, 1, 0.05);
  EXPECT_NEAR(north_m, -1, 0.05);
  std::mt19937 random(3);
  std::normal_distribution<float> normal(0, 1);
  const Dem noisy = changed(reference, [&](std::vector<float>& heights) {
    for (float& height : heights) height += normal(random);
  });
  EXPECT_THAT(compare_dems(reference, noisy, "a").text, Not(HasSubstr("SHIFTED")));
}

/// Writes an ESRI ASCII grid and, if `crs` is not empty, its coordinate reference system.
void write_asc(const TemporaryFolder& folder, const std::string& name, double x, double y,
               const std::string& heights, const std::string& crs) {
  write_text(folder / (name + ".asc"), "ncols 3\nnrows 2\nxllcorner " + std::to_string(x) +
                                           "\nyllcorner " + std::to_string(y) +
                                           "\ncellsize 2\nNODATA_value -9999\n" + heights + "\n");
  if (!crs.empty()) write_text(folder / (name + ".prj"), crs);
}

std::string utm(int meridian_deg, int zone) {
  return "PROJCS[\"WGS_1984_UTM_Zone_" + std::to_string(zone) +
         "N\",GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137.0,"
         "298.257223563]],PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],"
         "PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"False_Easting\",500000.0],PARAMETER["
         "\"False_Northing\",0.0],PARAMETER[\"Central_Meridian\"," +
         std::to_string(meridian_deg) +
         ".0],PARAMETER[\"Scale_Factor\",0.9996],PARAMETER[\"Latitude_Of_Origin\",0.0],UNIT["
         "\"Meter\",1.0]]";
}

// 30 x 20 samples, 2 m apart, at 100 m + x; the other is 0.1 m higher, and 7 m higher from x = 40 m
// on, where it is as if it was never measured. East of 500,000 m.
TEST(CompareDems, ComparesOnlyWhatIsInTheScope) {
  Dem reference = dem({30, 20}, {0, 100}, 2, [](double x, double) { return 100 + x; });
  Dem other =
      dem({30, 20}, {0, 100}, 2, [](double x, double) { return 100.1 + x + (x < 40 ? 0 : 6.9); });
  reference.origin_w_m = other.origin_w_m = {500'000, 0, 0};
  constexpr double all = Scope::unbounded;
  constexpr double rounding_m = 2e-5;  // of floats of 160 m
  // x from 10 m to 30 m is 11 columns, y from 70 m to 90 m is 11 rows.
  const Section inner = compare_dems(reference, other, "a",
                                     {.low_m = {500'010, 70, -all}, .high_m = {500'030, 90, all}});
  EXPECT_EQ(figure(inner, "samples that both have"), 121);
  EXPECT_EQ(figure(inner, "outside the area and heights"), 600 - 121);
  EXPECT_NEAR(figure(inner, "height: largest error"), 0.1, rounding_m);
  EXPECT_EQ(figure(inner, "beyond the other's extent"), 0);
  EXPECT_THAT(inner.text, HasSubstr("Only x from 500010 to 500030 m, y from 70 to 90 m of W"));
  EXPECT_EQ(inner.main.size(), 5u);
  EXPECT_EQ(main_measures(inner).size(), 5u);
  EXPECT_THAT(inner.headline, HasSubstr("by 0.1 m at most, at 121 samples."));
  // Heights from 120 m to 130 m are columns 10 to 15.
  const Section heights =
      compare_dems(reference, other, "a", {.low_m = {-all, -all, 120}, .high_m = {all, all, 130}});
  EXPECT_EQ(figure(heights, "samples that both have"), 6 * 20);
  // 20 columns are before x = 40 m, 10 behind.
  const Section near = compare_dems(reference, other, "a", {.ignore_beyond_m = 0.5});
  EXPECT_EQ(figure(near, "samples that both have"), 400);
  EXPECT_NEAR(figure(near, "height: RMS error"), 0.1, rounding_m);
  EXPECT_NEAR(figure(near, "slope of triangles: largest error"), 0, 1e-3);
  const std::string left_out = "left out, farther than 0.5 m from the other surface";
  EXPECT_EQ(figure(near, left_out), 200);
  EXPECT_NEAR(figure(near, left_out + ", share"), 100.0 / 3, 1e-9);
  EXPECT_THAT(
      [&] {
        compare_dems(reference, other, "a",
                     {.low_m = {0, 0, -all}, .high_m = {1, 1, all}, .ignore_beyond_m = 1});
      },
      ThrowsMessage<Error>(HasSubstr("600 of 600 are outside the area and heights")));
}

// The picture of errors states the positions of the edges of its pixels in W.
TEST(CompareDems, DrawErrorsWithPositions) {
  Dem reference = dem({30, 20}, {0, 100}, 2, hills);
  reference.origin_w_m = {1000, 2000, 0};
  Dem other = changed(reference, [](std::vector<float>& heights) { heights[45] += 1; });
  other.origin_w_m = reference.origin_w_m;
  const Section section = compare_dems(reference, other, "a");
  ASSERT_EQ(section.pictures.size(), 3u);
  const Picture& errors = section.pictures.back();
  EXPECT_EQ(errors.shown, Shown::Errors);
  ASSERT_TRUE(errors.across && errors.up && errors.bar);
  EXPECT_EQ(errors.across->low, 999);
  EXPECT_EQ(errors.across->high, 999 + 60);
  EXPECT_EQ(errors.up->low, 2101 - 40);
  EXPECT_EQ(errors.up->high, 2101);
  const auto at = errors.image.at(15, 1);  // sample 45 of rows of 30
  const auto level = errors.image.at(0, 0);
  EXPECT_LT(at[2], 60);      // red
  EXPECT_GT(level[2], 240);  // white
}

TEST(CompareDems, ReadsFilesAndRejectsIncompatibleOnes) {
  const TemporaryFolder folder;
  write_asc(folder, "a", 500000, 5e6, "1 2 3\n4 5 6", utm(3, 31));
  write_asc(folder, "b", 500000, 5e6, "1 2 3\n4 5 7", utm(3, 31));
  write_asc(folder, "c", 500000, 5e6, "1 2 3\n4 -9999 6", "");
  write_asc(folder, "d", 500000, 5e6, "1 2 3\n4 5 6", utm(9, 32));
  write_asc(folder, "e", 500100, 5e6, "1 2 3\n4 5 6", utm(3, 31));
  EXPECT_EQ(figure(compare_dems(folder / "a.asc", folder / "b.asc"), "height: largest error"), 1);
  write_asc(folder, "g", 500000, 5e6, "1 -9999 3\n-9999 5 -9999", utm(3, 31));
  const Section no_triangle = compare_dems(folder / "a.asc", folder / "g.asc");
  EXPECT_EQ(figure(no_triangle, "samples that both have"), 3);
  for (const Measure& measure : no_triangle.measures)
    EXPECT_THAT(measure.name, Not(HasSubstr("triangles")));
  const Section without = compare_dems(folder / "a.asc", folder / "c.asc");
  EXPECT_EQ(figure(without, "holes in the other alone, and what lies beyond it"), 1);
  EXPECT_THAT(without.text, HasSubstr("The other has no coordinate reference system"));
  EXPECT_THAT([&] { compare_dems(folder / "a.asc", folder / "d.asc"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("d.asc: its reference system is "),
                                         HasSubstr("they must be the "
                                                   "same; run"),
                                         HasSubstr("gdalwarp -t_srs"), HasSubstr("31N"))));
  EXPECT_THAT([&] { compare_dems(folder / "a.asc", folder / "e.asc"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("e.asc cannot be compared with"),
                                         HasSubstr("they do not overlap"))));
  write_text(folder / "f.asc", "garbage");
  EXPECT_THAT([&] { compare_dems(folder / "a.asc", folder / "f.asc"); },
              ThrowsMessage<Error>(HasSubstr("f.asc")));
  EXPECT_THAT([&] { compare_dems("/nowhere.tif", folder / "a.asc"); },
              ThrowsMessage<Error>(HasSubstr("/nowhere.tif")));
}

}  // namespace
}  // namespace groundray::golden::dem_comparison_test
