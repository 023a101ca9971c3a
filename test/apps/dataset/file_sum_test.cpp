#include "apps/dataset/file_sum.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::file_sum_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// NIST's example values of SHA-256.
TEST(FileSum, MatchesTheNistExamples) {
  EXPECT_EQ(sha256_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256_of(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(FileSum, IsIndependentOfTheChunkSize) {
  const std::string bytes(300'000, 'x');
  const testing::TemporaryFolder folder;
  write_text(folder / "file", bytes);
  EXPECT_EQ(sum_file(folder / "file"), (FileSum{bytes.size(), sha256_of(bytes)}));
  for (const std::size_t piece : {1u, 7u, 4096u}) {
    Sha256 sum;
    for (std::string_view rest = bytes; !rest.empty();
         rest.remove_prefix(std::min(piece, rest.size())))
      sum.add(rest.substr(0, piece));
    EXPECT_EQ(sum.digits(), sha256_of(bytes)) << piece;
  }
}

TEST(FileSum, AcceptsMoreBytesAfterReturningDigits) {
  Sha256 sum;
  sum.add("a");
  EXPECT_EQ(sum.digits(), sha256_of("a"));
  sum.add("bc");
  EXPECT_EQ(sum.digits(), sha256_of("abc"));
}

TEST(FileSum, RejectsUnreadableFiles) {
  const testing::TemporaryFolder folder;
  EXPECT_THAT([&] { sum_file(folder / "none"); }, ThrowsMessage<Error>(HasSubstr("none")));
  EXPECT_THAT([&] { sum_file(folder.path()); },
              ThrowsMessage<Error>(HasSubstr("it is a folder, but must be a file")));
}

}  // namespace
}  // namespace groundray::file_sum_test
