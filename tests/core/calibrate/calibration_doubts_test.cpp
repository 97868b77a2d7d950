// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/doubt/calibration_doubts.hpp"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <Eigen/Geometry>

#include "tests/core/geometry/paper_rig.hpp"

namespace slsd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr DepthRange kRange{400, 2500};

/// The camera looks ahead from beside the projector, and both are turned to meet at a depth.
Calibration rig_of(double baseline_mm, const Eigen::Vector3d& side, double meeting_mm) {
  Calibration rig = paper_rig();
  const Eigen::Vector3d camera = baseline_mm * side.normalized();  // in the projector's frame
  const Eigen::Vector3d ahead = (Eigen::Vector3d(0, 0, meeting_mm) - camera).normalized();
  RigidTransform& there = rig.cameras[0].projector_from_camera;
  there.rotation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), ahead).toRotationMatrix();
  there.translation = camera;
  return rig;
}

std::string only_doubt(const Calibration& calibration, const DepthRange& range = kRange) {
  const std::vector<std::string> doubts = calibration_doubts(calibration, range);
  EXPECT_EQ(doubts.size(), 1U);
  return doubts.empty() ? "" : doubts.front();
}

TEST(CalibrationDoubts, HasNoneAboutTheRigsOfPapers) {
  EXPECT_THAT(calibration_doubts(paper_rig(), kRange), IsEmpty());
}

// Macros, tables, cells and halls: beside, above and below, parallel and converging, with shifted projector lenses.
RC_GTEST_PROP(CalibrationDoubts, HasNoneAboutRigsThatSomebodyWouldBuild, ()) {
  const double distance_mm = std::exp(uniform(std::log(200), std::log(12000)));
  const double share = std::exp(uniform(std::log(0.06), std::log(0.6)));
  const double angle = uniform(0, 6.28);
  const Eigen::Vector3d side(std::cos(angle), std::sin(angle), uniform(-0.2, 0.2));
  Calibration rig = rig_of(share * distance_mm, side, distance_mm * uniform(0.8, 1.6));
  Lens &camera = rig.cameras[0].lens, &projector = rig.projector;
  camera.distortion = projector.distortion = {};
  camera.fx = camera.fy = camera.width_px * uniform(0.7, 2.6);
  camera.cx = camera.width_px * uniform(0.44, 0.56), camera.cy = camera.height_px * uniform(0.44, 0.56);
  projector.fx = projector.fy = projector.width_px * uniform(0.8, 2.4);
  projector.cx = projector.width_px * uniform(0.46, 0.54);
  const DepthRange range{distance_mm * uniform(0.5, 0.9), distance_mm * uniform(1.1, 2)};
  RC_ASSERT(calibration_doubts(rig, range).empty());
}

// What a file has that is meant to be a sound rig, and what is said of it.
struct Mistake {
  const char* name;
  const char* advice;
  void (*make)(Calibration&);
};

class Mistaken : public ::testing::TestWithParam<Mistake> {};

TEST_P(Mistaken, IsNamed) {
  Calibration rig = rig_of(180, {1, 0.05, 0.1}, 1200);
  GetParam().make(rig);
  EXPECT_THAT(only_doubt(rig), HasSubstr(GetParam().advice));
}

RigidTransform& motion(Calibration& rig) {
  return rig.cameras[0].projector_from_camera;
}

RigidTransform inverse_of(const Calibration& rig) {
  return rig.cameras[0].projector_from_camera.inverse();
}

void shrink(Lens& lens, double factor) {
  lens.fx *= factor, lens.fy *= factor, lens.cx *= factor, lens.cy *= factor;
}

// As Metashape and MATLAB write it.
std::array<double, 5> radial_first(double k1, double k2, double k3, double p1, double p2) {
  return {k1, k2, k3, p1, p2};
}

