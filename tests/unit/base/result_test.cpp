#include "drivers/base/result.h"

#include <gtest/gtest.h>

namespace scan {
namespace {

Result<int> Half(int x) {
  if (x % 2) return BadInput("odd number", "argument x", "give an even one");
  return x / 2;
}
Result<int> Quarter(int x) {
  SCAN_TRY(const int half, Half(x));
  SCAN_CHECK(Half(half));
  return half / 2;
}

TEST(Result, TryPassesValuesAndErrorsOn) {
  EXPECT_EQ(Quarter(8).value(), 2);
  EXPECT_EQ(Quarter(6).error().kind, ErrorKind::bad_input);
}

TEST(Result, AnErrorIsOneLineWithWhatWhereAndMend) {
  EXPECT_EQ(ToString(Error{ErrorKind::failed, "disk\nfull", "/x", "free space"}),
            "disk full: /x; free space");
}

TEST(Result, ExitCodesFollowTheKind) {
  EXPECT_EQ(ExitCode(Error{ErrorKind::failed, "", "", ""}), 1);
  EXPECT_EQ(ExitCode(Error{ErrorKind::device, "", "", ""}), 1);
  EXPECT_EQ(ExitCode(Error{ErrorKind::bad_input, "", "", ""}), 2);
  EXPECT_EQ(ExitCode(Error{ErrorKind::cancelled, "", "", ""}), 3);
}

}  // namespace
}  // namespace scan
