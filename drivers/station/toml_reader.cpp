#include "drivers/station/toml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scan {

std::string TomlReader::PathOf(std::string_view key) const {
  return key_.empty() ? std::string(key) : fmt::format("{}.{}", key_, key);
}

void TomlReader::Refuse(const toml::node& node, std::string_view key, const std::string& what,
                        const std::string& mend) {
  if (error_) return;
  error_ = Error{ErrorKind::bad_input, fmt::format("{} {}", PathOf(key), what),
                 fmt::format("{}:{}", source_, node.source().begin.line), mend};
}

const toml::node* TomlReader::Take(std::string_view key) {
  known_.emplace(key);
  return error_ ? nullptr : table_.get(key);
}

void TomlReader::Number(std::string_view key, double& value, double low, double high) {
  const toml::node* node = Take(key);
  if (!node) return;
  const auto number = node->value<double>();
  if (!node->is_number() || !number) {
    Refuse(*node, key, "is not a number", fmt::format("give a number from {} to {}", low, high));
  } else if (!(*number >= low && *number <= high)) {
    Refuse(*node, key, fmt::format("= {} is out of range", *number),
           fmt::format("give a number from {} to {}", low, high));
  } else {
    value = *number;
  }
}

void TomlReader::Number(std::string_view key, std::optional<double>& value, double low,
                        double high) {
  if (!table_.contains(key)) {
    known_.emplace(key);
    return;
  }
  double number = 0;
  Number(key, number, low, high);
  value = number;
}

void TomlReader::Integer(std::string_view key, std::int64_t& value, std::int64_t low,
                         std::int64_t high) {
  const toml::node* node = Take(key);
  if (!node) return;
  const auto* number = node->as_integer();
  if (!number) {
    Refuse(*node, key, "is not a whole number",
           fmt::format("give a whole number from {} to {}", low, high));
  } else if (number->get() < low || number->get() > high) {
    Refuse(*node, key, fmt::format("= {} is out of range", number->get()),
           fmt::format("give a whole number from {} to {}", low, high));
  } else {
    value = number->get();
  }
}

void TomlReader::Integer(std::string_view key, int& value, int low, int high) {
  std::int64_t wide = value;
  Integer(key, wide, std::int64_t{low}, std::int64_t{high});
  value = static_cast<int>(wide);
}

void TomlReader::Flag(std::string_view key, bool& value) {
  const toml::node* node = Take(key);
  if (!node) return;
  if (const auto* flag = node->as_boolean()) {
    value = flag->get();
  } else {
    Refuse(*node, key, "is neither true nor false", "give true or false, without quotes");
  }
}

void TomlReader::Text(std::string_view key, std::string& value) {
  const toml::node* node = Take(key);
  if (!node) return;
  if (const auto* text = node->as_string()) {
    value = text->get();
  } else {
    Refuse(*node, key, "is not a text", "put it in double quotes");
  }
}

std::optional<std::size_t> TomlReader::Word(std::string_view key,
                                            const std::vector<std::string>& words) {
  const toml::node* node = Take(key);
  if (!node) return std::nullopt;
  const auto* text = node->as_string();
  const auto found = text ? std::find(words.begin(), words.end(), text->get()) : words.end();
  if (found == words.end()) {
    Refuse(*node, key,
           text ? fmt::format("= \"{}\" is none of its words", text->get()) : "is not a text",
           fmt::format("choose one of \"{}\"", fmt::join(words, "\", \"")));
    return std::nullopt;
  }
  return static_cast<std::size_t>(found - words.begin());
}

void TomlReader::Vector3(std::string_view key, double* values, double low, double high) {
  const toml::node* node = Take(key);
  if (!node) return;
  const std::string mend = fmt::format("give [x, y, z], each from {} to {}", low, high);
  const toml::array* list = node->as_array();
  if (!list || list->size() != 3) {
    Refuse(*node, key, "is not a list of three numbers", mend);
    return;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const toml::node& entry = (*list)[i];
    const auto number = entry.value<double>();
    if (!entry.is_number() || !number || !(*number >= low && *number <= high)) {
      Refuse(entry, key, "has an entry that is no number in range", mend);
      return;
    }
    values[i] = *number;
  }
}

void TomlReader::RefuseValue(std::string_view key, const std::string& what,
                             const std::string& mend) {
  if (const toml::node* node = Take(key)) Refuse(*node, key, what, mend);
}

void TomlReader::Scalars(std::map<std::string, std::string>& values) {
  for (const auto& [key, node] : table_) {
    const std::string name(key.str());
    if (!Take(name)) return;
    if (const auto* text = node.as_string())
      values[name] = text->get();
    else if (const auto* number = node.as_integer())
      values[name] = std::to_string(number->get());
    else if (const auto* flag = node.as_boolean())
      values[name] = flag->get() ? "true" : "false";
    else
      Refuse(node, name, "is neither a whole number nor true, false or a text",
             "give one of these; 'scanstation device camera controls' shows the choices");
  }
}

void TomlReader::RefuseUnknown() {
  if (error_) return;
  for (const auto& [key, node] : table_) {
    if (known_.contains(key.str())) continue;
    error_ = Error{ErrorKind::bad_input, fmt::format("unknown key {}", PathOf(key.str())),
                   fmt::format("{}:{}", source_, key.source().begin.line),
                   fmt::format("remove it, or choose one of: {}", fmt::join(known_, ", "))};
    return;
  }
}

}  // namespace scan
