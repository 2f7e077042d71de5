#include "client/session/located_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

namespace fanstream {
namespace {

// Finds where tokens start: one token for each event of the parser, which has read the text up to there and found it
// well-formed.
class TokenLines {
 public:
  explicit TokenLines(std::string_view text) : text_(text) {
    if (text_.substr(0, 3) == "\xEF\xBB\xBF") position_ = 3;
  }

  // The line on which the next token starts; goes on behind it.
  std::size_t next() {
    for (; position_ < text_.size() && is_between(text_[position_]); ++position_) line_ += text_[position_] == '\n';
    if (position_ >= text_.size()) return line_;
    const char first = text_[position_++];
    if (first == '"') {
      for (; position_ < text_.size() && text_[position_] != '"'; ++position_) position_ += text_[position_] == '\\';
      ++position_;
    } else if (std::string_view("{}[]").find(first) == std::string_view::npos) {
      while (position_ < text_.size() && !is_between(text_[position_]) &&
             std::string_view("{}[]").find(text_[position_]) == std::string_view::npos) {
        ++position_;
      }
    }
    return line_;
  }

 private:
  static bool is_between(char c) { return std::string_view(" \t\r\n:,").find(c) != std::string_view::npos; }

  std::string_view text_;
  std::size_t position_ = 0;
  std::size_t line_ = 1;
};

class TreeBuilder final : public nlohmann::json_sax<nlohmann::json> {
 public:
  TreeBuilder(std::string_view text, const std::string& name, const JsonLimits& limits)
      : text_(text), name_(name), limits_(limits), lines_(text) {}

  bool null() override { return add(JsonValue::Kind::null) != nullptr; }
  bool boolean(bool value) override {
    JsonValue* added = add(JsonValue::Kind::boolean);
    if (added != nullptr) added->boolean = value;
    return added != nullptr;
  }
  bool number_integer(number_integer_t value) override { return add_number(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return add_number(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) override { return add_number(value); }
  bool string(string_t& value) override {
    JsonValue* added = add(JsonValue::Kind::string);
    if (added != nullptr) added->text = std::move(value);
    return added != nullptr;
  }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(JsonValue::Kind::object); }
  bool start_array(std::size_t) override { return open(JsonValue::Kind::array); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& value) override {
    const std::size_t line = lines_.next();
    JsonValue& object = *open_.back();
    // Objects of many keys would make this quadratic; those that the limit on values lets through are known to be
    // small.
    if (object.keys.size() >= kMostKeys) return stop(ErrorKind::limit, line, "an object has too many keys");
    if (object.find(value) != nullptr) {
      return stop(ErrorKind::bad_input, line, fmt::format("key {} is given twice", quoted_text(value)));
    }
    object.keys.push_back(std::move(value));
    object.key_lines.push_back(line);
    return true;
  }

  bool parse_error(std::size_t position, const std::string&, const nlohmann::json::exception& error) override {
    const std::string_view before = text_.substr(0, std::min(position > 0 ? position - 1 : 0, text_.size()));
    const auto line = static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n')) + 1;
    // "[json.exception.parse_error.101] parse error at line 3, column 5: what is wrong"
    std::string_view what = error.what();
    for (const std::string_view prefix : {"] ", "column "}) {
      if (const std::size_t at = what.find(prefix); at != std::string_view::npos)
        what.remove_prefix(at + prefix.size());
    }
    if (const std::size_t colon = what.find(": "); colon < 8) what.remove_prefix(colon + 2);
    return stop(ErrorKind::bad_input, line, fmt::format("not JSON: {}", what.substr(0, 200)));
  }

  const std::optional<Error>& error() const { return error_; }
  JsonValue take() { return std::move(root_); }

 private:
  static constexpr std::size_t kMostKeys = 256;

  JsonValue* add(JsonValue::Kind kind) {
    const std::size_t line = lines_.next();
    if (++values_ > limits_.values) {
      stop(ErrorKind::limit, line, fmt::format("more than {} values", limits_.values));
      return nullptr;
    }
    JsonValue* value = &root_;
    if (!open_.empty()) value = &open_.back()->items.emplace_back();
    value->kind = kind;
    value->line = line;
    return value;
  }
  bool add_number(double number) {
    JsonValue* added = add(JsonValue::Kind::number);
    if (added != nullptr) added->number = number;
    return added != nullptr;
  }
  bool open(JsonValue::Kind kind) {
    JsonValue* added = add(kind);
    if (added == nullptr) return false;
    if (open_.size() >= limits_.depth) {
      return stop(ErrorKind::limit, added->line, fmt::format("nested deeper than {} levels", limits_.depth));
    }
    open_.push_back(added);  // stays where it is: what holds it gets no further items before it is closed
    return true;
  }
  bool close() {
    lines_.next();
    open_.pop_back();
    return true;
  }
  bool stop(ErrorKind kind, std::size_t line, const std::string& what) {
    if (!error_) error_ = Error{kind, fmt::format("{}: line {}: {}", name_, line, what)};
    return false;
  }

  std::string_view text_;
  const std::string& name_;
  JsonLimits limits_;
  TokenLines lines_;
  JsonValue root_;
  std::vector<JsonValue*> open_;
  std::size_t values_ = 0;
  std::optional<Error> error_;
};

}  // namespace

const JsonValue* JsonValue::find(std::string_view key) const {
  const auto found = std::find(keys.begin(), keys.end(), key);
  const auto at = static_cast<std::size_t>(found - keys.begin());
  return at < items.size() ? &items[at] : nullptr;
}

Result<JsonValue> read_located_json(std::string_view text, const std::string& name, const JsonLimits& limits) {
  TreeBuilder builder(text, name, limits);
  const bool read = nlohmann::json::sax_parse(text.begin(), text.end(), &builder);
  if (builder.error()) return tl::unexpected(*builder.error());
  if (!read) return fail(ErrorKind::bad_input, name + ": not JSON");
  return builder.take();
}

std::string quoted_text(std::string_view text) {
  constexpr std::size_t kMostShown = 40;
  const std::string shown(text.substr(0, kMostShown));
  return nlohmann::json(shown).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) +
         (text.size() > kMostShown ? "..." : "");
}

}  // namespace fanstream
