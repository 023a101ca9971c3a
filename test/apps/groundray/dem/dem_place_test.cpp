#include "apps/groundray/dem/dem_place.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "terrain/dem/dem_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::dem_place_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string wgs84_31n =
    R"(PROJCRS["WGS 84 / UTM zone 31N",BASEGEOGCRS["WGS 84",DATUM["Simulation Geodetic System 1984",)"
    R"(ELLIPSOID["WGS 84",6378137,298.257223563]],ID["EPSG",4326]],)"
    R"(CONVERSION["UTM zone 31N",METHOD["Transverse Mercator",ID["EPSG",9807]],)"
    R"(PARAMETER["Latitude of natural origin",0],PARAMETER["Longitude of natural origin",3],)"
    R"(PARAMETER["Scale factor at natural origin",0.9996],PARAMETER["False easting",500000],)"
    R"(PARAMETER["False northing",0]],CS[Cartesian,2],AXIS["x",east],AXIS["y",north],)"
    R"(LENGTHUNIT["metre",1]])";

// 5 columns and 4 rows, 2 m apart, with the first sample at (1001, 2007) in W.
NamedDem other(std::string crs_wkt = "", std::string crs_name = "") {
  return {"other.tif",
          {.grid = HeightGrid({5, 4}, {1, 7}, {2, -2}, std::vector<float>(20, 3.0F)),
           .origin_w_m = {1000, 2000, 0},
           .crs_wkt = std::move(crs_wkt),
           .crs_name = std::move(crs_name)}};
}

std::string fault_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

void expect_frame(const GridFrame& frame, glm::ivec2 samples, glm::dvec2 first_m,
                  glm::dvec2 step_m) {
  EXPECT_EQ(frame.samples, samples);
  EXPECT_NEAR(frame.to_D({0, 0}).x, first_m.x, 1e-9);
  EXPECT_NEAR(frame.to_D({0, 0}).y, first_m.y, 1e-9);
  EXPECT_EQ(frame.step_m, step_m);
}

// With D's origin at (1010, 2020), the point (1001, 2007) in W is (-9, -13) in D.
const Georeference moved{.origin_w_m = {1010, 2020, 0}};
const Area points_m{{-8.5, -18.2}, {-3.1, -14.4}};

// Cell borders are whole multiples of 0.5 m; the first row is the northernmost.
TEST(DemPlace, CellSizeCoversThePoints) {
  const PlaceChoice choice{.cell_m = 0.5};
  EXPECT_TRUE(needs_extent(choice));
  expect_frame(choose_frame(choice, moved, points_m), {12, 9}, {-8.75, -14.25}, {0.5, -0.5});
}

TEST(DemPlace, AreaIsGivenInTheWorldFrame) {
  const PlaceChoice choice{.cell_m = 0.5, .area_w = Area{{1000, 2000}, {1003, 2002}}};
  EXPECT_FALSE(needs_extent(choice));
  expect_frame(choose_frame(choice, moved, {}), {6, 4}, {-9.75, -18.25}, {0.5, -0.5});
}

TEST(DemPlace, LikeUsesTheSamplesOfTheOtherDem) {
  PlaceChoice choice{.like = other()};
  EXPECT_FALSE(needs_extent(choice));
  expect_frame(choose_frame(choice, moved, {}), {5, 4}, {-9, -13}, {2, -2});
  // Samples are at x = 1001, 1003, ... and y = 2007, 2005, ...: only samples whose cells lie wholly
  // within the area remain.
  choice.area_w = Area{{1002, 2002}, {1006, 2006}};
  expect_frame(choose_frame(choice, moved, {}), {2, 2}, {-7, -15}, {2, -2});
}

// The truth's rows are at y = 2007 to 2001; the points, at y = 2001.8 to 2005.6, lie in the cells
// of the rows 2005 to 2001.
TEST(DemPlace, TruthIsCroppedToThePoints) {
  const PlaceChoice choice{.truth = other()};
  EXPECT_TRUE(needs_extent(choice));
  expect_frame(choose_frame(choice, moved, points_m), {4, 3}, {-9, -15}, {2, -2});
  EXPECT_THAT(fault_of([&] { choose_frame(choice, {}, points_m); }),
              AllOf(HasSubstr("other.tif"), HasSubstr("no point is within its extent")));
}

TEST(DemPlace, RequiresACellSizeOrAnotherDem) {
  EXPECT_THAT(fault_of([] { choose_frame({}, moved, points_m); }),
              AllOf(HasSubstr("--cell-m"), HasSubstr("--like")));
}

TEST(DemPlace, AdoptsTheOnlyKnownCrs) {
  Georeference none;
  agree_on_crs({.like = other(wgs84_31n, "WGS 84 / UTM zone 31N")}, none);
  EXPECT_EQ(none.crs_wkt, wgs84_31n);
  EXPECT_EQ(none.crs_name, "WGS 84 / UTM zone 31N");
  // A DEM without a CRS leaves the points' CRS as it is, and a CRS under another name is the same
  // CRS.
  std::string worded = wgs84_31n;
  worded.replace(worded.find("WGS 84 / UTM zone 31N"), 21, "named by somebody else");
  for (const std::string& wkt : {std::string(), worded}) {
    Georeference points{.crs_name = "WGS 84 / UTM zone 31N", .crs_wkt = wgs84_31n};
    agree_on_crs({.truth = other(wkt, "named by somebody else")}, points);
    EXPECT_EQ(points.crs_wkt, wgs84_31n);
  }
}

TEST(DemPlace, RejectsAnotherCrs) {
  const Dem real = load_dem(testing::data_folder() / "terrain/prairie_1m.tif");
  Georeference points{.crs_name = "WGS 84 / UTM zone 31N", .crs_wkt = wgs84_31n};
  const PlaceChoice choice{.like = other(real.crs_wkt, real.crs_name)};
  EXPECT_THAT(fault_of([&] { agree_on_crs(choice, points); }),
              AllOf(HasSubstr("other.tif: its CRS is NAD83 / UTM zone 15N"),
                    HasSubstr("points is WGS 84 / UTM zone 31N"), HasSubstr("gdalwarp")));
  // If two DEMs differ, the points get the CRS of the first, and the second is rejected.
  Georeference nameless;
  const PlaceChoice two{.like = other(wgs84_31n, "WGS 84 / UTM zone 31N"),
                        .truth = other(real.crs_wkt, real.crs_name)};
  EXPECT_THAT(fault_of([&] { agree_on_crs(two, nameless); }), HasSubstr("its CRS is NAD83"));
}

}  // namespace
}  // namespace groundray::dem_place_test
