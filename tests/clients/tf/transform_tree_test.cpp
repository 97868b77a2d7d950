// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tf/transform_tree.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>

namespace slsd::dds {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::StartsWith;

constexpr RosTime kNow{std::chrono::seconds(1'800'000'000)};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ros::TransformStamped told(const std::string& parent, const std::string& child, RosTime at,
                           const ros::Vector3& place = {0.1, 0, 0}, const ros::Quaternion& turn = {}) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(at);
  return {{{static_cast<std::int32_t>(seconds.time_since_epoch().count()),
            static_cast<std::uint32_t>((at - seconds).count())},
           parent},
          child,
          place,
          turn};
}

class TransformTreeTest : public testing::Test {
 protected:
  std::string add(const ros::TransformStamped& transform, bool fixed = false, std::uint64_t publisher = 1,
                  RosTime now = kNow) {
    const auto added = tree_.add(transform, fixed, publisher, now);
    return added ? "" : added.error().message;
  }
  std::string why_not(RosTime at, RosTime now = kNow, const std::string& base = "base") {
    const auto pose = tree_.base_from_flange(base, "tool", at, now);
    return pose ? "" : pose.error().message;
  }
  double x_mm(RosTime at) { return tree_.base_from_flange("base", "tool", at, kNow).value().translation.x(); }

  /// base to arm every 100 ms in the last second, 1 m/s along x; arm to tool is fixed.
  void add_moving_arm() {
    for (int i = -10; i <= 0; ++i) EXPECT_EQ(add(told("base", "arm", kNow + i * 100ms, {1 + 0.1 * i, 0, 0})), "");
    EXPECT_EQ(add(told("arm", "tool", {}, {0, 0, 0.2}), true), "");
  }

