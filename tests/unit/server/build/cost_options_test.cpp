#include "server/build/cost_options.h"

#include <gtest/gtest.h>

#include <limits>

#include "server/build/asset_builder.h"
#include "tests/support/mesh_generators.h"

namespace fanstream {
namespace {

TEST(CostOptions, EveryNameIsKnownByItself) {
  for (const CostKind cost : {CostKind::fans, CostKind::quadric, CostKind::curvature}) {
    EXPECT_EQ(cost_of_name(name_of(cost)).value(), cost);
  }
  for (const Placement place : {Placement::ends_middle, Placement::end, Placement::segment, Placement::optimal}) {
    EXPECT_EQ(placement_of_name(name_of(place)).value(), place);
  }
  for (const Curvature c : {Curvature::mean, Curvature::gaussian, Curvature::principal}) {
    EXPECT_EQ(curvature_of_name(name_of(c)).value(), c);
  }
  for (const Quadrics q : {Quadrics::accumulated, Quadrics::memoryless}) {
    EXPECT_EQ(quadrics_of_name(name_of(q)).value(), q);
  }
  for (const Valences v : {Valences::any, Valences::regular}) EXPECT_EQ(valences_of_name(name_of(v)).value(), v);
}

TEST(CostOptions, AnUnknownNameIsRefusedWithThoseThatAreKnown) {
  const auto refused = [](const auto& result, const std::string& known) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind, ErrorKind::usage);
    EXPECT_NE(result.error().message.find("'qem'"), std::string::npos) << result.error().message;
    EXPECT_NE(result.error().message.find(known), std::string::npos) << result.error().message;
  };
  refused(cost_of_name("qem"), "fans, quadric and curvature");
  refused(placement_of_name("qem"), "ends+middle, end, segment and optimal");
  refused(curvature_of_name("qem"), "mean, gaussian and principal");
  refused(quadrics_of_name("qem"), "accumulated and memoryless");
  refused(valences_of_name("qem"), "any and regular");
  EXPECT_FALSE(cost_of_name(""));
  EXPECT_FALSE(cost_of_name("Quadric"));
}

TEST(CostOptions, OnlyTheQuadricLooksAtValencesUnlessTold) {
  EXPECT_EQ(valences_of({}), Valences::regular);
  EXPECT_EQ(valences_of({.cost = CostKind::fans}), Valences::any);
  EXPECT_EQ(valences_of({.cost = CostKind::curvature}), Valences::any);
  EXPECT_EQ(valences_of({.valences = Valences::any}), Valences::any);
  EXPECT_EQ(valences_of({.cost = CostKind::fans, .valences = Valences::regular}), Valences::regular);
}

TEST(CostOptions, WhatBelongsToAnotherCostIsRefused) {
  EXPECT_TRUE(check_cost_options({}));
  const auto refused = [](const CostOptions& options, const std::string& why) {
    const Result<void> checked = check_cost_options(options);
    ASSERT_FALSE(checked) << why;
    EXPECT_EQ(checked.error().kind, ErrorKind::usage);
    EXPECT_NE(checked.error().message.find(why), std::string::npos) << checked.error().message;
    BuildOptions build;
    build.cost = options;
    EXPECT_FALSE(build_asset(testing::make_tetrahedron(), build));
  };
  refused({.cost = CostKind::fans, .quadrics = Quadrics::memoryless}, "no quadrics");
  refused({.cost = CostKind::fans, .curvature = Curvature::mean}, "does not look at curvature");
  refused({.curvature = Curvature::mean}, "does not look at curvature");
  refused({.kappa = 0.5}, "no springs");
  refused({.cost = CostKind::curvature, .samples = 5}, "no point set");
  refused({.cost = CostKind::fans, .kappa = -1.0}, "at least 0");
  refused({.cost = CostKind::fans, .kappa = std::numeric_limits<double>::quiet_NaN()}, "at least 0");
  refused({.cost = CostKind::fans, .samples = CostOptions::kMostSamples + 1}, "the limit is");
  EXPECT_TRUE(check_cost_options({.cost = CostKind::fans, .kappa = 0.0, .samples = 7}));
}

}  // namespace
}  // namespace fanstream
