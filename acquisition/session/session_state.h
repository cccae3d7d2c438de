// What a log adds up to: the plan as extended, the aims, the frames that count.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "acquisition/session/log_document.h"
#include "acquisition/session/session_document.h"

namespace scan {

// The rules of a log live here, so that what the writer accepts is what the reader accepts.
// Thread contract: one thread at a time.
class SessionState {
 public:
  explicit SessionState(SessionDocument document);

  // Takes up the next entry. Errors: bad_input naming `where` for an entry that contradicts what
  // came before (seq out of order, an unknown view, a second frame of a view without a retake ...);
  // the state is then unchanged.
  Status Apply(const LogEntry& entry, const std::string& where);
  // Whether Apply would take the entry.
  Status Check(const LogEntry& entry, const std::string& where) const;

  const SessionDocument& document() const { return document_; }
  // The cameras with the aims that the log added.
  const std::vector<CameraDocument>& cameras() const { return document_.station.cameras; }
  // The plan with all its extensions.
  const std::vector<PlannedView>& views() const { return document_.views; }
  const PlannedView* FindView(const std::string& id) const;

  // The frame that counts; null when there is none.
  const FrameEntry* Frame(const std::string& view, int slice) const;
  // Sequence number of that frame's document, -1 when there is none.
  std::int64_t FrameSeq(const std::string& view, int slice) const;
  // True when every slice of the view has a frame.
  bool Complete(const PlannedView& view) const;

  const std::vector<PlateDocument>& plates() const { return plates_; }
  // Paths that a document names, void ones too.
  bool IsNamed(const std::string& path) const { return paths_.contains(path); }
  std::int64_t next_seq() const { return next_seq_; }
  bool started() const { return next_seq_ > 0; }

 private:
  using Key = std::pair<std::string, int>;  // view, slice
  struct CountedFrame {
    std::int64_t seq = 0;
    FrameEntry frame;
  };

  Status CheckFrame(const FrameEntry& frame, const std::string& where) const;
  Status CheckPlan(const PlanExtendEntry& extension, const std::string& where) const;
  Status CheckFiles(const std::vector<FileDocument>& files, const std::string& where) const;
  const CameraDocument* FindCamera(const std::string& id) const;
  void AddAim(const AimEntry& aim);

  SessionDocument document_;
  std::map<std::string, std::size_t> view_index_;
  std::map<Key, CountedFrame> frames_;
  std::vector<PlateDocument> plates_;
  std::set<std::string> paths_;
  std::int64_t next_seq_ = 0;
};

}  // namespace scan
