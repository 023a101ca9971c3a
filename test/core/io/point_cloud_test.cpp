#include "core/io/point_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace groundray::point_cloud_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(PointCloud, ColumnsKeepTheirValuesAsOthersAreAdded) {
  PointCloud cloud(2);
  const auto x = cloud.add<float>("x");
  for (int i = 0; i < 50; ++i) cloud.add<double>("c" + std::to_string(i));
  x[0] = 1;
  x[1] = 2;
  EXPECT_THAT(cloud.column<float>("x"), ElementsAre(1, 2));
  EXPECT_EQ(cloud.columns().size(), 51u);
}

TEST(PointCloud, ReportsInvalidColumns) {
  PointCloud cloud(1);
  cloud.add<float>("x");
  EXPECT_THAT([&] { cloud.add<float>("x"); },
              ThrowsMessage<Error>(HasSubstr("the column 'x' already exists")));
  EXPECT_THAT([&] { cloud.column<double>("x"); },
              ThrowsMessage<Error>(HasSubstr("'x' is not of the requested type")));
  EXPECT_THAT([&] { cloud.column<float>("y"); },
              ThrowsMessage<Error>(HasSubstr("there is no column 'y'; its columns are: x")));
}

}  // namespace
}  // namespace groundray::point_cloud_test
