// Numbers of a command line that belong together: "x,y,z", "WxH", "4000,2000".
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <vector>

namespace fanstream {

// At least one number, with a separator between them and nothing else; nothing where the text is not that.
template <class Number>
std::optional<std::vector<Number>> parse_numbers(std::string_view text, char separator) {
  std::vector<Number> list;
  for (;;) {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc()) return std::nullopt;
    list.push_back(value);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (text.empty()) return list;
    if (text.front() != separator) return std::nullopt;
    text.remove_prefix(1);
  }
}

}  // namespace fanstream
