#include "tests/bench/table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

namespace fanstream::bench {
namespace {

Table example() {
  Table table({{"model", "model", 0}, {"vertices", "", 0}, {"rms", "RMS / diagonal", -3}, {"bits", "bits/v", 1}});
  table.add_row({std::string("bunny"), std::int64_t{34834}, 2.5e-5, 12.06});
  table.add_row({std::string("v\xC3\xA4se"), std::int64_t{12}, 0.0123456, std::monostate{}});
  return table;
}

TEST(Table, ColumnsAreAlignedTextLeftAndNumbersRight) {
  EXPECT_EQ(example().text(80),
            "model  vertices  RMS / diagonal  bits/v\n"
            "-----  --------  --------------  ------\n"
            "bunny     34834        2.50e-05    12.1\n"
            "v\xC3\xA4se         12          0.0123       -\n");
}

TEST(Table, ATableThatIsTooWideContinuesBelowWithItsFirstColumn) {
  const std::string text = example().text(34);
  EXPECT_EQ(text,
            "model  vertices  RMS / diagonal\n"
            "-----  --------  --------------\n"
            "bunny     34834        2.50e-05\n"
            "v\xC3\xA4se         12          0.0123\n"
            "\n"
            "model  bits/v\n"
            "-----  ------\n"
            "bunny    12.1\n"
            "v\xC3\xA4se        -\n");
}

TEST(Table, JsonHasOneObjectPerRowWithNumbersInFull) {
  EXPECT_EQ(
      example().json(),
      "[\n  {\n    \"model\": \"bunny\",\n    \"vertices\": 34834,\n    \"rms\": 2.5e-05,\n    \"bits\": 12.06\n  },\n"
      "  {\n    \"model\": \"v\xC3\xA4se\",\n    \"vertices\": 12,\n    \"rms\": 0.0123456,\n    \"bits\": null\n  "
      "}\n]");
}

TEST(Table, MarkdownKeepsTheColumnsApartAndAligned) {
  EXPECT_EQ(example().markdown(),
            "| model | vertices | RMS / diagonal | bits/v |\n"
            "| --- | ---: | ---: | ---: |\n"
            "| bunny | 34834 | 2.50e-05 | 12.1 |\n"
            "| v\xC3\xA4se | 12 | 0.0123 | - |\n");
  Table table({{"a|b", "", 0}});
  table.add_row({std::string("c|d")});
  EXPECT_EQ(table.markdown(), "| a\\|b |\n| --- |\n| c\\|d |\n");
}

TEST(Table, WhatIsNoNumberIsADashAndNull) {
  Table table({{"a", "", 2}, {"b", "", 2}});
  table.add_row({std::nan(""), HUGE_VAL});
  EXPECT_EQ(table.text(), "a  b\n-  -\n-  -\n");
  EXPECT_EQ(table.json(), "[\n  {\n    \"a\": null,\n    \"b\": null\n  }\n]");
}

TEST(Table, NamesThatAreNotUtf8AndEmptyTablesAreNoProblem) {
  Table table({{"file", "", 0}});
  table.add_row({std::string("bad\xFFname")});
  EXPECT_NE(table.json().find("bad"), std::string::npos);
  EXPECT_EQ(Table({{"only", "", 0}}).text(), "only\n----\n");
  EXPECT_EQ(Table({{"only", "", 0}}).json(), "[]");
  EXPECT_EQ(Table({}).text(), "");
}

}  // namespace
}  // namespace fanstream::bench
