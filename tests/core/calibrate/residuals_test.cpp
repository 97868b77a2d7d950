// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/solve/residuals.hpp"

#include <ceres/autodiff_cost_function.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <opencv2/calib3d.hpp>

#include "core/calibrate/solve/point_residuals.hpp"
#include "core/calibrate/solve/pose_influence.hpp"
#include "core/calibrate/solve/start/resection.hpp"
#include "tests/core/calibrate/plain_residuals.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

double between(int low, int high) {
  return *rc::gen::inRange(low, high);
}

RC_GTEST_PROP(Distort, IsThatOfTheLens, ()) {
  const RigModel rig = true_rig();
  const Lens lens = to_lens(rig.cameras[0].lens, rig.cameras[0].size);
  const double x = between(-250, 250) / 1000, y = between(-200, 200) / 1000;
  RC_ASSERT((test::distort(rig.cameras[0].lens.data(), x, y) - lens.distort({x, y})).norm() < 1e-9);
}

RC_GTEST_PROP(Moved, IsThatOfOpenCv, ()) {
  const MotionVector motion{between(-300, 300) / 100, between(-300, 300) / 100, between(-300, 300) / 100,
                            between(-9, 9),           between(-9, 9),           between(-9, 9)};
  const Eigen::Vector3d point(between(-50, 50), between(-50, 50), between(100, 200));
  std::vector<cv::Point2d> pixels;
  cv::Matx33d turn;
  cv::Rodrigues(cv::Vec3d(motion[0], motion[1], motion[2]), turn);
  const cv::Vec3d other =
      turn * cv::Vec3d(point.x(), point.y(), point.z()) + cv::Vec3d(motion[3], motion[4], motion[5]);
  const Eigen::Vector3d own = test::moved(motion.data(), point);
  RC_ASSERT((own - Eigen::Vector3d(other[0], other[1], other[2])).norm() < 1e-9);
  RC_ASSERT((test::moved_back(motion.data(), own) - point).norm() < 1e-9);
  RC_ASSERT((to_motion(motion) * point - own).norm() < 1e-9);
}

/// Residuals and their slopes by each block, one after the other.
Eigen::VectorXd evaluated(const ceres::CostFunction& cost, const std::vector<const double*>& blocks) {
  Eigen::Index size = 2;
  for (const int block : cost.parameter_block_sizes()) size += 2 * block;
  Eigen::VectorXd values(size);
  std::vector<double*> slopes;
  double* next = values.data() + 2;
  for (const int block : cost.parameter_block_sizes()) slopes.push_back(next), next += 2 * block;
  EXPECT_TRUE(cost.Evaluate(blocks.data(), values.data(), slopes.data()));
  return values;
}

double relative(const Eigen::VectorXd& values, const Eigen::VectorXd& other) {
  return ((values - other).array() / other.array().abs().max(1)).abs().maxCoeff();
}

LensVector any_lens() {
  return {double(between(600, 900)), double(between(600, 900)), double(between(500, 520)),
          double(between(380, 400)), between(-200, 200) / 1e3,  between(-100, 100) / 1e3,
          between(-100, 100) / 1e4,  between(-100, 100) / 1e4,  between(-100, 100) / 1e3};
}

/// A turn, at times none, and a shift.
MotionVector any_place(double far_mm) {
  const double turn = between(0, 4) == 0 ? 0 : 1e-3;
  return {turn * between(-400, 400), turn * between(-400, 400),  turn * between(-400, 400),
          between(-100, 100),        double(between(-100, 100)), far_mm + between(-100, 100)};
}

/// Distance from the middle of a shape to where a projector pixel meets its plane, in half boards along either side.
double half_boards_to(const Eigen::Vector2d& pixel, const LensVector& projector, const MotionVector& projector_from_rig,
                      const MotionVector& rig_from_board, const ShapeFrame& frame) {
  const RigidTransform board_from_projector =
      to_motion(rig_from_board).inverse().after(to_motion(projector_from_rig).inverse());
  const Eigen::Vector3d& eye = board_from_projector.translation;
  const Eigen::Vector3d ray = board_from_projector.rotation * to_lens(projector, {}).undistort(pixel).homogeneous();
  const Eigen::Vector3d met = eye - eye.z() / ray.z() * ray;
  return (met.head<2>() - frame.middle_mm).cwiseAbs().maxCoeff() / frame.half_mm;
}