const Mistake kMistakes[] = {
    {"Metres", "T looks like metres: multiply it by 1000", [](Calibration& rig) { motion(rig).translation /= 1000; }},
    {"Centimetres", "T looks like centimetres: multiply it by 10",
     [](Calibration& rig) { motion(rig).translation /= 10; }},
    {"Inches", "T looks like inches: multiply it by 25.4", [](Calibration& rig) { motion(rig).translation /= 25.4; }},
    {"Micrometres", "T looks like micrometres: multiply it by 0.001",
     [](Calibration& rig) { motion(rig).translation *= 1000; }},
    {"CameraInOpenGl", "the camera's axes look like OpenGL's",
     [](Calibration& rig) { motion(rig).rotation.rightCols<2>() *= -1; }},
    {"ProjectorInOpenGl", "the projector's axes look like OpenGL's",
     [](Calibration& rig) { motion(rig).rotation.bottomRows<2>() *= -1, motion(rig).translation.tail<2>() *= -1; }},
    {"HalfTheCamera", "camera_matrix looks made for images of 800x600 px: multiply fx, fy, cx and cy by 2",
     [](Calibration& rig) { shrink(rig.cameras[0].lens, 0.5); }},
    {"TwiceTheProjector", "projector_matrix looks made for images of 2560x1600 px",
     [](Calibration& rig) { shrink(rig.projector, 2); }},
    {"Swapped", "camera_matrix and projector_matrix look swapped",
     [](Calibration& rig) {
       std::swap(rig.cameras[0].lens, rig.projector);
       std::swap(rig.cameras[0].lens.width_px, rig.projector.width_px);
       std::swap(rig.cameras[0].lens.height_px, rig.projector.height_px);
     }},
    {"CameraWithRadialFirst", "camera_distortion looks ordered as k1 k2 k3 p1 p2: slsd reads k1 k2 p1 p2 k3",
     [](Calibration& rig) { rig.cameras[0].lens.distortion = radial_first(-0.11, 0.13, -0.05, 0.0006, -0.0004); }},
    {"ProjectorWithRadialFirst", "projector_distortion looks ordered as k1 k2 k3 p1 p2",
     [](Calibration& rig) { rig.projector.distortion = radial_first(-0.06, 0.09, 0.03, -0.002, 0.001); }},
    {"PrincipalPointOutside", "camera_matrix has its principal point at (-300, 605) of 1600x1200 px",
     [](Calibration& rig) { rig.cameras[0].lens.cx = -300; }},
    {"FocalLengthInMillimetres", "a focal length of 8 px for 1600 px, a view of 179 degrees",
     [](Calibration& rig) { rig.cameras[0].lens.fx = rig.cameras[0].lens.fy = 8; }},
};

INSTANTIATE_TEST_SUITE_P(CalibrationDoubts, Mistaken, ::testing::ValuesIn(kMistakes),
                         [](const auto& one) { return one.param.name; });

TEST(CalibrationDoubts, NamesAWorkingRangeInMetres) {
  EXPECT_THAT(only_doubt(paper_rig(), {0.4, 2.5}),
              HasSubstr("depth_max_mm (2.5) are millimetres, and look like metres"));
  EXPECT_THAT(calibration_doubts(paper_rig(), {0.4, 2500}), ::testing::Each(Not(HasSubstr("working range is"))));
}

// A lens whose decentring was measured poorly is no mistake.
TEST(CalibrationDoubts, HasNoneAboutALittleDecentring) {
  Calibration rig = paper_rig();
  rig.cameras[0].lens.distortion = {-0.11, 0.13, 0.008, -0.006, 0};
  EXPECT_THAT(calibration_doubts(rig, kRange), IsEmpty());
}

TEST(CalibrationDoubts, SaysWhatTheRigCouldMeasure) {
  Calibration rig = rig_of(180, {1, 0, 0}, 1200);
  motion(rig).translation /= 1000;
  EXPECT_THAT(only_doubt(rig), HasSubstr("are 0.18 mm apart; from 400 to 2500 mm the light moves by 0.73 px"));
}

// ---- further cameras ----

Calibration two_cameras() {
  Calibration rig = rig_of(180, {1, 0, 0}, 1200);
  CalibratedCamera right = rig_of(200, {-1, 0.1, 0}, 1200).cameras[0];
  right.name = "right";
  right.rig_from_camera = inverse_of(rig).after(right.projector_from_camera);
  rig.cameras.push_back(right);
  return rig;
}

TEST(CalibrationDoubts, ComparesBothWaysOfAFurtherCamera) {
  EXPECT_THAT(calibration_doubts(two_cameras(), kRange), IsEmpty());
  Calibration metres = two_cameras();
  metres.cameras[1].rig_from_camera.translation /= 1000;
  EXPECT_THAT(only_doubt(metres), HasSubstr("camera \"right\""));
  EXPECT_THAT(only_doubt(metres), HasSubstr("rig_from_camera_T looks like metres: multiply it by 1000"));
  Calibration inverted = two_cameras();
  inverted.cameras[1].rig_from_camera = inverted.cameras[1].rig_from_camera.inverse();
  EXPECT_THAT(only_doubt(inverted), HasSubstr("rig_from_camera looks inverted"));
  Calibration other = two_cameras();
  other.cameras[1].rig_from_camera.translation += Eigen::Vector3d(0, 90, 0);
  EXPECT_THAT(only_doubt(other), HasSubstr("disagrees with R and T by 90 mm"));
}

// ---- by symbols ----

