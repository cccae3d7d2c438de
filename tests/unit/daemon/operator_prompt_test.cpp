#include "firmware-host/daemon/operator_prompt.h"

#include <gtest/gtest.h>

#include <future>
#include <thread>

namespace scan {
namespace {

void WaitForQuestion(const OperatorPrompt& prompt) {
  while (!prompt.Question()) std::this_thread::yield();
}

TEST(OperatorPrompt, WaitsForTheAnswer) {
  OperatorPrompt prompt;
  for (const bool confirmed : {true, false}) {
    auto asked = std::async(std::launch::async,
                            [&] { return prompt.Ask(SpecimenAction::place, std::stop_token()); });
    WaitForQuestion(prompt);
    EXPECT_EQ(prompt.Question(), SpecimenAction::place);
    ASSERT_TRUE(prompt.Answer({.confirmed = confirmed, .note = "n"}));
    const auto answer = asked.get();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->confirmed, confirmed);
    EXPECT_EQ(answer->note, "n");
    EXPECT_FALSE(prompt.Question());
  }
}

TEST(OperatorPrompt, RefusesAnAnswerToNothing) {
  OperatorPrompt prompt;
  EXPECT_EQ(prompt.Answer({}).error().kind, ErrorKind::bad_input);
}

TEST(OperatorPrompt, EndsWithTheCapture) {
  OperatorPrompt prompt;
  std::stop_source stop;
  auto asked = std::async(std::launch::async,
                          [&] { return prompt.Ask(SpecimenAction::remove, stop.get_token()); });
  WaitForQuestion(prompt);
  stop.request_stop();
  EXPECT_EQ(asked.get().error().kind, ErrorKind::cancelled);
  EXPECT_FALSE(prompt.Question());
  EXPECT_FALSE(prompt.Answer({}));
}

}  // namespace
}  // namespace scan
