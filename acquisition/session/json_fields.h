// Reading JSON with errors that name the file and the path of the field.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/base/result.h"

namespace scan {

// The value behind `text`. Errors: bad_input naming `file` and the byte of the damage.
Result<nlohmann::json> ParseJson(std::string_view text, const std::string& file);

// True for [a-z0-9-]+, the form of every id in a session.
bool IsId(std::string_view text);

// Every character outside [a-z0-9-] replaced by '-', in lower case.
std::string MakeId(std::string_view text);

// A JSON object, where it stands (file and path), and its members by key. A member that is null
// counts as absent. Refers to the json value, which must outlive it.
// Errors of every getter: bad_input for an absent member without default, another type, a number
// out of range.
class JsonObject {
 public:
  static Result<JsonObject> Root(const nlohmann::json& value, const std::string& file);

  bool Has(std::string_view key) const { return Member(key) != nullptr; }
  std::vector<std::string> Keys() const;

  Result<double> Number(std::string_view key) const;
  Result<double> Number(std::string_view key, double absent) const;
  Result<std::optional<double>> OptionalNumber(std::string_view key) const;
  Result<std::int64_t> Integer(std::string_view key) const;
  // Within [low, high].
  Result<int> Int(std::string_view key, int low, int high) const;
  Result<int> Int(std::string_view key, int low, int high, int absent) const;
  Result<std::string> Text(std::string_view key) const;
  Result<std::string> Text(std::string_view key, std::string absent) const;
  Result<std::string> Id(std::string_view key) const;
  Result<std::string> Id(std::string_view key, std::string absent) const;
  Result<std::vector<double>> Numbers(std::string_view key, std::size_t count) const;
  Result<Eigen::Vector3d> Vector3(std::string_view key) const;
  // `rows` rows of `columns` finite numbers.
  Result<Eigen::MatrixXd> Matrix(std::string_view key, int rows, int columns) const;
  // A rigid transform as 3 (or 4) rows of 4; its rotation is right to 1e-4.
  Result<Eigen::Isometry3d> Rigid(std::string_view key) const;
  Result<std::optional<Eigen::Isometry3d>> OptionalRigid(std::string_view key) const;
  Result<JsonObject> Object(std::string_view key) const;
  Result<std::optional<JsonObject>> OptionalObject(std::string_view key) const;
  Result<std::vector<JsonObject>> Objects(std::string_view key) const;
  Result<std::vector<std::string>> Texts(std::string_view key) const;

  // One of `names`, as an enumeration whose values count from 0 in that order.
  template <class Enum, std::size_t N>
  Result<Enum> Choice(std::string_view key, const std::string_view (&names)[N]) const {
    SCAN_TRY(const std::string text, Text(key));
    for (std::size_t i = 0; i < N; ++i)
      if (names[i] == text) return static_cast<Enum>(i);
    std::string list;
    for (const auto name : names) list += (list.empty() ? "" : ", ") + std::string(name);
    return Wrong(key, "unknown value '" + text + "'", "use one of " + list);
  }

  // bad_input at the member `key` (or at this object where `key` is empty).
  tl::unexpected<Error> Wrong(std::string_view key, std::string what, std::string mend) const;

 private:
  JsonObject(const nlohmann::json& value, std::string file, std::string path)
      : value_(&value), file_(std::move(file)), path_(std::move(path)) {}
  const nlohmann::json* Member(std::string_view key) const;
  Result<const nlohmann::json*> Required(std::string_view key) const;
  std::string PathOf(std::string_view key) const;

  const nlohmann::json* value_;
  std::string file_;
  std::string path_;
};

// JSON rows of a transform or matrix, for writing.
nlohmann::ordered_json JsonRows(const Eigen::MatrixXd& matrix);
nlohmann::ordered_json JsonRows(const Eigen::Isometry3d& transform);
nlohmann::ordered_json JsonVector(const Eigen::Vector3d& vector);

// Text of `value` with keys in the order given and doubles that read back the same; one line where
// `indent` is negative. Errors: failed, naming the first number that is not finite.
Result<std::string> DumpJson(const nlohmann::ordered_json& value, int indent,
                             const std::string& file);

}  // namespace scan
