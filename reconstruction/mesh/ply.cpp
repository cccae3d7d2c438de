// Polygon File Format (Turk 1994): ASCII and binary, any elements and properties.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "reconstruction/mesh/formats.h"
#include "reconstruction/mesh/text_scanner.h"

namespace scan {
namespace {

enum class Scalar { i8, u8, i16, u16, i32, u32, f32, f64 };
enum class Encoding { ascii, little, big };

struct Property {
  std::string name;
  Scalar type = Scalar::f32;
  std::optional<Scalar> count_type;  // of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
};

std::optional<Scalar> ScalarNamed(std::string_view word) {
  if (word == "char" || word == "int8") return Scalar::i8;
  if (word == "uchar" || word == "uint8") return Scalar::u8;
  if (word == "short" || word == "int16") return Scalar::i16;
  if (word == "ushort" || word == "uint16") return Scalar::u16;
  if (word == "int" || word == "int32") return Scalar::i32;
  if (word == "uint" || word == "uint32") return Scalar::u32;
  if (word == "float" || word == "float32") return Scalar::f32;
  if (word == "double" || word == "float64") return Scalar::f64;
  return std::nullopt;
}

std::size_t SizeOf(Scalar type) {
  switch (type) {
    case Scalar::i8:
    case Scalar::u8:
      return 1;
    case Scalar::i16:
    case Scalar::u16:
      return 2;
    case Scalar::i32:
    case Scalar::u32:
    case Scalar::f32:
      return 4;
    case Scalar::f64:
      return 8;
  }
  return 8;
}

tl::unexpected<Error> MalformedPly(const std::string& what, const std::string& where) {
  return BadInput("malformed PLY: " + what, where, "write the mesh again as binary PLY or OBJ");
}

Result<Property> ParseProperty(std::string_view line, const std::string& where) {
  Property property;
  std::string_view word = TakeWord(line);
  if (word == "list") {
    property.count_type = ScalarNamed(TakeWord(line));
    if (!property.count_type) return MalformedPly("unknown type of a list's length", where);
    word = TakeWord(line);
  }
  const auto type = ScalarNamed(word);
  if (!type) return MalformedPly(fmt::format("unknown type \"{}\"", word.substr(0, 40)), where);
  property.type = *type;
  property.name = TakeWord(line);
  return property;
}

// Takes the header off the front of `text`.
Result<Header> TakeHeader(std::string_view& text, const std::string& file) {
  Header header;
  bool has_format = false;
  if (TakeLine(text) != "ply") return MalformedPly("it does not begin with \"ply\"", file);
  for (int line_number = 2; !text.empty(); ++line_number) {
    const std::string where = fmt::format("{}:{}", file, line_number);
    std::string_view line = TakeLine(text);
    const std::string_view key = TakeWord(line);
    if (key == "end_header") {
      if (!has_format) return MalformedPly("no format line", file);
      return header;
    }
    if (key == "comment" || key == "obj_info" || key.empty()) continue;
    if (key == "format") {
      const std::string_view name = TakeWord(line);
      if (name == "ascii")
        header.encoding = Encoding::ascii;
      else if (name == "binary_little_endian")
        header.encoding = Encoding::little;
      else if (name == "binary_big_endian")
        header.encoding = Encoding::big;
      else
        return MalformedPly(fmt::format("unknown format \"{}\"", name.substr(0, 40)), where);
      has_format = true;
    } else if (key == "element") {
      Element element;
      element.name = TakeWord(line);
      const auto count = ParseNumber<std::uint64_t>(TakeWord(line));
      if (!count) return MalformedPly("an element without a count", where);
      element.count = *count;
      header.elements.push_back(std::move(element));
    } else if (key == "property") {
      if (header.elements.empty()) return MalformedPly("a property before any element", where);
      SCAN_TRY(Property property, ParseProperty(line, where));
      header.elements.back().properties.push_back(std::move(property));
    } else {
      return MalformedPly(fmt::format("unknown header line \"{}\"", key.substr(0, 40)), where);
    }
  }
  return MalformedPly("the header has no end", file);
}

// The values of the body one after the other, whatever their encoding.
class Body {
 public:
  Body(std::string_view data, Encoding encoding) : data_(data), encoding_(encoding) {}

