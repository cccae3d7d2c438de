#include "acquisition/twins/replay_script.h"

#include <fmt/format.h>

#include <utility>

#include "acquisition/runner/run_words.h"
#include "drivers/base/files.h"
#include "drivers/base/sha256.h"

namespace scan {

Result<std::shared_ptr<ReplayScript>> ReplayScript::Open(const std::filesystem::path& session) {
  SCAN_TRY(Session read, ReadSession(session));
  if (read.log.empty())
    return BadInput("the recording is empty", session.string(), "name a captured session");
  return std::shared_ptr<ReplayScript>(new ReplayScript(std::move(read)));
}

const LogEntry* ReplayScript::Next() const {
  std::lock_guard lock(mutex_);
  return next_ < session_.log.size() ? &session_.log[next_] : nullptr;
}

const LogEntry* ReplayScript::Last() const {
  std::lock_guard lock(mutex_);
  return next_ > 0 ? &session_.log[next_ - 1] : nullptr;
}

Timestamp ReplayScript::Stamp() {
  std::lock_guard lock(mutex_);
  if (next_ >= session_.log.size()) return session_.log.back().time;
  const Timestamp time = session_.log[next_++].time;
  TellControl();
  return time;
}

void ReplayScript::TellControl() {
  if (!control_ || next_ >= session_.log.size()) return;
  const LogPayload& payload = session_.log[next_].payload;
  if (std::holds_alternative<PauseEntry>(payload)) control_->Pause();
  if (std::holds_alternative<StopEntry>(payload)) control_->Cancel();
  if (const auto* resume = std::get_if<ResumeEntry>(&payload);
      resume && resume->reason == run_words::kAfterPause)
    control_->Resume();
}

void ReplayScript::Bind(CaptureControl* control) {
  std::lock_guard lock(mutex_);
  control_ = control;
}

Result<std::vector<EncodedFile>> ReplayScript::ReadPictures(
    const std::vector<FileDocument>& files) const {
  std::vector<EncodedFile> pictures;
  for (const FileDocument& file : files) {
    const std::filesystem::path path = session_.folder / file.path;
    auto bytes = ReadBinaryFile(path);
    if (!bytes || Sha256Hex(*bytes) != file.sha256)
      return DeviceFault("the recording's picture is missing or altered", path.string(),
                         "restore the recorded session");
    std::string extension = path.extension().string();
    pictures.push_back({extension.empty() ? extension : extension.substr(1), std::move(*bytes)});
  }
  return pictures;
}

tl::unexpected<Error> ReplayScript::Missing(const std::string& what) const {
  const LogEntry* next = Next();
  const std::string place =
      next ? fmt::format("at document {} ({})", next->seq, TypeName(next->payload))
           : fmt::format("after its last document {}", session_.log.back().seq);
  return DeviceFault(fmt::format("the recording has no {} {}", what, place),
                     session_.folder.string(),
                     "replay with the plan and the options of the recording");
}

}  // namespace scan
