#include <gtest/gtest.h>

#include "core/io/file_io.h"

namespace groundray::file_ending_test {
namespace {

TEST(FileEnding, IsTheLowerCaseExtension) {
  EXPECT_EQ(file_ending("a/b.c/Scan.000.PLY"), ".ply");
  EXPECT_EQ(file_ending("dem.tiF"), ".tif");
  EXPECT_EQ(file_ending("a.b/dem"), "");
  EXPECT_EQ(file_ending(".ply"), "");  // a name that begins with a dot has no ending
}

}  // namespace
}  // namespace groundray::file_ending_test