  std::size_t left() const { return data_.size(); }

  // Least number of bytes that a value can take.
  std::size_t SmallestSize(Scalar type) const {
    return encoding_ == Encoding::ascii ? 1 : SizeOf(type);
  }

  std::optional<double> Take(Scalar type) {
    if (encoding_ == Encoding::ascii) return ParseNumber<double>(TakeWord(data_));
    const std::size_t size = SizeOf(type);
    if (data_.size() < size) return std::nullopt;
    unsigned char raw[8] = {};
    std::memcpy(raw, data_.data(), size);
    data_.remove_prefix(size);
    if ((encoding_ == Encoding::big) != (std::endian::native == std::endian::big))
      std::reverse(raw, raw + size);
    switch (type) {
      case Scalar::i8:
        return As<std::int8_t>(raw);
      case Scalar::u8:
        return As<std::uint8_t>(raw);
      case Scalar::i16:
        return As<std::int16_t>(raw);
      case Scalar::u16:
        return As<std::uint16_t>(raw);
      case Scalar::i32:
        return As<std::int32_t>(raw);
      case Scalar::u32:
        return As<std::uint32_t>(raw);
      case Scalar::f32:
        return As<float>(raw);
      case Scalar::f64:
        return As<double>(raw);
    }
    return std::nullopt;
  }

 private:
  template <class T>
  static double As(const unsigned char* raw) {
    T value;
    std::memcpy(&value, raw, sizeof value);
    return static_cast<double>(value);
  }

  std::string_view data_;
  Encoding encoding_;
};

// Where the values that matter go; everything else is read over.
class MeshBuilder {
 public:
  MeshBuilder(const std::string& file, const Header& header) : file_(file) {
    for (const Element& element : header.elements)
      if (element.name == "vertex") vertex_count_ = element.count;
  }

  Status Scalar(const Element& element, std::uint64_t row, const Property& property, double value) {
    if (element.name != "vertex") return {};
    if (mesh_.vertices.size() <= row) mesh_.vertices.emplace_back(Eigen::Vector3d::Zero());
    for (int axis = 0; axis < 3; ++axis)
      if (property.name == kAxes[axis]) mesh_.vertices.back()[axis] = value;
    return {};
  }

  Status List(const Element& element, std::uint64_t row, const Property& property,
              const std::vector<double>& values) {
    if (element.name != "face") return {};
    if (property.name != "vertex_indices" && property.name != "vertex_index") return {};
    const std::string where = fmt::format("{}: face {}", file_, row);
    if (values.size() < 3) return MalformedPly("a face with fewer than three corners", where);
    for (const double value : values) {
      if (!(value >= 0 && value < static_cast<double>(vertex_count_)) || value != std::floor(value))
        return MalformedPly(fmt::format("vertex index {} of {} vertices", value, vertex_count_),
                            where);
    }
    const auto corner = [&](std::size_t k) { return static_cast<std::uint32_t>(values[k]); };
    for (std::size_t k = 2; k < values.size(); ++k)
      mesh_.faces.push_back({corner(0), corner(k - 1), corner(k)});
    return {};
  }

  TriangleMesh Release() { return std::move(mesh_); }

