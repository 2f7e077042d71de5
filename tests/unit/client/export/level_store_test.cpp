#include "client/export/level_store.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

std::vector<std::uint8_t> bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

class LevelStore : public ::testing::Test {
 protected:
  void SetUp() override {
    manifest.source = "bunny.ply";
    manifest.source_hash = "file 0123";
    manifest.settings = "glb";
    manifest.source_triangles = 70'000;
    manifest.source_vertices = 35'000;
    manifest.has_colors = true;
    for (const std::uint64_t count : {4000U, 200U}) {
      StoredLevel level;
      level.asked_triangles = count;
      level.triangles = count;
      level.relative_rms = 1.0 / 3.0;
      level.shortfall = count == 200 ? "topology" : "";
      level.file =
          store_file(folder.path(), std::to_string(count) + ".glb", bytes_of("level " + std::to_string(count))).value();
      manifest.levels.push_back(level);
    }
    manifest.picture = store_file(folder.path(), "levels.png", bytes_of("picture")).value();
    ASSERT_TRUE(store_manifest(folder.path(), manifest));
  }
  std::string obstacle(const LevelManifest& wanted, bool picture = true) const {
    const StoredLevels found = find_levels(folder.path(), wanted, picture);
    EXPECT_NE(found.manifest.has_value(), !found.obstacle.empty());
    return found.obstacle;
  }
  testing::TemporaryFolder folder;
  LevelManifest manifest;
};

TEST_F(LevelStore, WhatWasStoredIsFoundWithAllItSays) {
  const StoredLevels found = find_levels(folder.path(), manifest, true);
  ASSERT_TRUE(found.manifest) << found.obstacle;
  EXPECT_EQ(encode_manifest(*found.manifest), encode_manifest(manifest));
  EXPECT_EQ(found.manifest->levels[0].relative_rms, 1.0 / 3.0);
  EXPECT_EQ(found.manifest->levels[1].shortfall, "topology");
}

TEST_F(LevelStore, WhateverDiffersIsNamed) {
  LevelManifest wanted = manifest;
  wanted.source_hash = "file 4567";
  EXPECT_NE(obstacle(wanted).find("source has changed"), std::string::npos);
  wanted = manifest;
  wanted.settings = "ply";
  EXPECT_NE(obstacle(wanted).find("other options"), std::string::npos);
  wanted = manifest;
  wanted.levels[1].asked_triangles = 300;
  EXPECT_NE(obstacle(wanted).find("other numbers"), std::string::npos);
  wanted.levels.pop_back();
  EXPECT_NE(obstacle(wanted).find("other numbers"), std::string::npos);
  EXPECT_EQ(obstacle(manifest), "");
  folder.write("4000.glb", "level 4001");
  EXPECT_EQ(obstacle(manifest), "4000.glb has changed") << "of the same size";
  folder.write("4000.glb", "level");
  EXPECT_EQ(obstacle(manifest), "4000.glb has changed");
  std::filesystem::remove(folder.path() / "4000.glb");
  EXPECT_EQ(obstacle(manifest), "4000.glb is missing");
  folder.write("4000.glb", "level 4000");
  folder.write("levels.png", "piktures");
  EXPECT_EQ(obstacle(manifest), "levels.png has changed");
  EXPECT_EQ(obstacle(manifest, false), "") << "no picture is wanted";
  std::filesystem::remove(folder.path() / kManifestName);
  EXPECT_EQ(obstacle(manifest), "there are none yet");
}

TEST_F(LevelStore, NoCutOrChangedManifestIsBelieved) {
  const std::string text = encode_manifest(manifest);
  for (std::size_t size = 0; size + 2 < text.size(); ++size) {
    EXPECT_FALSE(decode_manifest(std::string_view(text).substr(0, size))) << size;
  }
  const auto complaint = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    const auto decoded = decode_manifest(changed);
    return decoded ? std::string() : decoded.error().message;
  };
  EXPECT_NE(complaint("4000.glb", "../4000.glb").find("outside its folder"), std::string::npos);
  EXPECT_NE(complaint("\"size_bytes\": 10", "\"size_bytes\": -10").find("size_bytes"), std::string::npos);
  EXPECT_NE(complaint("fanstream levels 1", "fanstream levels 2").find("another format"), std::string::npos);
  EXPECT_NE(complaint("\"levels\"", "\"layers\"").find("no levels"), std::string::npos);
  for (const char* other : {"[]", "3", "null", "{}", "{\"format\": 7}"}) EXPECT_FALSE(decode_manifest(other));
  folder.write(std::string(kManifestName), std::string(2U << 20U, ' '));
  EXPECT_NE(obstacle(manifest), "");
}

TEST(ContentHash, IsOfTheBytesHoweverTheyCome) {
  ContentHash whole, parts;
  const std::string text = "some bytes";
  whole.add(std::as_bytes(std::span(text)));
  for (const char& c : text) parts.add(std::as_bytes(std::span(&c, 1)));
  EXPECT_EQ(whole.text(), parts.text());
  EXPECT_EQ(whole.text().size(), 32U);
  const testing::TemporaryFolder folder;
  EXPECT_EQ(hash_of_file(folder.write("file", text)).value(), whole.text());
  EXPECT_EQ(hash_of_file(folder.path() / "none").error().kind, ErrorKind::not_found);
  EXPECT_EQ(hash_of_file(folder.path()).error().kind, ErrorKind::io);
}

}  // namespace
}  // namespace fanstream