  TransformTree tree_;
};

// Numbers by scipy.spatial.transform.Slerp and products of 4x4 matrices in numpy.
TEST_F(TransformTreeTest, InterpolatesAsScipy) {
  add(told("world", "base", {}, {1.5, -0.3, 0.1},
           {0.0977651387744553, 0.04888256938722765, -0.3421779857105935, 0.9332559660380185}),
      true);
  add(told("arm", "tool", {}, {0.01, 0.02, 0.15},
           {-0.18621120176493525, 0.5586336052948057, 0.13965840132370141, 0.7960837985490559}),
      true);
  // The second quaternion is on the far side: the shorter way is by its negative.
  add(told("world", "arm", kNow - 100ms, {0.4, -0.2, 0.6},
           {0.10259783520851541, -0.20519567041703082, 0.3077935056255462, 0.9233805168766387}));
  add(told("world", "arm", kNow, {0.45, -0.1, 0.52},
           {-0.4061811972299616, 0.1160517706371319, 0.5802588531856594, -0.6963106238227913}));
  const auto check = [&](RosTime at, const Eigen::Matrix3d& turn, const Eigen::Vector3d& place) {
    const auto pose = tree_.base_from_flange("base", "tool", at, kNow);
    ASSERT_TRUE(pose) << to_string(pose.error());
    EXPECT_LT((pose->rotation - turn).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_LT((pose->translation - place).cwiseAbs().maxCoeff(), 1e-6);
  };
  Eigen::Matrix3d turn;
  turn << 0.20964488, -0.905636221, -0.368608273, 0.60526689, -0.175874306, 0.776350578, -0.767919928, -0.385864307,
      0.511280471;
  check(kNow - 100ms, turn, {-1024.522420213, -596.591766185, 580.653417101});
  turn << 0.335404887, -0.926397698, 0.171145747, 0.636189134, 0.356719844, 0.684115734, -0.694814326, -0.120574696,
      0.709009729;
  check(kNow - 70ms, turn, {-1011.107416168, -582.15956565, 551.593788329});
  turn << 0.584791582, 0.067790813, 0.808345973, 0.430048266, 0.819029345, -0.379801819, -0.687806146, 0.56973269,
      0.449808144;
  check(kNow, turn, {-1021.054353943, -558.127512901, 460.067264274});
}

TEST_F(TransformTreeTest, NeverExtrapolates) {
  add_moving_arm();
  EXPECT_DOUBLE_EQ(x_mm(kNow), 1000);
  EXPECT_NEAR(x_mm(kNow - 130ms), 870, 1e-9);
  EXPECT_DOUBLE_EQ(x_mm(kNow - 1s), 0);
  EXPECT_THAT(why_not(kNow + 1ns), StartsWith("tf_late: the newest transform of \"arm\""));
  EXPECT_THAT(why_not(kNow - 1s - 1ns), StartsWith("tf_history"));
  EXPECT_EQ(tree_.base_from_flange("base", "tool", kNow + 1ms, kNow).error().code, ErrorCode::kTimeout);
  EXPECT_EQ(tree_.newest("base", "tool", kNow + 1s).value(), kNow);
}

TEST_F(TransformTreeTest, KeepsTenSeconds) {
  for (int i = -9950; i <= 0; i += 50) add(told("base", "tool", kNow + i * 1ms), false, 1, kNow + i * 1ms);
  for (int i = 50; i <= 1000; i += 50) add(told("base", "tool", kNow + i * 1ms), false, 1, kNow + i * 1ms);
  EXPECT_EQ(why_not(kNow - 9s), "");
  EXPECT_THAT(why_not(kNow - 9s - 1ms), StartsWith("tf_history"));
}

TEST_F(TransformTreeTest, RefusesGaps) {
  add(told("base", "tool", kNow - 751ms));
  add(told("base", "tool", kNow - 500ms));
  add(told("base", "tool", kNow - 250ms));
  EXPECT_THAT(why_not(kNow - 600ms), StartsWith("tf_gap: \"tool\" has transforms that are 0.251 s apart"));
  EXPECT_EQ(why_not(kNow - 500ms), "");
  EXPECT_EQ(why_not(kNow - 400ms), "");
}

TEST_F(TransformTreeTest, RefusesBadNumbersAndChangesNothing) {
  add_moving_arm();
  const auto refused = [&](const ros::Vector3& place, const ros::Quaternion& turn) {
    return add(told("base", "arm", kNow + 10ms, place, turn));
  };
  EXPECT_THAT(refused({kNan, 0, 0}, {}), StartsWith("tf_malformed"));
  EXPECT_THAT(refused({0, 0, INFINITY}, {}), HasSubstr("not finite"));
  EXPECT_THAT(refused({}, {kNan, 0, 0, 1}), HasSubstr("not finite"));
  EXPECT_THAT(refused({}, {0, 0, 0, 0}), HasSubstr("a quaternion of length 0 instead of 1"));
  EXPECT_THAT(refused({}, {0, 0, 0, 1.011}), HasSubstr("a quaternion of length 1.01 instead of 1"));
  EXPECT_THAT(add(told("", "arm", kNow)), HasSubstr("lacks a frame's name"));
  EXPECT_THAT(add(told("base", "/", kNow)), HasSubstr("lacks a frame's name"));
  EXPECT_THAT(add(told("arm", "arm", kNow)), HasSubstr("places a frame in itself"));
  auto late = told("base", "arm", kNow);
  late.header.stamp.nanosec = 1'000'000'000;
  EXPECT_THAT(add(late), HasSubstr("more than a second of nanoseconds"));
  EXPECT_EQ(tree_.newest("base", "tool", kNow).value(), kNow);
  EXPECT_DOUBLE_EQ(x_mm(kNow), 1000);
  EXPECT_EQ(refused({2, 0, 0}, {0, 0, 0, 1.009}), "");
}

TEST_F(TransformTreeTest, RefusesBadStampsAndChangesNothing) {
  add_moving_arm();
  EXPECT_THAT(add(told("base", "arm", {})), StartsWith("tf_stamp: the transform of \"arm\" has the time zero"));
  EXPECT_THAT(add(told("base", "arm", kNow + 51ms)),
              StartsWith("tf_future: the transform of \"arm\" is stamped 0.051 s"));
  EXPECT_THAT(add(told("base", "arm", kNow - 10s - 1ms)), StartsWith("tf_old"));
  EXPECT_THAT(add(told("base", "arm", kNow - 10ms)), StartsWith("tf_stamp"));
  EXPECT_THAT(add(told("base", "arm", kNow, {3, 0, 0})), StartsWith("tf_stamp")) << "two poses at one time";
  EXPECT_EQ(add(told("base", "arm", kNow, {1, 0, 0})), "") << "the same again";
  EXPECT_DOUBLE_EQ(x_mm(kNow), 1000);
  EXPECT_EQ(add(told("base", "arm", kNow + 50ms, {1, 0, 0})), "");
}

TEST_F(TransformTreeTest, NamesWhatIsMissing) {
  EXPECT_EQ(why_not(kNow), "tf_missing: tf has no frame \"base\"");
  add(told("base", "arm", kNow));
  EXPECT_EQ(why_not(kNow), "tf_missing: tf has no frame \"tool\"");
  add(told("other", "tool", {}), true);
  EXPECT_EQ(why_not(kNow), "tf_unconnected: \"tool\" descends from \"other\", but \"base\" from \"base\"");
  EXPECT_EQ(tree_.base_from_flange("base", "tool", kNow, kNow).error().code, ErrorCode::kNotFound);
  add(told("/arm", "/other", {}), true);
  EXPECT_EQ(why_not(kNow), "");
}

TEST_F(TransformTreeTest, RefusesLoops) {
  add_moving_arm();
  add(told("world", "base", {}), true);
  EXPECT_EQ(why_not(kNow), "");
  add(told("tool", "world", {}), true);
  EXPECT_THAT(why_not(kNow),
              StartsWith("tf_loop: tf has a loop: \"base\" in \"world\" in \"tool\" in \"arm\" in \"base\""));
  TransformTree other;
  std::swap(tree_, other);
  for (const auto& [parent, child] : {std::pair("a", "b"), {"b", "c"}, {"c", "b2"}, {"b2", "a"}, {"a", "tool"}})
    add(told(parent, child, {}), true);
  EXPECT_THAT(why_not(kNow, kNow, "c"), StartsWith("tf_loop"));
}

TEST_F(TransformTreeTest, RefusesTwoParents) {
  add_moving_arm();
  EXPECT_THAT(add(told("wrist", "tool", kNow)), StartsWith("tf_two_parents: \"tool\" is placed twice, fixed in \"arm\" "
                                                           "and moving in \"wrist\""));
  EXPECT_THAT(why_not(kNow), StartsWith("tf_two_parents: \"tool\" is placed twice"));
  EXPECT_THAT(why_not(kNow, kNow + 9s), StartsWith("tf_two_parents"));
  EXPECT_EQ(why_not(kNow, kNow + 10s), "") << "the other has ended";
  add(told("wrist", "tool", {}), true, 2);
  EXPECT_THAT(why_not(kNow, kNow + 1h), HasSubstr("start slsd-dds again"));
}

TEST_F(TransformTreeTest, RefusesTwoPublishersOfAFrame) {
  add_moving_arm();
  EXPECT_THAT(add(told("base", "arm", kNow + 10ms), false, 2), StartsWith("tf_two_parents"));
  EXPECT_THAT(why_not(kNow), StartsWith("tf_two_parents"));
  EXPECT_EQ(add(told("arm", "tool", {}, {0, 0, 0.2}), true, 2), "") << "a description is published again";
  EXPECT_THAT(add(told("arm", "tool", {}, {0, 0, 0.3}), true, 2), StartsWith("tf_two_parents"));
}

TEST_F(TransformTreeTest, TakesAPublisherThatReplacesAnother) {
  add_moving_arm();
  EXPECT_THAT(add(told("base", "arm", kNow + 9s), false, 2, kNow + 9s), StartsWith("tf_two_parents"));
  const RosTime later = kNow + 10s + 1ms;
  EXPECT_EQ(add(told("base", "arm", later, {2, 0, 0}), false, 2, later), "");
  EXPECT_EQ(why_not(later, later), "");
  EXPECT_THAT(why_not(kNow, later), StartsWith("tf_history"));
  EXPECT_EQ(add(told("arm", "tool", {}, {0, 0, 0.5}), true, 1), "") << "its own publisher may move it";
}

TEST_F(TransformTreeTest, IsFullAtLast) {
  for (std::size_t i = 0; i < TransformTree::kFramesMax; ++i) add(told("base", "f" + std::to_string(i), {}), true);
  EXPECT_THAT(add(told("base", "tool", {}), true), StartsWith("tf_full"));
}

}  // namespace
}  // namespace slsd::dds