RC_GTEST_PROP(Residuals, HaveTheSlopesThatCeresFindsByItself, ()) {
  const LensVector camera = any_lens(), projector = any_lens();
  const MotionVector camera_place = any_place(0), projector_place = any_place(0), board = any_place(1500);
  const double scale = between(-30, 30) / 1e3, stretch = between(-30, 30) / 1e3, sigma_px = between(1, 100) / 100.0;
  const std::array<double, 2> shift_px{between(-100, 100) / 1e3, between(-100, 100) / 1e3};
  const Eigen::Vector2d seen_px(between(100, 900), between(100, 700)), other(between(350, 650), between(250, 550));
  const ShapeFrame frame{{double(between(-50, 250)), double(between(-50, 150))}, double(between(80, 300))};
  // A polynomial of fourth order says nothing of what is far beyond the board.
  RC_PRE(half_boards_to(other, projector, projector_place, board, frame) < 2);
  ShapeVector shape;
  for (double& term : shape) term = between(-100, 100) / 1e2;
  const ceres::AutoDiffCostFunction<test::CornerResidual, 2, 9, 6, 6, 1, 1, 12> corner(
      new test::CornerResidual{seen_px, other, sigma_px, frame});
  const std::vector<const double*> of_corner{camera.data(), camera_place.data(), board.data(), &scale,
                                             &stretch,      shape.data()};
  RC_ASSERT(relative(evaluated(CornerResidual(seen_px, other, sigma_px, frame), of_corner),
                     evaluated(corner, of_corner)) < 1e-8);
  const ceres::AutoDiffCostFunction<test::SymbolResidual, 2, 9, 6, 9, 6, 6, 2, 12> symbol(
      new test::SymbolResidual{seen_px, other, sigma_px, frame});
  const std::vector<const double*> of_symbol{
      camera.data(), camera_place.data(), projector.data(), projector_place.data(),
      board.data(),  shift_px.data(),     shape.data()};
  RC_ASSERT(relative(evaluated(SymbolResidual(seen_px, other, sigma_px, frame), of_symbol),
                     evaluated(symbol, of_symbol)) < 1e-7);
}

// However far from the board a ray meets its plane: misread symbols may lie anywhere.
RC_GTEST_PROP(MeetShape, FindsAPointOfRayAndShape, ()) {
  const ShapeFrame frame{{100, 60}, double(between(80, 300))};
  const ShapeVector plausible = plausible_shape(frame);
  ShapeVector shape;
  for (std::size_t i = 0; i < kShapeTerms; ++i) shape[i] = 3 * plausible[i] * between(-100, 100) / 1e2;
  const Eigen::Vector3d eye(between(-1500, 1500), between(-1500, 1500), -between(400, 2000)),
      target(between(-20, 20) * frame.half_mm, between(-20, 20) * frame.half_mm, 0), ray = target - eye;
  RC_PRE(ray.z() > 0.3 * ray.norm());
  const auto met = meet_shape(shape.data(), frame, eye, ray);
  RC_ASSERT(met.has_value());
  RC_ASSERT(std::abs(shape_at(shape.data(), frame, met->head<2>()).height_mm - met->z()) < 1e-8);
  RC_ASSERT((*met - eye).cross(ray).norm() / ray.norm() < 1e-8);
}

TEST(MeetShape, HasNoAnswerIfTheRayMissesTheShape) {
  const ShapeFrame frame{{0, 0}, 100};
  const ShapeVector hollow{50};
  const Eigen::Vector3d eye(-1000, 0, -10), along(1, 0, 0), grazing(1, 0, 1e-12), towards(1, 0, 0.05);
  EXPECT_FALSE(meet_shape(hollow.data(), frame, eye, along));
  EXPECT_FALSE(meet_shape(hollow.data(), frame, eye, grazing));
  EXPECT_TRUE(meet_shape(hollow.data(), frame, eye, towards));
}

TEST(SymbolResidual, IsZeroForWhatTheRigSees) {
  const RigModel rig = true_rig();
  const auto poses = true_poses(3);
  const Observations seen = see(rig, poses, {.corner_sigma_px = 0, .symbol_sigma_px = 0});
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const ViewResiduals residuals = residuals_of(seen.poses[i].views[0], rig, poses[i]);
    EXPECT_LT(rms_px(residuals.corners_px), 1e-9);
    EXPECT_LT(rms_px(residuals.symbols_px), 1e-9);
    EXPECT_LT(rms_px(residuals.symbols_projector_px), 1e-9);
    for (const ProjectedPoint& symbol : seen.poses[i].views[0].symbols) {
      double residual[2];
      const double unshifted[2] = {0, 0};
      const ShapeVector flat{};
      test::SymbolResidual{symbol.camera_px, symbol.projector_px, 1, {}}(
          rig.cameras[0].lens.data(), rig.cameras[0].device_from_rig.data(), rig.projector.lens.data(),
          rig.projector.device_from_rig.data(), poses[i].data(), unshifted, flat.data(), residual);
      EXPECT_LT(std::hypot(residual[0], residual[1]), 1e-9);
    }
  }
}

