// The pieces that session.json and log.jsonl share.
#pragma once

#include <nlohmann/json.hpp>

#include "acquisition/session/json_fields.h"
#include "acquisition/session/session_document.h"

namespace scan {

nlohmann::ordered_json ToJson(const PlannedView& view);
Result<PlannedView> PlannedViewFrom(const JsonObject& object);

nlohmann::ordered_json ToJson(const PriorSigma& sigma);
Result<PriorSigma> PriorSigmaFrom(const JsonObject& object);

}  // namespace scan
