// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/correct/correct.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "core/calibrate/calibrate.hpp"
#include "core/calibrate/solve/start/initial_rig.hpp"
#include "core/geometry/triangulate.hpp"
#include "tests/core/calibrate/synthetic_rig.hpp"

namespace slsd {
namespace {

using Drift = DriftParameter::Kind;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::StartsWith;

constexpr double kRadOfDegree = std::numbers::pi / 180;
const char* const kSheet = "charuco:11x7:34:25.5:DICT_5X5_1000";        // A3
const char* const kSmallSheet = "charuco:11x7:25:18.75:DICT_5X5_1000";  // A4

const std::vector<NamedCamera>& two_cameras() {
  static const std::vector<NamedCamera> kPair{{"left", {1600, 1200}}, {"right", {1600, 1200}}};
  return kPair;
}

struct SheetOptions {
  const char* board = kSheet;
  double distance_mm = 1000, tilt_deg = 30;
  double corner_px = 0.03, symbol_px = 0.08, together_px = 0.005;
  double print = 1;    ///< size of the print, relative to the stated one
  double bend_mm = 0;  ///< along its columns
  double visible = 1;  ///< share of its columns
  double lit = 1;
};

/// Views of a board near the middle of what camera and projector share.
Observations sheet_view(const RigModel& rig, std::uint32_t seed, const SheetOptions& options = {}) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> any(-1, 1);
  const auto noisy = [&](const Eigen::Vector2d& pixel, double sigma_px) {
    const double x = normal(random), y = normal(random);
    return Eigen::Vector2d(pixel + sigma_px * Eigen::Vector2d(x, y));
  };
  const Board board = *parse_board(options.board);
  const Eigen::Vector2d size(board.width_mm(), board.height_mm());
  const double direction = std::numbers::pi * any(random);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(options.tilt_deg * kRadOfDegree, Eigen::Vector3d(std::cos(direction), std::sin(direction), 0))
          .toRotationMatrix();
  const Eigen::Vector3d middle(30 + 20 * any(random), 20 * any(random), options.distance_mm + 50 * any(random));
  const RigidTransform rig_from_board{turn, middle - turn * Eigen::Vector3d(size.x() / 2, size.y() / 2, 0)};
  const auto on_print = [&](const Eigen::Vector2d& mm) {
    const double along = 2 * mm.x() / size.x() - 1;
    return Eigen::Vector3d(mm.x() * options.print, mm.y() * options.print, options.bend_mm * along * along);
  };
  const Lens projector = to_lens(rig.projector.lens, rig.projector.size);
  Observations out;
  PoseObservation& pose = out.poses.emplace_back();
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Lens camera = to_lens(rig.cameras[i].lens, rig.cameras[i].size);
    const RigidTransform from_rig = to_motion(rig.cameras[i].device_from_rig);
    out.cameras.push_back(two_cameras()[i]);
    PoseView& view = pose.views.emplace_back();
    view.camera = i;
    for (const Eigen::Vector3d& point : board.points()) {
      if (point.x() > options.visible * size.x()) continue;
      const Eigen::Vector3d at = from_rig * (rig_from_board * on_print(point.head<2>()));
      view.corners.push_back({noisy(camera.project(at), options.corner_px), point.head<2>()});
    }
    const Eigen::Vector2d together = noisy({0, 0}, options.together_px);
    constexpr double kPitchMm = 7.2;
    for (double y = 2; y < size.y(); y += kPitchMm) {
      for (double x = 2; x < std::min(options.visible, options.lit) * size.x(); x += kPitchMm) {
        const Eigen::Vector3d at = rig_from_board * on_print({x, y});
        view.symbols.push_back({noisy(camera.project(from_rig * at) + together, options.symbol_px),
                                projector.project(to_motion(rig.projector.device_from_rig) * at), 0.05});
      }
    }
  }
  return out;
}

Calibration calibration_of(const RigModel& rig) {
  return rig.calibration(
      {two_cameras().begin(), two_cameras().begin() + static_cast<std::ptrdiff_t>(rig.cameras.size())});
}

RigModel drifted_by(const RigModel& rig, const Explanation& explanation, std::initializer_list<double> by) {
  const std::vector<double> values(by);
  return drifted(rig, explanation,
                 Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(by.size())));
}