TEST(Linearise, HasTheDerivativesOfFiniteDifferences) {
  RigModel rig = true_rig();
  rig.rig_from_board = true_poses(2);
  rig.shape = {{{225, 150}, 225}, {1.5, -0.5, 0.8, 0.2, -0.1, 0.1, 0.2, -0.2, 0.1, 0.3, 0.1, 0.2}};
  const Observations seen = see(rig, rig.rig_from_board, {.seed = 3});
  BundleOptions options;
  options.shape_sigma_mm = plausible_shape(rig.shape.frame);
  options.cameras.assign(1, kUsualDistortion);
  options.corner_sigma_px = 1, options.symbol_sigma_factor = 20;  // so wide that no residual is weighed down
  const auto linear = linearise(seen, options, rig);
  ASSERT_TRUE(linear) << linear.error().message;
  const BundleEquations& equations = *linear;
  for (std::size_t i = 0; i < equations.shared.size(); ++i) {
    const SharedParameter& parameter = equations.shared[i];
    RigModel changed = rig;
    DeviceModel& device = parameter.device < 0 ? changed.projector : changed.cameras[0];
    const auto index = static_cast<std::size_t>(parameter.index);
    const bool lens = parameter.kind == SharedParameter::Kind::kLens;
    const bool shape = parameter.kind == SharedParameter::Kind::kShape;
    const double step = shape ? 1e-3 : (lens && index < 4) || (!lens && index > 2) ? 1e-3 : lens ? 1e-5 : 1e-7;
    (shape ? changed.shape.terms_mm[index] : lens ? device.lens[index] : device.device_from_rig[index]) += step;
    const auto moved = linearise(seen, options, changed);
    ASSERT_TRUE(moved) << moved.error().message;
    const Eigen::VectorXd difference = (moved->poses[0].residuals - equations.poses[0].residuals) / step;
    const Eigen::VectorXd slope = equations.poses[0].by_shared.col(static_cast<Eigen::Index>(i));
    EXPECT_LT((difference - slope).norm(), 1e-3 * slope.norm() + 1e-4) << name_of(parameter);
  }
}

/// A rig that sees boards, one of which is edge on to the projector: its symbols' rays never meet it.
struct EdgeOn {
  RigModel rig = true_rig();
  Observations seen;
  BundleOptions options;

  EdgeOn() {
    rig.rig_from_board = true_poses(4);
    seen = see(rig, rig.rig_from_board);
    options.cameras.assign(1, kUsualDistortion);
    const RigidTransform rig_from_projector = to_motion(rig.projector.device_from_rig).inverse();
    const Eigen::Vector2d pixel = seen.poses[1].views[0].symbols[0].projector_px;
    const Eigen::Vector3d ray =
        rig_from_projector.rotation * to_lens(rig.projector.lens, {}).undistort(pixel).homogeneous().normalized();
    Eigen::Matrix3d edge_on;
    edge_on << ray, ray.unitOrthogonal(), ray.cross(ray.unitOrthogonal());
    rig.rig_from_board[1] = to_vector(RigidTransform{edge_on, {0, 0, 1800}});
  }
};

TEST(Adjust, RefusesSymbolsWhoseRaysMissTheBoard) {
  EdgeOn session;
  const auto equations = linearise(session.seen, session.options, session.rig);
  ASSERT_FALSE(equations);
  EXPECT_NE(equations.error().message.find("pose_1"), std::string::npos);
  EXPECT_FALSE(adjust(session.seen, session.options, session.rig));
}

TEST(ResidualsOf, AreInfiniteForSymbolsWhoseRaysMissTheBoard) {
  const EdgeOn session;
  const ViewResiduals residuals =
      residuals_of(session.seen.poses[1].views[0], session.rig, session.rig.rig_from_board[1]);
  EXPECT_TRUE(std::isinf(residuals.symbols_px[0].norm()));
  EXPECT_TRUE(std::isinf(residuals.symbols_projector_px[0].norm()));
  EXPECT_TRUE(residuals.corners_px[0].allFinite());
}

TEST(Adjust, SaysWhetherItSettled) {
  const RigModel truth = true_rig();
  const auto poses = true_poses(4);
  const Observations seen = see(truth, poses);
  BundleOptions options;
  options.cameras.assign(1, kUsualDistortion);
  for (const int iterations : {1, 60}) {
    RigModel rig = truth;
    rig.rig_from_board = poses;
    rig.cameras[0].lens[0] *= 1.1, rig.projector.lens[2] += 20;
    options.iterations_max = iterations;
    const auto adjusted = adjust(seen, options, rig);
    ASSERT_TRUE(adjusted) << adjusted.error().message;
    EXPECT_EQ(adjusted->settled, iterations > 1);
  }
}