 private:
  static constexpr std::string_view kAxes[] = {"x", "y", "z"};
  const std::string& file_;
  std::uint64_t vertex_count_ = 0;
  TriangleMesh mesh_;
};

Status ReadElement(const Element& element, Body& body, MeshBuilder& builder,
                   const std::string& file) {
  std::vector<double> list;
  for (std::uint64_t row = 0; row < element.count; ++row) {
    const auto truncated = [&] {
      return BadInput("PLY is truncated or its numbers cannot be read",
                      fmt::format("{}: {} {} of {}", file, element.name, row, element.count),
                      "copy the file again or write the mesh again");
    };
    for (const Property& property : element.properties) {
      if (!property.count_type) {
        const auto value = body.Take(property.type);
        if (!value) return truncated();
        SCAN_CHECK(builder.Scalar(element, row, property, *value));
        continue;
      }
      const auto count = body.Take(*property.count_type);
      if (!count || !(*count >= 0) || *count != std::floor(*count) ||
          *count * static_cast<double>(body.SmallestSize(property.type)) >
              static_cast<double>(body.left()))
        return truncated();
      list.resize(static_cast<std::size_t>(*count));
      for (double& value : list) {
        const auto read = body.Take(property.type);
        if (!read) return truncated();
        value = *read;
      }
      SCAN_CHECK(builder.List(element, row, property, list));
    }
  }
  return {};
}

Status CheckHeader(const Header& header, const std::string& file) {
  int vertex_elements = 0, face_elements = 0;
  for (const Element& element : header.elements) {
    if (element.name == "face") ++face_elements;
    if (element.name != "vertex") continue;
    ++vertex_elements;
    if (element.count >= 0xffffffffu) return MalformedPly("too many vertices", file);
    for (const std::string_view axis : {"x", "y", "z"}) {
      int found = 0;
      for (const Property& property : element.properties)
        if (property.name == axis && !property.count_type) ++found;
      if (found != 1) return MalformedPly(fmt::format("vertices need one property {}", axis), file);
    }
  }
  if (vertex_elements != 1) return MalformedPly("it needs one element \"vertex\"", file);
  if (face_elements > 1) return MalformedPly("it has several elements \"face\"", file);
  return {};
}

// Counts that the file cannot hold are refused before anything is set aside for them.
Status CheckCount(const Element& element, const Body& body, const std::string& file) {
  double smallest_row = 0;
  for (const Property& property : element.properties)
    smallest_row +=
        static_cast<double>(body.SmallestSize(property.count_type.value_or(property.type)));
  if (static_cast<double>(element.count) * smallest_row > static_cast<double>(body.left()) + 1)
    return BadInput("PLY is truncated",
                    fmt::format("{}: it announces {} of element \"{}\" and holds {} more bytes",
                                file, element.count, element.name, body.left()),
                    "copy the file again or write the mesh again");
  return {};
}

template <class T>
void Append(std::vector<std::byte>& bytes, T value) {
  static_assert(std::endian::native == std::endian::little);
  const auto* raw = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), raw, raw + sizeof value);
}

}  // namespace

Result<TriangleMesh> ParsePly(std::span<const std::byte> bytes, const std::string& where) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  SCAN_TRY(const Header header, TakeHeader(text, where));
  SCAN_CHECK(CheckHeader(header, where));
  Body body(text, header.encoding);
  MeshBuilder builder(where, header);
  for (const Element& element : header.elements) {
    if (element.properties.empty()) continue;
    SCAN_CHECK(CheckCount(element, body, where));
    SCAN_CHECK(ReadElement(element, body, builder, where));
  }
  TriangleMesh mesh = builder.Release();
  SCAN_CHECK(CheckMesh(mesh, where));
  return mesh;
}

std::vector<std::byte> FormatPly(const TriangleMesh& mesh) {
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment units mm\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\nelement face {}\n"
      "property list uchar int vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.faces.size());
  std::vector<std::byte> bytes;
  bytes.reserve(header.size() + 12 * mesh.vertices.size() + 13 * mesh.faces.size());
  for (const char c : header) bytes.push_back(static_cast<std::byte>(c));
  for (const Eigen::Vector3d& v : mesh.vertices)
    for (int axis = 0; axis < 3; ++axis) Append(bytes, static_cast<float>(v[axis]));
  for (const Face& face : mesh.faces) {
    bytes.push_back(std::byte{3});
    for (const std::uint32_t v : face) Append(bytes, static_cast<std::int32_t>(v));
  }
  return bytes;
}

}  // namespace scan
