// What every report of fanstream-bench is made of: sections of one table each, printed in one of three ways, and the
// table of figures against their limits.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/bench/table.h"

namespace fanstream::bench {

struct Section {
  std::string key;    // in JSON
  std::string title;  // for people, with what the figures mean
  Table table;
};

enum class ReportFormat { text, markdown, json };
// `context`: machine and command, one line each.
std::string print_sections(const std::vector<Section>& sections, const std::vector<std::string>& context,
                           ReportFormat format);

template <class Integer>
Cell whole(Integer value) {
  return static_cast<std::int64_t>(value);
}
inline Cell percent(double share) { return 100.0 * share; }

// Rows of figure, of what, measured, limit, and whether it holds (pass, FAIL).
class Limits {
 public:
  void at_most(const std::string& figure, const std::string& of, double value, double limit);
  void at_least(const std::string& figure, const std::string& of, double value, double limit);
  // Without a limit.
  void measured(const std::string& figure, const std::string& of, double value);
  std::size_t row_count() const { return table_.row_count(); }
  Table take() { return std::move(table_); }

 private:
  void add(const std::string& figure, const std::string& of, double value, const std::string& limit, bool holds);
  Table table_{{{"figure", "", 0}, {"of", "", 0}, {"measured", "", 3}, {"limit", "", 0}, {"verdict", "", 0}}};
};

}  // namespace fanstream::bench
