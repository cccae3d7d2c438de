#include "acquisition/session/json_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scan {
namespace {

constexpr double kRotationTolerance = 1e-4;

bool IsFiniteNumber(const nlohmann::json& value) {
  return value.is_number() && std::isfinite(value.get<double>());
}

// Path of the first number that is not finite; empty when all are.
std::string FindNonFinite(const nlohmann::ordered_json& value, const std::string& path) {
  if (value.is_number_float()) return std::isfinite(value.get<double>()) ? "" : path;
  if (value.is_object())
    for (const auto& [key, member] : value.items())
      if (auto found = FindNonFinite(member, path.empty() ? key : path + "." + key); !found.empty())
        return found;
  if (value.is_array())
    for (std::size_t i = 0; i < value.size(); ++i)
      if (auto found = FindNonFinite(value[i], fmt::format("{}[{}]", path, i)); !found.empty())
        return found;
  return "";
}

}  // namespace

Result<nlohmann::json> ParseJson(std::string_view text, const std::string& file) {
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    return BadInput(fmt::format("not valid JSON near byte {}", error.byte), file,
                    "restore the file or write it again");
  } catch (const nlohmann::json::exception&) {  // a number beyond the range of double
    return BadInput("a number out of range", file, "restore the file or write it again");
  }
}

bool IsId(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
  });
}

std::string MakeId(std::string_view text) {
  std::string id;
  for (char c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    id += IsId(std::string_view(&c, 1)) ? c : '-';
  }
  return id;
}

Result<JsonObject> JsonObject::Root(const nlohmann::json& value, const std::string& file) {
  if (!value.is_object())
    return BadInput("not a JSON object", file, "restore the file or write it again");
  return JsonObject(value, file, "");
}

std::vector<std::string> JsonObject::Keys() const {
  std::vector<std::string> keys;
  for (const auto& [key, member] : value_->items()) keys.push_back(key);
  return keys;
}

const nlohmann::json* JsonObject::Member(std::string_view key) const {
  const auto found = value_->find(std::string(key));
  return found == value_->end() || found->is_null() ? nullptr : &*found;
}

std::string JsonObject::PathOf(std::string_view key) const {
  if (path_.empty()) return std::string(key);
  return key.empty() ? path_ : path_ + "." + std::string(key);
}

tl::unexpected<Error> JsonObject::Wrong(std::string_view key, std::string what,
                                        std::string mend) const {
  const std::string path = PathOf(key);
  return BadInput(std::move(what), path.empty() ? file_ : file_ + ": " + path, std::move(mend));
}

Result<const nlohmann::json*> JsonObject::Required(std::string_view key) const {
  if (const nlohmann::json* member = Member(key)) return member;
  return Wrong(key, "missing field", "add it");
}

Result<double> JsonObject::Number(std::string_view key) const {
  SCAN_TRY(const nlohmann::json* member, Required(key));
  if (!IsFiniteNumber(*member)) return Wrong(key, "not a number", "give a finite number");
  return member->get<double>();
}

Result<double> JsonObject::Number(std::string_view key, double absent) const {
  if (!Has(key)) return absent;
  return Number(key);
}

Result<std::optional<double>> JsonObject::OptionalNumber(std::string_view key) const {
  if (!Has(key)) return std::nullopt;
  SCAN_TRY(const double number, Number(key));
  return number;
}

Result<std::int64_t> JsonObject::Integer(std::string_view key) const {
  SCAN_TRY(const nlohmann::json* member, Required(key));
  if (!member->is_number_integer() ||
      (member->is_number_unsigned() &&
       member->get<std::uint64_t>() > static_cast<std::uint64_t>(INT64_MAX)))
    return Wrong(key, "not an integer", "give an integer of at most 64 bits");
  return member->get<std::int64_t>();
}

Result<int> JsonObject::Int(std::string_view key, int low, int high) const {
  SCAN_TRY(const std::int64_t number, Integer(key));
  if (number < low || number > high)
    return Wrong(key, fmt::format("{} is out of range", number),
                 fmt::format("give {} to {}", low, high));
  return static_cast<int>(number);
}

Result<int> JsonObject::Int(std::string_view key, int low, int high, int absent) const {
  if (!Has(key)) return absent;
  return Int(key, low, high);
}

Result<std::string> JsonObject::Text(std::string_view key) const {
  SCAN_TRY(const nlohmann::json* member, Required(key));
  if (!member->is_string()) return Wrong(key, "not a string", "give a string");
  return member->get<std::string>();
}

Result<std::string> JsonObject::Text(std::string_view key, std::string absent) const {
  if (!Has(key)) return absent;
  return Text(key);
}

Result<std::string> JsonObject::Id(std::string_view key) const {
  SCAN_TRY(std::string text, Text(key));
  if (!IsId(text))
    return Wrong(key, "'" + text + "' is no id", "use only a to z, 0 to 9 and hyphens");
  return text;
}

Result<std::string> JsonObject::Id(std::string_view key, std::string absent) const {
  if (!Has(key)) return absent;
  return Id(key);
}

