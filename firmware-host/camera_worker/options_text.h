// A worker's options as text: every field by its name, for both directions.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "drivers/base/result.h"

namespace scan {

// `for_each_field(options, visit)` calls visit(name, field) for every field. What is no UTF-8 is
// replaced.
template <class Options, class ForEachField>
std::string OptionsText(const Options& options, ForEachField for_each_field) {
  nlohmann::json json = nlohmann::json::object();
  for_each_field(options, [&](const char* name, const auto& field) { json[name] = field; });
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// Errors: bad_input, for what OptionsText did not write.
template <class Options, class ForEachField>
Result<Options> OptionsFromText(const std::string& text, ForEachField for_each_field) {
  try {
    const auto json = nlohmann::json::parse(text);
    Options options;
    for_each_field(options, [&](const char* name, auto& field) { json.at(name).get_to(field); });
    return options;
  } catch (const nlohmann::json::exception& e) {
    return BadInput(std::string("malformed options (") + e.what() + ")", "camera worker",
                    "use programs of the same version");
  }
}

}  // namespace scan