/// What the camera sees of a wall that is bent, as the rig really is.
std::vector<Match> symbols_of(const Calibration& rig, double depth_mm) {
  const CalibratedCamera& camera = rig.cameras[0];
  std::vector<Match> matches;
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 16; ++column) {
      const Eigen::Vector2d pixel(100 + 90 * column, 100 + 90 * row);
      const double z = depth_mm * (1 + 0.01 * ((row * 5 + column * 3) % 11));
      const Eigen::Vector3d there = camera.projector_from_camera * (z * camera.lens.undistort(pixel).homogeneous());
      matches.push_back({pixel, rig.projector.project(there)});
    }
  }
  return matches;
}

std::string doubt_of(const Calibration& given, const std::vector<Match>& matches) {
  return symbol_doubt(matches, {given.cameras[0], given.projector}, kRange, 1.5);
}

TEST(SymbolDoubt, HasNoneWhereTheSymbolsArePoints) {
  const Calibration rig = rig_of(180, {1, 0, 0}, 1200);
  EXPECT_EQ(doubt_of(rig, symbols_of(rig, 900)), "");
}

TEST(SymbolDoubt, NamesWhatPlausibleGeometryHides) {
  for (const Eigen::Vector3d& side :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0.1), Eigen::Vector3d(-1, 0.3, -0.2)}) {
    const Calibration rig = rig_of(180, side, 1200);
    const std::vector<Match> matches = symbols_of(rig, 900);
    Calibration inverted = rig;
    motion(inverted) = inverse_of(rig);
    EXPECT_THAT(doubt_of(inverted, matches), HasSubstr("R and T look inverted (camera_from_projector)"));
    Calibration transposed = rig;
    motion(transposed).rotation.transposeInPlace();
    EXPECT_THAT(doubt_of(transposed, matches), HasSubstr("R looks transposed: transpose it"));
    Calibration place = rig;
    motion(place).translation = inverse_of(rig).translation;
    EXPECT_THAT(doubt_of(place, matches), HasSubstr("T looks like the projector's place"));
    Calibration both = inverted;
    motion(both).translation /= 1000;
    EXPECT_THAT(doubt_of(both, matches),
                HasSubstr("T looks like metres: multiply it by 1000, and R and T look inverted"));
  }
}

TEST(SymbolDoubt, NamesTheInverseOfAParallelRig) {
  Calibration rig = rig_of(180, {1, 0, 0}, 1e9);
  const std::vector<Match> matches = symbols_of(rig, 900);
  motion(rig).translation *= -1;
  EXPECT_THAT(doubt_of(rig, matches), HasSubstr("puts most of them behind the camera; R and T look inverted"));
}

TEST(SymbolDoubt, TellsWhereTheSymbolsLie) {
  const Calibration rig = rig_of(180, {1, 0, 0}, 1200);
  const std::string doubt = doubt_of(rig, symbols_of(rig, 3000));
  EXPECT_THAT(doubt,
              HasSubstr("192 symbols of the pattern were read, but the calibration puts most of them from 3030 mm"));
  EXPECT_THAT(doubt, HasSubstr("set depth_min_mm (400) and depth_max_mm (2500)"));
}

TEST(SymbolDoubt, TellsOfAnotherRig) {
  const Calibration rig = rig_of(180, {1, 0, 0}, 1200);
  const std::vector<Match> matches = symbols_of(rig, 900);
  Calibration other = rig;
  motion(other).rotation = Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitX()) * motion(other).rotation;
  EXPECT_THAT(doubt_of(other, matches), HasSubstr("px off their epipolar lines: it belongs to another rig"));
}

TEST(SymbolDoubt, SaysNothingOfAFewSymbols) {
  Calibration rig = rig_of(180, {1, 0, 0}, 1200);
  std::vector<Match> matches = symbols_of(rig, 900);
  motion(rig).translation /= 1000;
  EXPECT_NE(doubt_of(rig, matches), "");
  matches.resize(kSymbolsForDoubt - 1);
  EXPECT_EQ(doubt_of(rig, matches), "");
}

TEST(CalibrationErrorWarnings, NameEachErrorAboveThreeTenthsOfAPixel) {
  Calibration rig = paper_rig();
  EXPECT_THAT(calibration_error_warnings(rig), IsEmpty());
  rig.report.reprojection_error_camera_px = 0.3;
  EXPECT_THAT(calibration_error_warnings(rig), IsEmpty());
  rig.report.reprojection_error_camera_px = 0.31;
  rig.report.reprojection_error_projector_px = 0.4;
  rig.report.epipolar_error_px = 0.5;
  EXPECT_THAT(calibration_error_warnings(rig),
              ElementsAre(HasSubstr("in the camera is 0.31 px"), HasSubstr("in the projector is 0.40 px"),
                          HasSubstr("across the epipolar lines is 0.50 px")));
}

}  // namespace
}  // namespace slsd