/// How far the points of a plane across the view are off it, measured by a calibration: root mean square and worst.
struct PlaneError {
  double rms_mm = 0, worst_mm = 0;
};
PlaneError plane_error(const RigModel& truth, const Calibration& measured_by, double depth_mm) {
  const Calibration is = calibration_of(truth);
  const CalibratedCamera &eye = is.cameras[0], &used = measured_by.cameras[0];
  PlaneError error;
  int count = 0;
  for (int y = 20; y < 1200; y += 40) {
    for (int x = 20; x < 1600; x += 40) {
      const Eigen::Vector3d point = depth_mm * eye.lens.undistort(Eigen::Vector2d(x, y)).homogeneous();
      const Eigen::Vector2d lit = is.projector.project(eye.projector_from_camera * point);
      if (lit.x() < 0 || lit.y() < 0 || lit.x() >= 1280 || lit.y() >= 800) continue;
      const double off = triangulate({{x, y}, lit}, used, measured_by.projector, 1).point_in_camera.z() - depth_mm;
      error.rms_mm += off * off, error.worst_mm = std::max(error.worst_mm, std::abs(off)), ++count;
    }
  }
  error.rms_mm = std::sqrt(error.rms_mm / count);
  return error;
}

RigModel turned_projector(double degrees) {
  const Eigen::Vector3d by = degrees * kRadOfDegree * Eigen::Vector3d(0.5, 0.8, 0.33166);
  return drifted_by(true_rig(), {{Drift::kTurn, -1, 0}, {Drift::kTurn, -1, 1}, {Drift::kTurn, -1, 2}},
                    {by.x(), by.y(), by.z()});
}

Result<Correction> corrected_by(const Observations& observations, const RigModel& calibrated,
                                bool print_measured = false, const char* board = kSheet) {
  return correct_calibration(observations, *parse_board(board), calibration_of(calibrated),
                             {print_measured, {750, 1000, 1500}});
}

double quantile_of(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// Numeric: the evidence of one free number is the integral, over that number, of its prior times the probability of the
// view if the rig were calibrated with it.
TEST(FitDrift, HasTheEvidenceThatIntegrationGives) {
  const Observations observations = sheet_view(drifted_by(true_rig(), {{Drift::kFocus, 0}}, {0.0004}), 1);
  RigModel rig = true_rig();
  rig.shape.frame = {{180, 110}, 180};
  rig.rig_from_board.push_back(*estimate_pose(observations.poses[0], rig));
  const Explanation focus{{Drift::kFocus, 0}};
  const ViewNoise noise{0.03, 1.6};
  const auto fit = fit_drift(observations, rig, focus, noise, Weighing::kEqual);
  ASSERT_TRUE(fit);
  const double sigma = std::sqrt(fit->covariance(0, 0)), prior = plausible_drift(focus[0], 178);
  constexpr int kSteps = 40;
  constexpr double kReach = 6;
  double sum = 0;
  for (int i = -kSteps; i <= kSteps; ++i) {
    const double off = kReach * i / kSteps * sigma, value = fit->by(0) + off;
    const auto fixed = fit_drift(observations, drifted_by(rig, focus, {value}), {}, noise, Weighing::kEqual);
    ASSERT_TRUE(fixed);
    const double density = std::exp(-0.5 * value * value / (prior * prior)) / (prior * std::sqrt(2 * std::numbers::pi));
    sum += density * std::exp(fixed->log_evidence - fit->log_evidence) * kReach / kSteps * sigma;
  }
  EXPECT_NEAR(std::log(sum), 0, 0.01);
}

TEST(FitDrift, RecoversADriftFromExactPoints) {
  const Explanation moved{{Drift::kTurn, -1, 0},  {Drift::kTurn, -1, 1},  {Drift::kTurn, -1, 2}, {Drift::kShift, -1, 0},
                          {Drift::kShift, -1, 1}, {Drift::kShift, -1, 2}, {Drift::kFocus, 0}};
  const std::vector<double> truth{0.002, -0.001, 0.003, 0.8, -0.3, 0.5, 0.004};
  RigModel now = drifted(true_rig(), moved, Eigen::Map<const Eigen::VectorXd>(truth.data(), 7));
  const Observations observations = sheet_view(now, 3, {.corner_px = 0, .symbol_px = 0, .together_px = 0});
  RigModel rig = true_rig();
  rig.shape.frame = {{180, 110}, 180};
  rig.rig_from_board.push_back(*estimate_pose(observations.poses[0], rig));
  const auto fit = fit_drift(observations, rig, moved, {1e-4, 2e-3}, Weighing::kEqual);
  ASSERT_TRUE(fit);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_NEAR(fit->by(static_cast<Eigen::Index>(i)), truth[i], 2e-3 * std::abs(truth[i])) << i;
  }
}

