// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <ostream>
#include <string>

#include <gmock/gmock.h>

#include "tests/corpus/expectations.hpp"
#include "tests/corpus/score.hpp"

namespace slsd {

void PrintTo(const Expectation& expectation, std::ostream* out) {
  *out << expectation.scene;
}

void PrintTo(const CloudPoint& point, std::ostream* out) {
  *out << "column " << point.column << ", row " << point.row << " at (" << point.camera_u << ", " << point.camera_v
       << ") px";
}

namespace {

std::string name_of(const testing::TestParamInfo<Expectation>& info) {
  std::string name(info.param.scene);
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
}

void expect_reached(const Result<Scene>& scene, const Expectation& expectation) {
  ASSERT_TRUE(scene) << to_string(scene.error());
  const auto score = decode_and_score(*scene, {});
  ASSERT_TRUE(score) << to_string(score.error());
  EXPECT_THAT(score->wrong, testing::IsEmpty());
  EXPECT_GE(score->decoded_percent(), expectation.decoded_min_percent) << "of " << score->resolvable;
  EXPECT_GE(score->inlier_percent(), expectation.inlier_min_percent) << "of " << score->resolvable;
  EXPECT_LE(score->depth_rms_mm, expectation.depth_rms_max_mm) << "worst " << score->depth_worst_mm;
}

class Rendered : public testing::TestWithParam<Expectation> {};
class PatternItself : public testing::TestWithParam<Expectation> {};

TEST_P(Rendered, IsDecodedAndNothingIsWrong) {
  expect_reached(read_scene(GetParam().scene), GetParam());
}

TEST_P(PatternItself, IsDecodedAndNothingIsWrong) {
  expect_reached(scene_of_pattern(GetParam().scene), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Corpus, Rendered, testing::ValuesIn(kRendered), name_of);
INSTANTIATE_TEST_SUITE_P(Corpus, PatternItself, testing::ValuesIn(kPatterns), name_of);

}  // namespace
}  // namespace slsd
