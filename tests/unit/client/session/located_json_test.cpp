#include "client/session/located_json.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/seeded_random.h"

namespace fanstream {
namespace {

using testing::SeededRandom;

JsonValue read(const std::string& text) {
  Result<JsonValue> value = read_located_json(text, "f");
  EXPECT_TRUE(value) << value.error().message;
  return value ? std::move(*value) : JsonValue();
}

TEST(LocatedJson, KeepsKindsAndValues) {
  const JsonValue v = read(R"({"a": [1, -2.5e3, true, null, "x\n\"y"], "b": {}})");
  ASSERT_EQ(v.keys, (std::vector<std::string>{"a", "b"}));
  const JsonValue* a = v.find("a");
  ASSERT_EQ(a->items.size(), 5U);
  EXPECT_EQ(a->items[0].number, 1.0);
  EXPECT_EQ(a->items[1].number, -2500.0);
  EXPECT_TRUE(a->items[2].boolean);
  EXPECT_EQ(a->items[3].kind, JsonValue::Kind::null);
  EXPECT_EQ(a->items[4].text, "x\n\"y");
  EXPECT_EQ(v.find("b")->kind, JsonValue::Kind::object);
  EXPECT_EQ(v.find("c"), nullptr);
}

// A random document, written with its lines noted down on the way.
class RandomDocument {
 public:
  explicit RandomDocument(std::uint64_t seed) : random_(seed) { value(0); }
  const std::string& text() const { return text_; }

  // Whether a tree that was read has the lines of this document, values and keys in the order of the text.
  bool has_lines_of(const JsonValue& value) {
    at_ = 0;
    return compare(value) && at_ == lines_.size();
  }

 private:
  void gap() {
    for (std::uint32_t i = random_.below(3); i > 0; --i) {
      static constexpr const char* kSpaces[] = {" ", "\t", "\n", "\r\n"};
      text_ += kSpaces[random_.below(4)];
    }
  }
  void note() { lines_.push_back(static_cast<std::size_t>(std::count(text_.begin(), text_.end(), '\n')) + 1); }
  void key(std::uint32_t number) {
    static constexpr const char* kKeys[] = {"k", "{[", "\\\"", "\\\\", ":,", "]}\\n", "\\u00e9"};
    text_ += '"' + std::string(kKeys[random_.below(7)]) + std::to_string(number) + '"';
  }
  void value(int depth) {
    gap();
    note();
    const std::uint32_t kind = random_.below(depth < 5 ? 8 : 5);
    if (kind < 5) {
      static constexpr const char* kScalars[] = {"0", "-1.5E+2", "true", "null", "\"]\\\\\\\"{\\n:,\""};
      text_ += kScalars[kind];
    } else {
      const bool object = kind == 5;
      text_ += object ? '{' : '[';
      const std::uint32_t items = random_.below(5);
      for (std::uint32_t i = 0; i < items; ++i) {
        if (i > 0) text_ += ',';
        gap();
        if (object) {
          note();
          key(i);
          gap();
          text_ += ':';
        }
        value(depth + 1);
      }
      gap();
      text_ += object ? '}' : ']';
    }
    gap();
  }
  bool next_is(std::size_t line) { return at_ < lines_.size() && lines_[at_++] == line; }
  bool compare(const JsonValue& v) {
    if (!next_is(v.line)) return false;
    for (std::size_t i = 0; i < v.items.size(); ++i) {
      if (!v.keys.empty() && !next_is(v.key_lines[i])) return false;
      if (!compare(v.items[i])) return false;
    }
    return true;
  }

  SeededRandom random_;
  std::string text_;
  std::vector<std::size_t> lines_;
  std::size_t at_ = 0;
};

TEST(LocatedJson, EveryValueKnowsItsLine) {
  std::size_t values = 0;
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    RandomDocument document(seed);
    const Result<JsonValue> value = read_located_json(document.text(), "f");
    ASSERT_TRUE(value) << "seed " << seed << ": " << value.error().message;
    ASSERT_TRUE(document.has_lines_of(*value)) << "seed " << seed << ":\n" << document.text();
    values += value->items.size();
  }
  EXPECT_GT(values, 1000U);
}

TEST(LocatedJson, LimitsAreErrorsThatNameTheLine) {
  const auto message = [](const std::string& text, const JsonLimits& limits) {
    const Result<JsonValue> value = read_located_json(text, "f", limits);
    return value ? std::string("accepted") : value.error().message;
  };
  EXPECT_EQ(message("[[[\n1]]]", {3, 10}), "accepted");
  EXPECT_EQ(message("[[\n[1]]]", {2, 10}), "f: line 2: nested deeper than 2 levels");
  EXPECT_EQ(message("[1,\n2,\n3]", {3, 3}), "f: line 3: more than 3 values");
  EXPECT_EQ(message("{\"a\":1,\n\"a\":2}", {3, 10}), "f: line 2: key \"a\" is given twice");
}

TEST(LocatedJson, MessagesCarryNoControlCharacters) {
  for (const std::string& text :
       {std::string("{\"\x1b[2J\": }"), std::string("\0[", 2), std::string("[\"\xFF\xFE\"]")}) {
    const Result<JsonValue> value = read_located_json(text, "f");
    ASSERT_FALSE(value);
    for (const char c : value.error().message) EXPECT_GE(static_cast<unsigned char>(c), ' ');
  }
  EXPECT_EQ(quoted_text("a\x1b\n\xC3\xA9"), "\"a\\u001b\\n\\u00e9\"");
  EXPECT_EQ(quoted_text(std::string(100, 'x')), "\"" + std::string(40, 'x') + "\"...");
}

}  // namespace
}  // namespace fanstream
