#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>

namespace groundray::testing {

/// Records in the running test's results the fraction of the tolerance that it used, for the table
/// of docs/accuracy.md; checks nothing. Of several calls with the same name the largest fraction is
/// kept. A tolerance of 1 without a unit means that `measured` is already a fraction, of tolerances
/// that vary.
inline void record_margin(const std::string& name, double measured, double tolerance,
                          std::string_view unit = "") {
  const std::string key = "margin: " + name;
  const double share = measured == 0 ? 0 : std::abs(measured / tolerance);
  const ::testing::TestInfo* test = ::testing::UnitTest::GetInstance()->current_test_info();
  for (int i = 0; i < test->result()->test_property_count(); ++i) {
    const ::testing::TestProperty& kept = test->result()->GetTestProperty(i);
    if (kept.key() == key && share <= std::strtod(kept.value(), nullptr)) return;
  }
  ::testing::Test::RecordProperty(
      key, fmt::format("{} {:.3g} {:.3g} {}", share, std::abs(measured), tolerance, unit));
}

}  // namespace groundray::testing