TEST(CorrectCalibration, FreesOnlyWhatTheViewAsksFor) {
  const auto turned = corrected_by(sheet_view(turned_projector(0.1), 5), true_rig());
  ASSERT_TRUE(turned) << turned.error().message;
  ASSERT_TRUE(turned->needed);
  EXPECT_THAT(turned->drift, MatchesRegex("the projector turned by 0\\.(10|09).* degrees"));
  const auto focused = corrected_by(sheet_view(drifted_by(true_rig(), {{Drift::kFocus, 0}}, {-0.005}), 6), true_rig());
  ASSERT_TRUE(focused) << focused.error().message;
  ASSERT_TRUE(focused->needed);
  EXPECT_THAT(focused->drift, MatchesRegex("the focal length of the camera is 0\\.(50|49).* % shorter"));
}

TEST(CorrectCalibration, KeepsTheReportAndTheNames) {
  Calibration calibration = calibration_of(true_rig());
  calibration.report.board = kSheet;
  const auto correction =
      correct_calibration(sheet_view(turned_projector(0.1), 5), *parse_board(kSheet), calibration, {false, {1000}});
  ASSERT_TRUE(correction) << correction.error().message;
  EXPECT_EQ(correction->calibration.report.board, kSheet);
  EXPECT_EQ(correction->calibration.cameras[0].name, "left");
  EXPECT_EQ(correction->calibration.cameras[0].lens, calibration.cameras[0].lens);
  EXPECT_NE(correction->calibration.cameras[0].projector_from_camera.rotation,
            calibration.cameras[0].projector_from_camera.rotation);
}

TEST(CorrectCalibration, NamesTheCameraThatTurned) {
  const RigModel rig = true_rig(2);
  const Explanation turn{{Drift::kTurn, 1, 0}, {Drift::kTurn, 1, 1}, {Drift::kTurn, 1, 2}};
  const auto correction = corrected_by(sheet_view(drifted_by(rig, turn, {0.001, 0.002, 0}), 2), rig);
  ASSERT_TRUE(correction) << correction.error().message;
  ASSERT_TRUE(correction->needed);
  EXPECT_THAT(correction->drift, StartsWith("camera right turned by 0.128"));
}

TEST(CorrectCalibration, LeavesACalibrationThatHolds) {
  const auto correction = corrected_by(sheet_view(true_rig(), 9), true_rig());
  ASSERT_TRUE(correction) << correction.error().message;
  EXPECT_FALSE(correction->needed);
  EXPECT_THAT(correction->drift, IsEmpty());
  ASSERT_EQ(correction->deviations.size(), 3U);
  EXPECT_LT(correction->deviations[1].before_mm, 0.2);
}

std::string refusal(const Observations& observations, const RigModel& calibrated, ErrorCode code) {
  const auto correction = corrected_by(observations, calibrated);
  if (correction) return correction->needed ? "corrected: " + correction->drift : "holds";
  EXPECT_EQ(correction.error().code, code);
  return to_string(correction.error());
}

TEST(CorrectCalibration, RefusesABoardOfAnotherSize) {
  for (const double print : {0.97, 0.985, 0.995, 1.005, 1.03}) {
    EXPECT_THAT(refusal(sheet_view(true_rig(), 4, {.print = print}), true_rig(), ErrorCode::kMismatch),
                HasSubstr("another print"))
        << print;
  }
  EXPECT_THAT(refusal(sheet_view(turned_projector(0.1), 4, {.print = 0.97}), true_rig(), ErrorCode::kMismatch),
              HasSubstr("another print"))
      << "and turned";
}

TEST(CorrectCalibration, BelievesAPrintThatWasMeasured) {
  const RigModel now = drifted_by(true_rig(), {{Drift::kDistance}}, {1});
  EXPECT_THAT(refusal(sheet_view(now, 4), true_rig(), ErrorCode::kMismatch), HasSubstr("farther from each other"));
  const auto correction = corrected_by(sheet_view(now, 4), true_rig(), true);
  ASSERT_TRUE(correction) << correction.error().message;
  EXPECT_TRUE(correction->needed);
  EXPECT_LT(plane_error(now, correction->calibration, 1500).rms_mm, 0.3);
}

