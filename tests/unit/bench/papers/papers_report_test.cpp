#include "tests/bench/papers/papers_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

namespace fanstream::bench {
namespace {

Section one_number(const std::string& key, std::int64_t number) {
  Table table({{"number", "", 0}});
  table.add_row({number});
  return {key, "a number", std::move(table)};
}

Result<std::vector<Section>> good(const PapersOptions& options) {
  options.progress("counting");
  std::vector<Section> sections;
  sections.push_back(one_number("levels", 1));
  sections.push_back(one_number("good_limits", 2));
  return sections;
}
Result<std::vector<Section>> bad(const PapersOptions&) { return fail(ErrorKind::limit, "cow.off: too many"); }

constexpr PapersPart kBad{"bad", "a document", bad};
constexpr PapersPart kGood{"good", "another", good};

struct TempFolder {
  std::filesystem::path path =
      std::filesystem::path(::testing::TempDir()) /
      ("papers_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
  TempFolder() {
    std::filesystem::remove_all(path);
    std::filesystem::create_directories(path);
  }
  ~TempFolder() { std::filesystem::remove_all(path); }
};

TEST(MeasurePapers, GoesOnAfterAPartThatFailsAndSaysWhich) {
  const TempFolder folder;
  std::vector<std::string> told;
  const PapersPart parts[] = {kBad, kGood};
  const auto figures = measure_papers(
      parts, {folder.path, folder.path / "new" / "pictures", true, [&](auto stage) { told.emplace_back(stage); }});
  ASSERT_TRUE(figures) << figures.error().message;
  EXPECT_TRUE(std::filesystem::is_directory(folder.path / "new" / "pictures"));
  ASSERT_EQ(figures->failures.size(), 1U);
  EXPECT_EQ(figures->failures[0].kind, ErrorKind::limit);
  EXPECT_EQ(figures->failures[0].message, "bad: cow.off: too many");
  ASSERT_EQ(figures->sections.size(), 2U);
  EXPECT_EQ(figures->sections[0].key, "good_levels") << "keys of different parts do not meet";
  EXPECT_EQ(figures->sections[1].key, "good_limits");
  EXPECT_EQ(figures->sections[0].title, "good: a number");
  EXPECT_NE(std::find(told.begin(), told.end(), "[2/2] good: counting"), told.end());
}

TEST(MeasurePapers, RefusesFoldersThatAreNone) {
  const TempFolder folder;
  const std::filesystem::path file = folder.path / "file";
  std::ofstream(file) << "x";
  const PapersPart parts[] = {kGood};
  const auto missing = measure_papers(parts, {folder.path / "none", folder.path, true, {}});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::not_found);
  EXPECT_NE(missing.error().message.find("--models"), std::string::npos);
  const auto taken = measure_papers(parts, {folder.path, file, true, {}});
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().kind, ErrorKind::io);
  EXPECT_NE(taken.error().message.find(file.string()), std::string::npos);
}

TEST(PapersMesh, IsCleanedAndItsErrorsNameIt) {
  const TempFolder folder;
  const PapersOptions options{folder.path, folder.path, true, {}};
  std::ofstream(folder.path / "a.off") << "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 1 0\n3 0 1 2\n3 0 1 3\n";
  const auto mesh = papers_mesh(options, "a.off");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 1U) << "the second is the first again";
  std::ofstream(folder.path / "b.off") << "not a mesh";
  const auto broken = papers_mesh(options, "b.off");
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().kind, ErrorKind::bad_input);
  EXPECT_NE(broken.error().message.find("b.off"), std::string::npos);
  const auto missing = papers_mesh(options, "c.off");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::not_found);
}

TEST(PapersParts, HaveNamesOfTheirOwn) {
  std::set<std::string_view> names;
  for (const PapersPart& part : papers_parts()) {
    EXPECT_TRUE(names.insert(part.name).second) << part.name;
    EXPECT_NE(part.measure, nullptr);
  }
}

}  // namespace
}  // namespace fanstream::bench
