#include "firmware-host/daemon/operator_prompt.h"

#include <cassert>
#include <utility>

namespace scan {

Result<PromptAnswer> OperatorPrompt::Ask(SpecimenAction action, std::stop_token stop) {
  std::unique_lock lock(mutex_);
  assert(!question_);
  question_ = action;
  answer_.reset();
  const bool answered = changed_.wait(lock, stop, [this] { return answer_.has_value(); });
  question_.reset();
  if (!answered) return Cancelled("the question to the operator");
  return *std::exchange(answer_, std::nullopt);
}

std::optional<SpecimenAction> OperatorPrompt::Question() const {
  const std::lock_guard lock(mutex_);
  return answer_ ? std::nullopt : question_;
}

Status OperatorPrompt::Answer(PromptAnswer answer) {
  {
    const std::lock_guard lock(mutex_);
    if (!question_ || answer_)
      return BadInput("nothing is asked", "answer",
                      "see what the station waits for: scanstation status");
    answer_ = std::move(answer);
  }
  changed_.notify_all();
  return {};
}

}  // namespace scan