Result<std::vector<double>> JsonObject::Numbers(std::string_view key, std::size_t count) const {
  SCAN_TRY(const nlohmann::json* member, Required(key));
  if (!member->is_array() || member->size() != count ||
      !std::all_of(member->begin(), member->end(), IsFiniteNumber))
    return Wrong(key, fmt::format("not a list of {} numbers", count),
                 fmt::format("give {} finite numbers", count));
  return member->get<std::vector<double>>();
}

Result<Eigen::Vector3d> JsonObject::Vector3(std::string_view key) const {
  SCAN_TRY(const std::vector<double> numbers, Numbers(key, 3));
  return Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
}

Result<Eigen::MatrixXd> JsonObject::Matrix(std::string_view key, int rows, int columns) const {
  SCAN_TRY(const nlohmann::json* member, Required(key));
  bool good = member->is_array() && member->size() == static_cast<std::size_t>(rows);
  for (int r = 0; good && r < rows; ++r) {
    const nlohmann::json& row = (*member)[static_cast<std::size_t>(r)];
    good = row.is_array() && row.size() == static_cast<std::size_t>(columns) &&
           std::all_of(row.begin(), row.end(), IsFiniteNumber);
  }
  if (!good)
    return Wrong(key, fmt::format("not a matrix of {} rows of {}", rows, columns),
                 "give nested rows of finite numbers");
  Eigen::MatrixXd matrix(rows, columns);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      matrix(r, c) =
          (*member)[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)].get<double>();
  return matrix;
}

Result<Eigen::Isometry3d> JsonObject::Rigid(std::string_view key) const {
  SCAN_TRY(const nlohmann::json* member, Required(key));
  const int rows = member->is_array() && member->size() == 4 ? 4 : 3;
  SCAN_TRY(const Eigen::MatrixXd matrix, Matrix(key, rows, 4));
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool affine = rows == 3 || (matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() < 1e-9;
  const double off = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).norm();
  if (!affine || !(off < kRotationTolerance) || rotation.determinant() < 0)
    return Wrong(key, "not a rigid transform",
                 "the left 3 x 3 must be a rotation (no scale, no mirroring)");
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.linear() = rotation;
  transform.translation() = matrix.topRightCorner<3, 1>();
  return transform;
}

Result<std::optional<Eigen::Isometry3d>> JsonObject::OptionalRigid(std::string_view key) const {
  if (!Has(key)) return std::nullopt;
  SCAN_TRY(const Eigen::Isometry3d transform, Rigid(key));
  return transform;
}

Result<JsonObject> JsonObject::Object(std::string_view key) const {
  SCAN_TRY(const nlohmann::json* member, Required(key));
  if (!member->is_object()) return Wrong(key, "not an object", "give a JSON object");
  return JsonObject(*member, file_, PathOf(key));
}

Result<std::optional<JsonObject>> JsonObject::OptionalObject(std::string_view key) const {
  if (!Has(key)) return std::nullopt;
  SCAN_TRY(JsonObject object, Object(key));
  return object;
}

Result<std::vector<JsonObject>> JsonObject::Objects(std::string_view key) const {
  SCAN_TRY(const nlohmann::json* member, Required(key));
  if (!member->is_array()) return Wrong(key, "not a list", "give a list of objects");
  std::vector<JsonObject> objects;
  for (std::size_t i = 0; i < member->size(); ++i) {
    const std::string element = fmt::format("{}[{}]", key, i);
    if (!(*member)[i].is_object()) return Wrong(element, "not an object", "give a JSON object");
    objects.push_back(JsonObject((*member)[i], file_, PathOf(element)));
  }
  return objects;
}

Result<std::vector<std::string>> JsonObject::Texts(std::string_view key) const {
  SCAN_TRY(const nlohmann::json* member, Required(key));
  if (!member->is_array() ||
      !std::all_of(member->begin(), member->end(),
                   [](const nlohmann::json& text) { return text.is_string(); }))
    return Wrong(key, "not a list of strings", "give a list of strings");
  return member->get<std::vector<std::string>>();
}

nlohmann::ordered_json JsonRows(const Eigen::MatrixXd& matrix) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    nlohmann::ordered_json row = nlohmann::ordered_json::array();
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) row.push_back(matrix(r, c));
    rows.push_back(std::move(row));
  }
  return rows;
}

nlohmann::ordered_json JsonRows(const Eigen::Isometry3d& transform) {
  return JsonRows(Eigen::MatrixXd(transform.matrix().topRows<3>()));
}

nlohmann::ordered_json JsonVector(const Eigen::Vector3d& vector) {
  return nlohmann::ordered_json::array({vector.x(), vector.y(), vector.z()});
}

Result<std::string> DumpJson(const nlohmann::ordered_json& value, int indent,
                             const std::string& file) {
  if (const std::string path = FindNonFinite(value, ""); !path.empty())
    return Failed("a number that is not finite cannot be written", file + ": " + path,
                  "this value must be known before it is written");
  return value.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace scan
