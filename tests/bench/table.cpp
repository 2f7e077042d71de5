#include "tests/bench/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <nlohmann/json.hpp>

namespace fanstream::bench {

namespace {

constexpr std::size_t kGap = 2;  // blanks between columns

std::string printed(const Cell& cell, int decimals) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  if (const auto* whole = std::get_if<std::int64_t>(&cell)) return std::to_string(*whole);
  const auto* number = std::get_if<double>(&cell);
  if (number == nullptr || !std::isfinite(*number)) return "-";
  return decimals >= 0 ? fmt::format("{:.{}f}", *number, decimals) : fmt::format("{:#.{}g}", *number, -decimals);
}

// Characters, not bytes, so that a model's name in UTF-8 does not shift its row.
std::size_t shown_width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

std::string padded(const std::string& text, std::size_t width, bool left) {
  const std::string blanks(width - std::min(width, shown_width(text)), ' ');
  return left ? text + blanks : blanks + text;
}

struct Layout {
  std::vector<std::string> cells;  // the heading first
  std::size_t width = 0;
  bool left = false;
};

void append_block(std::string& out, const std::vector<Layout>& columns, const std::vector<std::size_t>& chosen) {
  for (std::size_t line = 0; line < columns.front().cells.size(); ++line) {
    std::string text;
    std::string rule;
    for (const std::size_t i : chosen) {
      if (!text.empty()) text.append(kGap, ' ');
      if (!rule.empty()) rule.append(kGap, ' ');
      text += padded(columns[i].cells[line], columns[i].width, columns[i].left);
      rule.append(columns[i].width, '-');
    }
    text.erase(text.find_last_not_of(' ') + 1);
    out += text + '\n';
    if (line == 0) out += rule + '\n';
  }
}

}  // namespace

void Table::add_row(std::vector<Cell> cells) {
  assert(cells.size() == columns_.size());
  cells.resize(columns_.size());
  rows_.push_back(std::move(cells));
}

std::string Table::text(std::size_t width) const {
  if (columns_.empty()) return {};
  std::vector<Layout> layout;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    Layout column;
    column.cells.push_back(columns_[i].heading.empty() ? columns_[i].key : columns_[i].heading);
    for (const std::vector<Cell>& row : rows_) {
      column.left = column.left || std::holds_alternative<std::string>(row[i]);
      column.cells.push_back(printed(row[i], columns_[i].decimals));
    }
    for (const std::string& cell : column.cells) column.width = std::max(column.width, shown_width(cell));
    layout.push_back(std::move(column));
  }
  std::string out;
  std::vector<std::size_t> block{0};
  std::size_t block_width = layout[0].width;
  for (std::size_t i = 1; i < layout.size(); ++i) {
    if (block.size() > 1 && block_width + kGap + layout[i].width > width) {
      append_block(out, layout, block);
      out += '\n';
      block = {0};
      block_width = layout[0].width;
    }
    block.push_back(i);
    block_width += kGap + layout[i].width;
  }
  append_block(out, layout, block);
  return out;
}

std::string Table::markdown() const {
  const auto line = [&](auto&& cell_text) {
    std::string text = "|";
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      text += ' ';
      for (const char c : cell_text(i)) text += c == '|' ? std::string("\\|") : std::string(1, c);
      text += " |";
    }
    return text + '\n';
  };
  if (columns_.empty()) return {};
  std::string out =
      line([&](std::size_t i) { return columns_[i].heading.empty() ? columns_[i].key : columns_[i].heading; });
  out += line([&](std::size_t i) -> std::string {
    const bool text = std::any_of(rows_.begin(), rows_.end(),
                                  [&](const auto& row) { return std::holds_alternative<std::string>(row[i]); });
    return text ? "---" : "---:";
  });
  for (const std::vector<Cell>& row : rows_) {
    out += line([&](std::size_t i) { return printed(row[i], columns_[i].decimals); });
  }
  return out;
}

std::string Table::json() const {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const std::vector<Cell>& row : rows_) {
    nlohmann::ordered_json object = nlohmann::ordered_json::object();
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      nlohmann::ordered_json& value = object[columns_[i].key];
      if (const auto* text = std::get_if<std::string>(&row[i])) value = *text;
      if (const auto* whole = std::get_if<std::int64_t>(&row[i])) value = *whole;
      if (const auto* number = std::get_if<double>(&row[i]); number != nullptr && std::isfinite(*number))
        value = *number;
    }
    rows.push_back(std::move(object));
  }
  // A file name need not be UTF-8; what is not is shown as a replacement character instead of an exception.
  return rows.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace fanstream::bench