TEST(CorrectCalibration, RefusesABentBoard) {
  for (const double bend_mm : {1.5, -1.5, 4.0}) {
    EXPECT_THAT(refusal(sheet_view(turned_projector(0.1), 4, {.bend_mm = bend_mm}), true_rig(), ErrorCode::kImpossible),
                HasSubstr("the board is bent by"))
        << bend_mm;
  }
}

TEST(CorrectCalibration, RefusesHalfABoard) {
  const std::string half =
      refusal(sheet_view(turned_projector(0.1), 4, {.visible = 0.5}), true_rig(), ErrorCode::kNotFound);
  EXPECT_THAT(half, HasSubstr("left: only 30 of the board's 60 points are in view"));
  EXPECT_THAT(refusal(sheet_view(turned_projector(0.1), 4, {.lit = 0.5}), true_rig(), ErrorCode::kNotFound),
              HasSubstr("lights only a part of the board"));
  EXPECT_THAT(refusal(sheet_view(turned_projector(0.1), 4, {.lit = 0.02}), true_rig(), ErrorCode::kNotFound),
              HasSubstr("only 33 symbols"));
}

TEST(CorrectCalibration, NeedsEveryCamera) {
  Observations observations = sheet_view(true_rig(2), 4);
  observations.poses[0].views.pop_back();
  EXPECT_THAT(refusal(observations, true_rig(2), ErrorCode::kNotFound), HasSubstr("right: does not see the board"));
}

TEST(CorrectCalibration, RefusesMoreThanADrift) {
  EXPECT_THAT(refusal(sheet_view(turned_projector(4), 4), true_rig(), ErrorCode::kImpossible),
              HasSubstr("more than one view can correct"));
}

TEST(CorrectCalibration, RefusesABoardThatMovedBetweenItsPictures) {
  Observations observations = sheet_view(true_rig(), 4);
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 2);
  for (ProjectedPoint& symbol : observations.poses[0].views[0].symbols) symbol.camera_px.x() += normal(random);
  EXPECT_THAT(refusal(observations, true_rig(), ErrorCode::kImpossible),
              HasSubstr("contradict each other: hold it still"));
}

TEST(CorrectCalibration, IgnoresMisreadSymbols) {
  Observations observations = sheet_view(turned_projector(0.1), 5);
  std::mt19937 random(3);
  for (ProjectedPoint& symbol : observations.poses[0].views[0].symbols) {
    if (random() % 10 != 0) continue;
    symbol.projector_px = {static_cast<double>(random() % 1280), static_cast<double>(random() % 800)};
  }
  const auto correction = corrected_by(observations, true_rig());
  ASSERT_TRUE(correction) << correction.error().message;
  ASSERT_TRUE(correction->needed);
  EXPECT_LT(plane_error(turned_projector(0.1), correction->calibration, 1500).rms_mm, 0.15);
}

/// A drift of each size of the figure, in a direction of its own.
RigModel drifted_rig(std::uint32_t seed, int focused) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  const Eigen::Vector3d turn = 0.1 * kRadOfDegree * Eigen::Vector3d(x, y, z).normalized();
  const Explanation drift{{Drift::kTurn, -1, 0},
                          {Drift::kTurn, -1, 1},
                          {Drift::kTurn, -1, 2},
                          {Drift::kDistance},
                          {Drift::kFocus, focused}};
  return drifted_by(true_rig(), drift,
                    {turn.x(), turn.y(), turn.z(), seed % 2 == 0 ? 1.0 : -1.0, seed % 4 < 2 ? 0.005 : -0.005});
}

/// A board for corrections, and the errors of the plane that it may leave.
struct Sheet {
  const char *name, *board;
  double median_mm, most_views_mm, refused;
};

/// 0.5 % of focal length, 0.1 degrees and 1 mm at once, corrected from one board at 1 m.
class CorrectFrom : public testing::TestWithParam<Sheet> {};
INSTANTIATE_TEST_SUITE_P(CorrectCalibration, CorrectFrom,
                         testing::Values(Sheet{"A3", kSheet, 0.1, 0.3, 0}, Sheet{"A4", kSmallSheet, 0.15, 0.5, 0.1}),
                         [](const auto& sheet) { return sheet.param.name; });

