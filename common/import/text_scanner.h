// Numbers and words from the text formats: fast, locale-free and unable to read past the end.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/import/input_file.h"

namespace fanstream {

class TextScanner {
 public:
  // `text` is part of the file's bytes. Where comment is not 0, it hides the rest of its line.
  TextScanner(const InputFile& file, std::string_view text, char comment = 0);

  bool at_end() const { return at_ == end_; }
  void skip_blanks();  // to the next word of this line, or to its end
  void skip_space();   // to the next word of any line
  void skip_line();    // behind the next line end
  // Whether this line holds another word; moves to it.
  bool has_word_in_line();

  std::string_view word();  // the word that begins here; empty at the end of a line

  enum class Number { ok, missing, malformed, too_large };
  // The number that begins here; the scanner moves only when it is ok. Decimals too small for a double become 0, and
  // "nan" and "inf" are numbers: whether they are welcome is for the caller to say.
  Number number(double& value);
  Number number(std::int64_t& value);

  // Remembers a place that an error may name later.
  const char* place() const { return at_; }
  void move_to(const char* place) { at_ = place; }
  std::size_t remaining_bytes() const { return static_cast<std::size_t>(end_ - at_); }

  // "cow.off: line 12: what", at the present place or at one remembered. Counts lines only then.
  tl::unexpected<Error> fail_here(std::string_view what) const { return fail_at(at_, what); }
  tl::unexpected<Error> fail_at(const char* place, std::string_view what) const;
  // Says what is wrong with a number that was not ok: "a coordinate is missing", or malformed: "'1.2x'", or too large.
  tl::unexpected<Error> fail_number(Number fault, std::string_view what) const;
  std::uint64_t line_at(const char* place) const;

 private:
  template <class Value>
  Number parse(Value& value);

  const InputFile& file_;
  const char* at_;
  const char* end_;
  char comment_;
};

// The word for an error message: short, printable, in quotes.
std::string quote(std::string_view word);

}  // namespace fanstream
