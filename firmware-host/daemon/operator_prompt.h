// A question to the person at the station, answered over any of the daemon's interfaces.
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>

#include "acquisition/runner/runner.h"
#include "drivers/base/result.h"

namespace scan {

// Thread contract: any thread; one question at a time.
class OperatorPrompt {
 public:
  // Waits for the answer. Errors: cancelled when `stop` is requested.
  Result<PromptAnswer> Ask(SpecimenAction action, std::stop_token stop);
  // What is being asked now.
  std::optional<SpecimenAction> Question() const;
  // Errors: bad_input while nothing is asked.
  Status Answer(PromptAnswer answer);

 private:
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<SpecimenAction> question_;
  std::optional<PromptAnswer> answer_;
};

}  // namespace scan
