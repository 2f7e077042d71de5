#include "common/import/text_scanner.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <type_traits>

namespace fanstream {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
bool is_space(char c) { return is_blank(c) || c == '\n'; }

}  // namespace

TextScanner::TextScanner(const InputFile& file, std::string_view text, char comment)
    : file_(file), at_(text.data()), end_(text.data() + text.size()), comment_(comment) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (at_ == file.bytes().data() && text.starts_with(kByteOrderMark)) at_ += kByteOrderMark.size();
}

void TextScanner::skip_blanks() {
  while (at_ != end_ && is_blank(*at_)) ++at_;
  if (comment_ == 0 || at_ == end_ || *at_ != comment_) return;
  const void* line_end = std::memchr(at_, '\n', remaining_bytes());
  at_ = line_end == nullptr ? end_ : static_cast<const char*>(line_end);
}

void TextScanner::skip_space() {
  for (skip_blanks(); at_ != end_ && *at_ == '\n'; skip_blanks()) ++at_;
}

void TextScanner::skip_line() {
  const void* line_end = at_ == end_ ? nullptr : std::memchr(at_, '\n', remaining_bytes());
  at_ = line_end == nullptr ? end_ : static_cast<const char*>(line_end) + 1;
}

bool TextScanner::has_word_in_line() {
  skip_blanks();
  return at_ != end_ && *at_ != '\n';
}

std::string_view TextScanner::word() {
  const char* begin = at_;
  while (at_ != end_ && !is_space(*at_)) ++at_;
  return {begin, static_cast<std::size_t>(at_ - begin)};
}

template <class Value>
TextScanner::Number TextScanner::parse(Value& value) {
  if (at_ == end_ || *at_ == '\n') return Number::missing;
  const char* begin = at_;
  if (*begin == '+' && begin + 1 != end_ && begin[1] != '-') ++begin;
  const auto [behind, fault] = std::from_chars(begin, end_, value);
  if (fault == std::errc::invalid_argument || (behind != end_ && !is_space(*behind))) return Number::malformed;
  if (fault == std::errc::result_out_of_range) {
    if constexpr (!std::is_floating_point_v<Value>) return Number::too_large;
    // from_chars says the same of 1e999 and 1e-999; strtod tells them apart.
    value = static_cast<Value>(std::strtod(std::string(begin, behind).c_str(), nullptr));
    if (value > 1 || value < -1) return Number::too_large;
  }
  at_ = behind;
  return Number::ok;
}

TextScanner::Number TextScanner::number(double& value) { return parse(value); }
TextScanner::Number TextScanner::number(std::int64_t& value) { return parse(value); }

std::uint64_t TextScanner::line_at(const char* place) const {
  return 1 + static_cast<std::uint64_t>(std::count(file_.bytes().data(), place, '\n'));
}

tl::unexpected<Error> TextScanner::fail_at(const char* place, std::string_view what) const {
  return fail(ErrorKind::bad_input, fmt::format("{}: line {}: {}", file_.name(), line_at(place), what));
}

tl::unexpected<Error> TextScanner::fail_number(Number fault, std::string_view what) const {
  TextScanner copy = *this;
  const std::string_view found = copy.word();
  if (fault == Number::missing) {
    return fail_here(fmt::format("{} is missing{}", what, at_end() ? ": the file ends here, it may be truncated" : ""));
  }
  if (fault == Number::too_large) return fail_here(fmt::format("{} {} is too large", what, quote(found)));
  return fail_here(fmt::format("{} is not a number: {}", what, quote(found)));
}

std::string quote(std::string_view word) {
  constexpr std::size_t kShown = 40;
  std::string text = "'";
  for (const char c : word.substr(0, kShown)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (word.size() > kShown ? "...'" : "'");
}

}  // namespace fanstream