TEST(FindInfluence, FindsTheNoiseInPosesHeldOut) {
  RigModel rig = true_rig();
  rig.rig_from_board = true_poses(8);
  Observations seen = see(rig, rig.rig_from_board);
  BundleOptions options;
  options.cameras.assign(1, kUsualDistortion);
  options.corner_sigma_px = 0.03, options.symbol_sigma_factor = 0.08 / 0.05;
  ASSERT_TRUE(adjust(seen, options, rig));
  const auto equations = linearise(seen, options, rig);
  ASSERT_TRUE(equations) << equations.error().message;
  const auto influence = find_influence(*equations);
  ASSERT_TRUE(influence) << influence.error().message;
  EXPECT_NEAR(influence->held_out.back().corner_rms_px, 0.03 * std::sqrt(2), 0.015);
  EXPECT_NEAR(influence->held_out.back().symbol_rms_px, 0.08 * std::sqrt(2), 0.02);
}

TEST(FindInfluence, PassesPosesOverOfWhichTooLittleIsLeft) {
  RigModel rig = true_rig();
  rig.rig_from_board = true_poses(8);
  Observations seen = see(rig, rig.rig_from_board);
  const auto leave = [](auto& points, std::size_t count) {
    for (std::size_t i = count; i < points.size(); ++i) points[i].outlying = true;
  };
  const auto leave_of = [&](std::size_t pose, std::size_t corners, std::size_t symbols) {
    leave(seen.poses[pose].views[0].corners, corners), leave(seen.poses[pose].views[0].symbols, symbols);
  };
  leave_of(1, 0, 0), leave_of(2, 2, 0), leave_of(3, 0, 1), leave_of(4, 0, 280);
  BundleOptions options;
  options.cameras.assign(1, kUsualDistortion);
  options.corner_sigma_px = 0.03, options.symbol_sigma_factor = 0.08 / 0.05;
  const auto equations = linearise(seen, options, rig);
  ASSERT_TRUE(equations) << equations.error().message;
  const auto influence = find_influence(*equations);
  ASSERT_TRUE(influence) << influence.error().message;
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(influence->held_out[i].placed, i == 0 || i > 4) << i;
  EXPECT_TRUE(influence->covariance.allFinite());
}

TEST(Resect, FindsADeviceInSpiteOfWrongPoints) {
  const RigModel rig = true_rig();
  const Lens lens{1280, 800, 2500, 2510, 700, 500, {}};
  const RigidTransform place = to_motion(rig.projector.device_from_rig);
  std::vector<SpacePoint> points;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d point((i % 20) * 30 - 300, (i / 20 % 20) * 20 - 200, 1700 + (i * 37) % 500);
    points.push_back({point, lens.project(place * point)});
    if (i % 25 == 0) points.back().pixel.x() += 200;
  }
  const auto found = resect(points);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->lens[0], 2500, 1);
  EXPECT_NEAR(found->lens[3], 500, 1);
  EXPECT_LT((found->device_from_points.translation - place.translation).norm(), 0.5);
}

TEST(Resect, RefusesAMirroredPicture) {
  const RigModel rig = true_rig();
  const Lens lens{1280, 800, 2500, 2510, 700, 500, {}};
  const RigidTransform place = to_motion(rig.projector.device_from_rig);
  for (const bool upright : {true, false}) {
    std::vector<SpacePoint> points;
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3d point((i % 20) * 30 - 300, (i / 20 % 20) * 20 - 200, 1700 + (i * 37) % 500);
      Eigen::Vector2d pixel = lens.project(place * point);
      double& mirrored = upright ? pixel.x() : pixel.y();
      mirrored = 1000 - mirrored;
      points.push_back({point, pixel});
    }
    const auto found = resect(points);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, ErrorCode::kImpossible);
    EXPECT_NE(found.error().message.find("is mirrored: turn off rear projection"), std::string::npos);
  }
}

TEST(Resect, RefusesPointsOfOnePlane) {
  std::vector<SpacePoint> points;
  for (int i = 0; i < 100; ++i)
    points.push_back({{10.0 * (i % 10), 10.0 * (i / 10), 1000}, {1.0 * (i % 10), 1.0 * (i / 10)}});
  const auto found = resect(points);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::kImpossible);
}

}  // namespace
}  // namespace slsd
