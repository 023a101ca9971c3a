#include "core/near_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "test/support/temporary_folder.h"

namespace groundray::near_names_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const std::vector<std::string> keys{"duration_s", "dem",       "yaw_deg", "pitch_deg",
                                    "rate_hz",    "speed_m_s", "seed",    "velodyne_vlp16"};

TEST(NearNames, DifferByTheUnit) {
  EXPECT_THAT(near_names("duration", keys), ElementsAre("duration_s"));
  EXPECT_THAT(near_names("duration_ms", keys), ElementsAre("duration_s"));
  EXPECT_THAT(near_names("speed_kmh", keys), ElementsAre("speed_m_s"));
}

TEST(NearNames, DifferByAThirdOfTheLettersPlusOneAtMost) {
  EXPECT_THAT(near_names("sede", keys), ElementsAre("seed"));            // two letters of four
  EXPECT_THAT(near_names("duratoin", keys), ElementsAre("duration_s"));  // beside the unit
  EXPECT_THAT(near_names("ptich_deg", keys), ElementsAre("pitch_deg"));
  EXPECT_THAT(near_names("rpy_deg", keys), IsEmpty());  // equal units make nothing similar
  EXPECT_THAT(near_names("colour", keys), IsEmpty());
  EXPECT_THAT(near_names("", keys), IsEmpty());
}

TEST(NearNames, TheNearestOnesAreListedUpToThree) {
  EXPECT_THAT(near_names("hill", {"hills", "hall", "pill", "kill", "h"}),
              ElementsAre("hills", "hall", "pill"));
  EXPECT_EQ(suggestion("hill", {"hills", "pond"}), "; did you mean 'hills'?");
  EXPECT_EQ(suggestion("hill", {"hills", "pill"}), "; did you mean 'hills' or 'pill'?");
  EXPECT_EQ(suggestion("hill", {"hall", "hell", "hull"}),
            "; did you mean 'hall', 'hell' or 'hull'?");
  EXPECT_EQ(suggestion("hill", {"mountain"}), "");
}

TEST(NearNames, PartsOfNamesAreFoundIfNothingIsNearer) {
  EXPECT_THAT(near_names("vlp16", keys), ElementsAre("velodyne_vlp16"));
  EXPECT_THAT(near_names("pe", keys), IsEmpty());  // two letters say little
}

class WhyNoFile : public ::testing::Test {
 protected:
  void add(const std::string& name) { std::ofstream(folder_ / name) << ""; }
  std::string why(const std::string& name) { return why_no_file(folder_ / name); }

  testing::TemporaryFolder folder_;
};

TEST_F(WhyNoFile, NamesSimilarFiles) {
  for (const char* name : {"hills.tif", "walk.tum", "notes.txt"}) add(name);
  EXPECT_EQ(why("hils.tif"), "there is no such file or folder; did you mean 'hills.tif'?");
  EXPECT_EQ(why("hills.tiff"), "there is no such file or folder; did you mean 'hills.tif'?");
  EXPECT_EQ(why("elevation.tif"),
            "there is no such file or folder; the .tif files there: hills.tif");
  EXPECT_EQ(why("elevation.asc"), "there is no such file or folder");
}

TEST_F(WhyNoFile, ListsFewFilesOnly) {
  for (char c = 'a'; c < 'g'; ++c) add(std::string(8, c) + ".tif");
  EXPECT_EQ(why("elevation.tif"), "there is no such file or folder");
}

TEST_F(WhyNoFile, ReportsFoldersThatExistAndThatDoNot) {
  std::filesystem::create_directory(folder_ / "maps");
  EXPECT_EQ(why("maps"), "it is a folder, but must be a file");
  EXPECT_EQ(why("map/a.tif"),
            "there is no such file or folder, nor the folder " + (folder_ / "map").string());
}

TEST_F(WhyNoFile, LeavesOutNamesThatControlTheTerminal) {
  add("hil\x1bls.tif");
  EXPECT_EQ(why("hills.tif"), "there is no such file or folder");
}

}  // namespace
}  // namespace groundray::near_names_test
