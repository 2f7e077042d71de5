#include "common/import/ply_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "common/import/text_scanner.h"

namespace fanstream {
namespace {

// Far more than any real file has; keeps a hostile header from taking memory.
constexpr std::size_t kMaxElements = 64;
constexpr std::size_t kMaxProperties = 1024;

std::optional<PlyType> type_of(std::string_view word) {
  constexpr std::pair<std::string_view, PlyType> kNames[] = {
      {"char", PlyType::int8},      {"uchar", PlyType::uint8},    {"short", PlyType::int16},
      {"ushort", PlyType::uint16},  {"int", PlyType::int32},      {"uint", PlyType::uint32},
      {"float", PlyType::float32},  {"double", PlyType::float64}, {"int8", PlyType::int8},
      {"uint8", PlyType::uint8},    {"int16", PlyType::int16},    {"uint16", PlyType::uint16},
      {"int32", PlyType::int32},    {"uint32", PlyType::uint32},  {"float32", PlyType::float32},
      {"float64", PlyType::float64}};
  for (const auto& [type_name, type] : kNames) {
    if (word == type_name) return type;
  }
  return std::nullopt;
}

class HeaderReader {
 public:
  explicit HeaderReader(const InputFile& file) : scanner_(file, file.bytes()), begin_(file.bytes().data()) {}

  Result<PlyHeader> run() {
    if (next_word() != "ply") return scanner_.fail_here("not a PLY file: the first line must be 'ply'");
    scanner_.skip_line();
    bool has_format = false;
    while (!scanner_.at_end()) {
      const char* line = scanner_.place();
      const std::string_view keyword = next_word();
      Result<void> done;
      if (keyword == "end_header") {
        if (!has_format) return scanner_.fail_at(line, "the header has no format line");
        return finish(line);
      }
      if (keyword == "format") {
        has_format = true;
        done = read_format();
      } else if (keyword == "element") {
        done = read_element();
      } else if (keyword == "property") {
        done = read_property();
      } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
        return scanner_.fail_at(line, "unknown header keyword " + quote(keyword));
      }
      if (!done) return tl::unexpected(done.error());
      scanner_.skip_line();
    }
    return scanner_.fail_here("the header has no end_header line: the file may be truncated");
  }

 private:
  std::string_view next_word() {
    scanner_.skip_blanks();
    return scanner_.word();
  }

  Result<PlyHeader> finish(const char* line) {
    if (scanner_.has_word_in_line()) return scanner_.fail_at(line, "unexpected text behind end_header");
    scanner_.skip_line();
    header_.size_bytes = static_cast<std::size_t>(scanner_.place() - begin_);
    return std::move(header_);
  }

  Result<void> read_format() {
    const std::string_view encoding = next_word();
    if (encoding == "ascii") {
      header_.encoding = PlyHeader::Encoding::text;
    } else if (encoding == "binary_little_endian") {
      header_.encoding = PlyHeader::Encoding::little_endian;
    } else if (encoding == "binary_big_endian") {
      header_.encoding = PlyHeader::Encoding::big_endian;
    } else {
      return scanner_.fail_here("unknown format " + quote(encoding) +
                                ": ascii, binary_little_endian or binary_big_endian expected");
    }
    const std::string_view version = next_word();
    if (version != "1.0") return scanner_.fail_here("unknown PLY version " + quote(version) + ": 1.0 expected");
    return {};
  }

  Result<void> read_element() {
    if (header_.elements.size() == kMaxElements) return scanner_.fail_here("more than 64 elements in the header");
    PlyElement element;
    element.name = next_word();
    std::int64_t count = 0;
    scanner_.skip_blanks();
    const TextScanner::Number fault = scanner_.number(count);
    if (fault != TextScanner::Number::ok) return scanner_.fail_number(fault, "the number of elements");
    if (count < 0) return scanner_.fail_here("the number of elements is negative");
    const bool repeats = std::any_of(header_.elements.begin(), header_.elements.end(),
                                     [&](const PlyElement& e) { return e.name == element.name; });
    if (repeats) return scanner_.fail_here("element " + quote(element.name) + " occurs twice");
    element.count = static_cast<std::uint64_t>(count);
    header_.elements.push_back(std::move(element));
    return {};
  }

  Result<void> read_property() {
    if (header_.elements.empty()) return scanner_.fail_here("a property comes before the first element");
    PlyElement& element = header_.elements.back();
    if (element.properties.size() == kMaxProperties)
      return scanner_.fail_here("more than 1024 properties in an element");
    PlyProperty property;
    std::string_view type_name = next_word();
    if (type_name == "list") {
      property.is_list = true;
      type_name = next_word();
      const std::optional<PlyType> count_type = type_of(type_name);
      if (!count_type || !is_integer(*count_type)) {
        return scanner_.fail_here("list counts must be of an integer type, not " + quote(type_name));
      }
      property.count_type = *count_type;
      type_name = next_word();
    }
    const std::optional<PlyType> type = type_of(type_name);
    if (!type) return scanner_.fail_here("unknown property type " + quote(type_name));
    property.type = *type;
    property.name = next_word();
    if (property.name.empty()) return scanner_.fail_here("the property has no name");
    element.properties.push_back(std::move(property));
    return {};
  }

  TextScanner scanner_;
  const char* begin_;
  PlyHeader header_;
};

}  // namespace

Result<PlyHeader> read_ply_header(const InputFile& file) { return HeaderReader(file).run(); }

}  // namespace fanstream
