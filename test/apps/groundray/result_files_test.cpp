#include "apps/groundray/result_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::result_files_test {
namespace {

using groundray::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

void put(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  std::ranges::sort(names);
  return names;
}

TEST(ResultFiles, AppearTogether) {
  const TemporaryFolder folder;
  const fs::path a = folder.path() / "a.tif", b = folder.path() / "b.json";
  put(b, "old");
  {
    ResultFiles files;
    files.write(a, [](const fs::path& path) { put(path, "A"); });
    files.write(b, [](const fs::path& path) { put(path, "B"); });
    EXPECT_FALSE(fs::exists(a));
    EXPECT_EQ(text_of(b), "old");
    files.appear();
  }
  EXPECT_THAT(names_in(folder.path()), ElementsAre("a.tif", "b.json"));
  EXPECT_EQ(text_of(a), "A");
  EXPECT_EQ(text_of(b), "B");
}

TEST(ResultFiles, LeaveNoTemporaryFilesOnFailure) {
  const TemporaryFolder folder;
  const fs::path a = folder.path() / "a.tif";
  const auto fail = [](const fs::path& path) { throw Error("{}: no space", path.string()); };
  try {
    ResultFiles files;
    files.write(a, fail);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()),
              a.string() + ": no space");  // the final path, not that of the temporary file
  }
  EXPECT_THAT(names_in(folder.path()), ElementsAre());
}

// A folder is in the way of the third file; the first file was new, and the second replaced
// another.
TEST(ResultFiles, AreRolledBackIfOneCannotAppear) {
  const TemporaryFolder folder;
  const fs::path a = folder.path() / "a.tif", b = folder.path() / "b.json",
                 c = folder.path() / "c.png";
  put(b, "old");
  {
    ResultFiles files;
    for (const fs::path& path : {a, b, c})
      files.write(path, [](const fs::path& aside) { put(aside, "new"); });
    fs::create_directory(c);
    put(c / "full", "x");
    try {
      files.appear();
      FAIL();
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr("c.png: cannot be written"),
                                      Not(HasSubstr("written nevertheless"))));
    }
  }
  EXPECT_THAT(names_in(folder.path()), ElementsAre("b.json", "c.png"));
  EXPECT_EQ(text_of(b), "old");
}

// The second file replaces the link through which the first is reached, so the first cannot be
// undone before the second.
TEST(ResultFiles, KeepBackupsIfRollbackFails) {
  const TemporaryFolder folder;
  const fs::path real = folder.path() / "real", link = folder.path() / "link.tif",
                 full = folder.path() / "full.tif", old = link / "b.tif";
  fs::create_directory(real);
  fs::create_directory_symlink(real, link);
  put(old, "old");
  std::string reported;
  {
    ResultFiles files;
    for (const fs::path& path : {old, link, full})
      files.write(path, [](const fs::path& aside) { put(aside, "new"); });
    fs::create_directory(full);
    put(full / "x", "x");
    try {
      files.appear();
      FAIL();
    } catch (const Error& error) {
      reported = error.what();
    }
  }
  EXPECT_THAT(names_in(folder.path()), ElementsAre("full.tif", "link.tif", "real"));
  EXPECT_EQ(text_of(real / "b.tif"), "new");
  EXPECT_THAT(reported, AllOf(HasSubstr("full.tif: cannot be written"),
                              HasSubstr("b.tif is written nevertheless")));
  const std::string words = "its previous version is kept as ";
  ASSERT_THAT(reported, HasSubstr(words));
  EXPECT_EQ(text_of(reported.substr(reported.find(words) + words.size())), "old");
  EXPECT_EQ(names_in(real).size(), 2u);
}

TEST(ResultFiles, RejectInvalidPathsInAdvance) {
  const TemporaryFolder folder;
  const fs::path a = folder.path() / "a.tif", b = folder.path() / "b.tif";
  put(b, "old");
  const auto fault_of = [](const std::vector<fs::path>& results,
                           const std::vector<fs::path>& inputs) -> std::string {
    try {
      check_results(results, inputs);
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(fault_of({a, b}, {}), "none");
  EXPECT_THAT(fault_of({a, folder.path() / "." / "a.tif"}, {}), HasSubstr("the same name"));
  EXPECT_THAT(fault_of({a, b}, {b}), HasSubstr("it is an input"));
  EXPECT_THAT(fault_of({folder.path() / "no" / "a.tif"}, {}), HasSubstr("there is no folder"));
  EXPECT_THAT(fault_of({folder.path()}, {}), HasSubstr("a folder"));
}

}  // namespace
}  // namespace groundray::result_files_test
