// The pieces that session.json shares with log.jsonl and other files.
#pragma once

#include <nlohmann/json.hpp>

#include "acquisition/session/json_fields.h"
#include "acquisition/session/session_document.h"

namespace scan {

nlohmann::ordered_json ToJson(const PlannedView& view);
Result<PlannedView> PlannedViewFrom(const JsonObject& object);

nlohmann::ordered_json ToJson(const Intrinsics& intrinsics);

nlohmann::ordered_json ToJson(const PriorSigma& sigma);
Result<PriorSigma> PriorSigmaFrom(const JsonObject& object);

}  // namespace scan
