#include "server/store/model_build.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/mesh_files.h"
#include "tests/support/mesh_generators.h"
#include "tests/support/temporary_folder.h"

namespace fanstream {
namespace {

TEST(ModelBuild, TheShareThatIsDoneRisesThroughAllStages) {
  const testing::TemporaryFolder folder;
  const auto path = folder.write("terrain.ply", testing::ply_binary(testing::make_terrain(40, 40, 1), false));
  BuildOptions options;
  options.fine_share = 0.9;  // as for large models: their generations are ordered by error
  double before = 0.0;
  std::set<std::string, std::less<>> stages;
  options.progress = [&](std::string_view stage, double fraction) {
    const double share = overall_fraction(stage, fraction);
    EXPECT_GE(share, before) << stage << " " << fraction;
    EXPECT_LE(share, 1.0);
    if (stage != "import") {
      EXPECT_GT(share, 0.0) << stage << " is not among the stages";
    }
    before = share;
    stages.emplace(stage);
  };
  ASSERT_TRUE(build_model(path, options));
  EXPECT_GE(stages.size(), 5U);
  EXPECT_GT(before, 0.75);
}

}  // namespace
}  // namespace fanstream
