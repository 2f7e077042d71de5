// A table for people (aligned text) and for programs (JSON).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace fanstream::bench {

// Nothing is printed as "-" and is null in JSON, as are numbers that are not finite.
using Cell = std::variant<std::monostate, std::string, std::int64_t, double>;

struct Column {
  std::string key;      // the name in JSON, for example "bits_per_vertex"
  std::string heading;  // what people see; the key if empty
  int decimals = 2;     // of doubles; negative: -decimals significant digits ("1.23e-04" where that is shorter)
};

class Table {
 public:
  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  // Exactly one cell per column.
  void add_row(std::vector<Cell> cells);
  std::size_t row_count() const { return rows_.size(); }

  // Text columns are left-aligned, numbers right-aligned. A table wider than `width` characters is continued below
  // itself with the first column repeated. Every line ends with a newline. A single column may be wider than `width`.
  std::string text(std::size_t width = 160) const;
  // A Markdown table, columns aligned as in text(), however wide.
  std::string markdown() const;
  // An array with one object per row, numbers in full precision.
  std::string json() const;

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<Cell>> rows_;
};

}  // namespace fanstream::bench
