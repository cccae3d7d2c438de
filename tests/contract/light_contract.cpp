#include "tests/contract/twin.h"

namespace scan {
namespace {

TEST_P(LightContract, SwitchesAndSwitchesAgain) {
  for (const bool on : {true, true, false, false, true}) {
    const Status set = device().Set(on);
    EXPECT_TRUE(set) << ToString(set.error());
  }
}

}  // namespace
}  // namespace scan
