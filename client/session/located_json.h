// JSON documents whose values know the line they stand on, so that an error can name it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/support/result.h"

namespace fanstream {

struct JsonValue {
  enum class Kind { null, boolean, number, string, array, object };
  Kind kind = Kind::null;
  bool boolean = false;
  double number = 0.0;
  std::string text{};               // of a string
  std::vector<JsonValue> items{};   // of an array; the values of an object, in the order of its keys
  std::vector<std::string> keys{};  // of an object, in the order of the file, no two alike
  std::vector<std::size_t> key_lines{};
  std::size_t line = 1;  // counted from 1

  const JsonValue* find(std::string_view key) const;  // null where an object has no such key
};

struct JsonLimits {
  std::size_t depth = 16;
  std::size_t values = 1'000'000;
};

// Safe on untrusted text: nothing is recursive, and memory is bounded by the limits (about 150 bytes a value) and the
// text. Errors start with "<name>: line <n>: ": bad_input for what is not JSON and for a key that an object has twice,
// limit.
Result<JsonValue> read_located_json(std::string_view text, const std::string& name, const JsonLimits& limits = {});

// A key or a text of a file as messages show it: quoted, in ASCII, cut where it is long.
std::string quoted_text(std::string_view text);

}  // namespace fanstream
