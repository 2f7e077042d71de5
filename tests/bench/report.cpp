#include "tests/bench/report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace fanstream::bench {

std::string print_sections(const std::vector<Section>& sections, const std::vector<std::string>& context,
                           ReportFormat format) {
  if (format == ReportFormat::json) {
    nlohmann::ordered_json json{{"context", context}};
    for (const Section& s : sections) json[s.key] = nlohmann::ordered_json::parse(s.table.json());
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
  }
  const bool markdown = format == ReportFormat::markdown;
  std::string out;
  for (const std::string& line : context) out += markdown ? "- " + line + '\n' : line + '\n';
  for (const Section& s : sections) {
    out += markdown ? "\n### " + s.title + "\n\n" + s.table.markdown() : '\n' + s.title + "\n\n" + s.table.text();
  }
  return out;
}

void Limits::at_most(const std::string& figure, const std::string& of, double value, double limit) {
  add(figure, of, value, fmt::format("<= {}", limit), value <= limit);
}

void Limits::at_least(const std::string& figure, const std::string& of, double value, double limit) {
  add(figure, of, value, fmt::format(">= {}", limit), value >= limit);
}

void Limits::measured(const std::string& figure, const std::string& of, double value) {
  table_.add_row({figure, of, value, std::monostate{}, std::monostate{}});
}

void Limits::add(const std::string& figure, const std::string& of, double value, const std::string& limit, bool holds) {
  table_.add_row({figure, of, value, limit, std::string(holds ? "pass" : "FAIL")});
}

}  // namespace fanstream::bench
