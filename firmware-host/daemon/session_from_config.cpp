#include "firmware-host/daemon/session_from_config.h"

#include <cctype>

#include "acquisition/plan/station_plan.h"

namespace scan {

Result<SessionDocument> MakeSessionDocument(const StationConfig& config, const std::string& id) {
  SessionDocument document;
  document.id = id;
  document.software.version = SCAN_VERSION;
  document.station = DescribeStation(config);
  SCAN_TRY(document.views, PlanOfStation(config));
  return document;
}

std::string SessionIdFrom(const std::string& folder_name) {
  std::string id;
  for (const char c : folder_name) {
    const auto lower = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    id += (lower >= 'a' && lower <= 'z') || (lower >= '0' && lower <= '9') ? lower : '-';
  }
  return id.empty() ? "session" : id;
}

}  // namespace scan
