#include "apps/golden/compare/error_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace groundray::golden::error_figures_test {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;

// Expected values: numpy.quantile([3, 1, 4, 1, 5, 9, 2, 6], q).
TEST(ErrorFigures, QuantilesMatchNumPy) {
  const std::vector<double> values{3, 1, 4, 1, 5, 9, 2, 6};
  EXPECT_DOUBLE_EQ(quantile(values, 0), 1);
  EXPECT_DOUBLE_EQ(quantile(values, 0.25), 1.75);
  EXPECT_DOUBLE_EQ(quantile(values, 0.5), 3.5);
  EXPECT_DOUBLE_EQ(quantile(values, 0.95), 7.95);
  EXPECT_DOUBLE_EQ(quantile(values, 1), 9);
  EXPECT_DOUBLE_EQ(quantile({7}, 0.3), 7);
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(ErrorFigures, MatchTheirDefinitions) {
  const ErrorFigures figures = figures_of({1, -5, 2, 2, 5});
  EXPECT_EQ(figures.count, 5u);
  EXPECT_DOUBLE_EQ(figures.mean, 1);
  EXPECT_DOUBLE_EQ(figures.rms, std::sqrt(59.0 / 5));
  EXPECT_DOUBLE_EQ(figures.mean_size, 3);
  EXPECT_DOUBLE_EQ(figures.median, 2);
  EXPECT_DOUBLE_EQ(figures.median_size, 2);
  EXPECT_DOUBLE_EQ(figures.p95_size, 5);
  EXPECT_DOUBLE_EQ(figures.largest, 5);
  EXPECT_EQ(figures.worst, 1u);
  EXPECT_DOUBLE_EQ(figures.nmad, 1.4826);  // median of 1, 7, 0, 0, 3, times 1.4826
  EXPECT_EQ(figures_of({}).count, 0u);
}

TEST(ErrorFigures, AreNaNAndNotReportedWithoutErrors) {
  const ErrorFigures figures = figures_of({});
  for (const double figure :
       {figures.mean, figures.rms, figures.mean_size, figures.median, figures.median_size,
        figures.p95_size, figures.p99_size, figures.largest, figures.nmad})
    EXPECT_TRUE(std::isnan(figure));
  Section section;
  tell_errors(section, "a", "m", {});
  tell_sizes(section, "b", "m", {});
  EXPECT_TRUE(section.measures.empty());
  EXPECT_TRUE(section.histograms.empty());
}

TEST(ErrorFigures, AreComparedWithTheirLimits) {
  Section section;
  tell(section, "a", 3, "m");
  hold(section, "b", 3, "m", 3, "why");
  hold(section, "c", std::nextafter(3, 4), "m", 3, "why");
  hold(section, "d", std::nan(""), "m", 3, "why");
  fail(section, "e", 3, "m", "why");
  std::vector<Verdict> verdicts;
  for (const Measure& measure : section.measures) verdicts.push_back(measure.verdict);
  EXPECT_THAT(verdicts, ElementsAre(Verdict::Told, Verdict::Passed, Verdict::Failed,
                                    Verdict::Failed, Verdict::Failed));
  EXPECT_EQ(section.measures[0].limit, std::nullopt);
  EXPECT_EQ(section.measures[4].limit, std::nullopt);
  EXPECT_THAT(*section.measures[1].limit, DoubleEq(3));
}

}  // namespace
}  // namespace groundray::golden::error_figures_test
