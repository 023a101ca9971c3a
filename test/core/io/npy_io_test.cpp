#include "core/io/npy_io.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>

#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::npy_io_test {
namespace {

// The header and data that numpy.save of NumPy 2.4 writes.
TEST(WriteNpy, MatchesTheBytesOfNumpy) {
  const testing::TemporaryFolder folder;
  const auto path = folder.path() / "a.npy";
  const std::array<float, 3> values = {1.5f, -2.f, 0.f};
  write_npy(path, {{"", "<f4"}}, 3, std::as_bytes(std::span(values)));
  std::string expected = "\x93NUMPY";
  expected += std::string("\x01\x00\x76\x00", 4);
  expected += "{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }";
  expected.append(60, ' ');
  expected += '\n';
  expected.append(reinterpret_cast<const char*>(values.data()), sizeof values);
  EXPECT_EQ(read_text(path), expected);
}

TEST(WriteNpy, WritesRowsOfSeveralFields) {
  const testing::TemporaryFolder folder;
  const auto path = folder.path() / "a.npy";
  std::array<std::byte, 24> rows{};
  write_npy(path, {{"pulse", "<u4"}, {"start_s", "<f8"}}, 2, rows);
  const std::string bytes = read_text(path);
  EXPECT_NE(bytes.find("{'descr': [('pulse', '<u4'), ('start_s', '<f8')], 'fortran_order': False, "
                       "'shape': (2,), }"),
            std::string::npos);
  EXPECT_EQ((bytes.size() - rows.size()) % 64, 0);
}

}  // namespace
}  // namespace groundray::npy_io_test
