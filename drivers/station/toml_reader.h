// One TOML table, read key by key: wrong types, ranges and unknown keys become errors with a line.
#pragma once

#include <toml++/toml.h>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// Remembers the first error; after it every read does nothing. A key that is absent leaves its
// value as it was. Ranges are inclusive.
class TomlReader {
 public:
  // `key` is the table's own path in the file, empty for the root. `error` outlives the reader.
  TomlReader(const toml::table& table, std::string source, std::string key,
             std::optional<Error>& error)
      : table_(table), source_(std::move(source)), key_(std::move(key)), error_(error) {}

  void Number(std::string_view key, double& value, double low, double high);
  void Number(std::string_view key, std::optional<double>& value, double low, double high);
  void Integer(std::string_view key, std::int64_t& value, std::int64_t low, std::int64_t high);
  void Integer(std::string_view key, int& value, int low, int high);
  void Flag(std::string_view key, bool& value);
  void Text(std::string_view key, std::string& value);
  // One of some words; gives its place among them.
  std::optional<std::size_t> Word(std::string_view key, const std::vector<std::string>& words);
  // Every key of the table, whatever its name, as text: whole numbers, true, false and texts.
  void Scalars(std::map<std::string, std::string>& values);
  void Vector3(std::string_view key, double* values, double low, double high);

  // A table below this one, read by `read(TomlReader&)`; its own unknown keys are refused.
  template <class Read>
  void Table(std::string_view key, Read read) {
    const toml::node* node = Take(key);
    if (!node) return;
    if (const toml::table* table = node->as_table()) {
      TomlReader reader(*table, source_, PathOf(key), error_);
      read(reader);
      reader.RefuseUnknown();
    } else {
      Refuse(*node, key, "is not a table", "write it as [" + PathOf(key) + "]");
    }
  }
  // A list of tables ([[key]]), which replaces `items` when it is there.
  template <class Item, class Read>
  void Tables(std::string_view key, std::vector<Item>& items, Read read) {
    const toml::node* node = Take(key);
    if (!node) return;
    const toml::array* list = node->as_array();
    if (!list) {
      Refuse(*node, key, "is not a list of tables", "write it as [[" + PathOf(key) + "]]");
      return;
    }
    items.clear();
    for (const toml::node& entry : *list) {
      if (const toml::table* table = entry.as_table()) {
        TomlReader reader(*table, source_, PathOf(key), error_);
        items.push_back(read(reader));
        reader.RefuseUnknown();
      } else {
        Refuse(entry, key, "is not a list of tables", "write it as [[" + PathOf(key) + "]]");
      }
    }
  }

  void RefuseUnknown();
  // For what only the caller can judge. Precondition: the key was read and is there.
  void RefuseValue(std::string_view key, const std::string& what, const std::string& mend);

 private:
  const toml::node* Take(std::string_view key);
  std::string PathOf(std::string_view key) const;
  void Refuse(const toml::node& node, std::string_view key, const std::string& what,
              const std::string& mend);

  const toml::table& table_;
  std::string source_, key_;
  std::optional<Error>& error_;
  std::set<std::string, std::less<>> known_;
};

}  // namespace scan
