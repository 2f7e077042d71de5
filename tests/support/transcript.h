// The sessions in tests/golden/protocol/*.txt. A line is "C> hex" (client to server), "S> hex" (server to client), or
// "# comment"; each holds one frame.
#pragma once

#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace fanstream::testing {

struct Line {
  char side = 'C';
  std::vector<std::byte> bytes;
  friend bool operator==(const Line&, const Line&) = default;
};

// Throws where there is no such file.
inline std::vector<Line> read_transcript(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::vector<Line> lines;
  for (std::string text; std::getline(file, text);) {
    if (text.size() < 3 || text[0] == '#') continue;
    Line line{text[0], {}};
    for (std::size_t i = 3; i + 1 < text.size(); i += 2) {
      line.bytes.push_back(static_cast<std::byte>(std::stoi(text.substr(i, 2), nullptr, 16)));
    }
    lines.push_back(line);
  }
  return lines;
}

}  // namespace fanstream::testing
