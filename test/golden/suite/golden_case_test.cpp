#include "apps/golden/suite/golden_case.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::golden::golden_case_test {
namespace {

using ::testing::HasSubstr;

GoldenCase read(const std::string& text) {
  const groundray::testing::TemporaryFolder folder;
  write_text(folder / "case.yaml", text);
  return read_case(folder.path());
}

std::string fault_of(const std::string& text) {
  try {
    read(text);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(GoldenCase, ReadsProductsVariablesAndChecks) {
  const GoldenCase golden = read(R"(groundray_golden: 1
title: A test
products:
  - file: lidar/top/000000.ply
    rows: ring > 0
    let:
      - a: 2 * ring
      - b: a + 1
    checks:
      - {each: x, is: b, within: 1e-9, share: 0.5, because: reasons}
      - {count: 10, because: reasons}
      - {deviation: x, is: 1, within: 0.1, because: reasons}
      - {exact: all, because: reasons}
      - {statistical: [R, G], share: 0.9, because: reasons}
)");
  ASSERT_EQ(golden.products.size(), 1U);
  const ProductChecks& product = golden.products[0];
  EXPECT_EQ(product.product, "lidar/top/000000.ply");
  EXPECT_EQ(product.rows, "ring > 0");
  ASSERT_EQ(product.names.size(), 2U);
  EXPECT_EQ(product.names[1], std::pair(std::string("b"), std::string("a + 1")));
  ASSERT_EQ(product.checks.size(), 5U);
  EXPECT_EQ(std::get<RowsCheck>(product.checks[0].what).share, 0.5);
  EXPECT_EQ(std::get<FigureCheck>(product.checks[1].what).kind, FigureCheck::Kind::Count);
  EXPECT_EQ(std::get<FigureCheck>(product.checks[2].what).kind, FigureCheck::Kind::Deviation);
  EXPECT_TRUE(std::holds_alternative<ExactCheck>(product.checks[3].what));
  EXPECT_EQ(std::get<StatisticalCheck>(product.checks[4].what).columns.size(), 2U);
}

TEST(GoldenCase, ReportsErrorsWithTheirLine) {
  const std::string head = "groundray_golden: 1\ntitle: A\nproducts:\n";
  EXPECT_THAT(
      fault_of(head + "  - file: a.ply\n    checks:\n      - {each: x, is: 1, within: 0}\n"),
      HasSubstr("because"));
  EXPECT_THAT(fault_of(head + "  - file: a.ply\n    checks:\n      - {every: x, because: y}\n"),
              HasSubstr("case.yaml:6:"));
  EXPECT_THAT(
      fault_of(head + "  - file: a.ply\n    checks:\n      - {mean: x, is: 1, because: y}\n"),
      HasSubstr("within"));
  EXPECT_THAT(fault_of(head + "  - file: a.ply\n    checks:\n      - {exact: some, because: y}\n"),
              HasSubstr("must be 'all'"));
  EXPECT_THAT(
      fault_of(head +
               "  - file: a.ply\n    checks:\n      - {mean: x, is: 1, within: 0, because: y}\n"),
      HasSubstr("must have a count"));
  EXPECT_THAT(
      fault_of(head + "  - file: a.ply\n    checks:\n      - {statistical: [], because: y}\n"),
      HasSubstr("must name a column"));
  EXPECT_THAT(fault_of(head + "  - {file: a.ply, checks: []}\n"), HasSubstr("must have a count"));
  EXPECT_THAT(fault_of("groundray_golden: 1\ntitle: A\nproducts: []\n"), HasSubstr("at least one"));
  EXPECT_THAT(fault_of("groundray_golden: 2\ntitle: A\nproducts: []\n"), HasSubstr("case.yaml:1"));
}

TEST(GoldenCase, FoldersAreReadByNameAndFiltered) {
  const groundray::testing::TemporaryFolder folder;
  const std::string text =
      "groundray_golden: 1\ntitle: A\nproducts:\n  - {file: a.ply, checks: [{count: 1, because: "
      "b}]}\n";
  for (const char* name : {"b_case", "a_case", "inputs"})
    std::filesystem::create_directory(folder / name);
  write_text(folder / "a_case/case.yaml", text);
  write_text(folder / "b_case/case.yaml", text);
  const auto all = read_cases(folder.path(), {});
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].name, "a_case");
  EXPECT_EQ(read_cases(folder.path(), {"b_"}).size(), 1U);
  EXPECT_THROW(read_cases(folder.path(), {"none"}), Error);
  EXPECT_THROW(read_cases(folder.path(), {"b_", "none"}), Error);
  EXPECT_THROW(read_cases(folder / "missing", {}), Error);
}

}  // namespace
}  // namespace groundray::golden::golden_case_test