std::uint32_t views_asked_for() {
  const char* text = std::getenv("SLSD_TEST_VIEWS");
  return text != nullptr ? static_cast<std::uint32_t>(std::clamp(std::atoi(text), 20, 10000)) : 20;
}

TEST_P(CorrectFrom, MeasuresAPlaneBeyondTheBoard) {
  const std::uint32_t views = views_asked_for();
  for (const int focused : {-1, 0}) {
    std::vector<double> before, after;
    int inside = 0, refused = 0;
    for (std::uint32_t i = 0; i < views; ++i) {
      const RigModel now = drifted_rig(i, focused);
      const Observations seen = sheet_view(now, 100 + i, {.board = GetParam().board});
      const auto correction = corrected_by(seen, true_rig(), false, GetParam().board);
      if (!correction) {
        EXPECT_THAT(correction.error().message, HasSubstr("Bring the board nearer"));
        ++refused;
        continue;
      }
      ASSERT_TRUE(correction->needed);
      before.push_back(plane_error(now, calibration_of(true_rig()), 1500).rms_mm);
      after.push_back(plane_error(now, correction->calibration, 1500).rms_mm);
      inside += after.back() < 2 * correction->deviations.back().sigma_mm ? 1 : 0;
    }
    std::printf(
        "%s, focus of the %s: a plane at 1500 mm is off by %.2f mm before; after by %.3f mm (median), %.3f mm (95 %%"
        " of views), %.3f mm at most; of %u views %d within the interval, %d refused\n",
        GetParam().name, focused < 0 ? "projector" : "camera", quantile_of(before, 0.5), quantile_of(after, 0.5),
        quantile_of(after, 0.95), quantile_of(after, 1), views, inside, refused);
    EXPECT_LT(quantile_of(after, 0.95), GetParam().most_views_mm);
    EXPECT_LT(quantile_of(after, 0.5), GetParam().median_mm);
    EXPECT_GE(inside, 0.85 * static_cast<double>(after.size()));
    EXPECT_LE(refused, GetParam().refused * views);
  }
}

/// Counts corrections that make planes at three depths worse.
struct Harm {
  int views = 0, corrected = 0, refused = 0, worse = 0;

  void look_at(const RigModel& truth, const Calibration& calibration, std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto uniform = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    SheetOptions options{.distance_mm = uniform(900, 1600), .tilt_deg = uniform(0, 40)};
    options.symbol_px = uniform(0.05, 0.2), options.corner_px = uniform(0.02, 0.06);
    const auto correction = correct_calibration(sheet_view(truth, seed, options), *parse_board(kSheet), calibration,
                                                {false, {options.distance_mm, 1.5 * options.distance_mm}});
    ++views;
    refused += correction ? 0 : 1;
    if (!correction || !correction->needed) return;
    ++corrected;
    bool worsens = false;
    for (const double depth_mm : {1000, 1500, 2000}) {
      worsens |= plane_error(truth, correction->calibration, depth_mm).rms_mm >
                 plane_error(truth, calibration, depth_mm).rms_mm;
    }
    worse += worsens ? 1 : 0;
  }
};

TEST(CorrectCalibration, HardlyEverMakesAGoodRigWorse) {
  Harm harm;
  for (std::uint32_t i = 0; i < 200; ++i) harm.look_at(true_rig(), calibration_of(true_rig()), i);
  std::printf("a good rig: %d views, %d corrections, %d made it worse, %d refused\n", harm.views, harm.corrected,
              harm.worse, harm.refused);
  EXPECT_LE(harm.worse, 1);
  EXPECT_LE(harm.refused, 2);
}

// A calibration of twelve poses has errors of its own.
TEST(CorrectCalibration, HardlyEverMakesAFreshCalibrationWorse) {
  Harm harm;
  for (std::uint32_t session = 0; session < 5; ++session) {
    SightOptions options;
    options.seed = session + 1, options.symbol_shift_px = 0.005;
    const auto outcome = calibrate(see(true_rig(), true_poses(12, session + 1), options), {900, 2400, {}});
    ASSERT_TRUE(outcome) << outcome.error().message;
    for (std::uint32_t i = 0; i < 20; ++i) harm.look_at(true_rig(), outcome->calibration, 1000 * session + i);
  }
  std::printf("fresh calibrations: %d views, %d corrections, %d made it worse, %d refused\n", harm.views,
              harm.corrected, harm.worse, harm.refused);
  EXPECT_LE(harm.worse, 1);
}

}  // namespace
}  // namespace slsd
