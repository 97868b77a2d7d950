// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/observe/observe_pose.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "core/calibrate/observe/board_region.hpp"

namespace slsd {
namespace {

constexpr int kWidth = 700, kHeight = 600;
constexpr double kPaper = 0.8, kInk = 0.06;
constexpr double kRoom = 0.08;          // of the projector's light
constexpr double kBehind = 0.02;        // of what the room gives back behind the board
constexpr int kColumns = 8, kRows = 7;  // squares
constexpr double kSquareMm = 40;
constexpr int kSamples = 4;  // across a pixel

/// A chessboard straight before camera and projector, each turned a little.
struct Scene {
  double blur_px = 0.5;  ///< of the camera, besides its pixels' size
  double projector_blur_px = 0.5;
  double black_level = 5;
  /// Of the noise's variance: in the dark, and what each grey level adds; what becomes of light in the camera after it.
  double dark_variance = 0.49, variance_per_level = 0, gamma = 1;
  bool in_dark_room = false;  ///< the sheet ends with the board's white border; the projector lights nothing behind it
  Eigen::Affine2d camera_from_board = Eigen::Translation2d(110, 70) * Eigen::Rotation2Dd(0.08) * Eigen::Scaling(1.6);
  Eigen::Affine2d camera_from_projector =
      Eigen::Translation2d(-60, -40) * Eigen::Rotation2Dd(-0.03) * Eigen::Scaling(1.4);
};

bool is_on_sheet(const Eigen::Vector2d& board_mm) {
  const Eigen::Array2d square = board_mm / kSquareMm;
  return (square > -1).all() && (square < Eigen::Array2d(kColumns + 1, kRows + 1)).all();
}

double reflectance(const Eigen::Vector2d& board_mm) {
  const Eigen::Vector2d square = board_mm / kSquareMm;
  if (square.minCoeff() < 0 || square.x() > kColumns || square.y() > kRows) return kPaper;
  const int both = static_cast<int>(square.x()) + static_cast<int>(square.y());
  return both % 2 == 0 ? kInk : kPaper;
}

Grey8 photograph(const Scene& scene, const Grey8& projected, std::uint32_t seed) {
  Grey8 shown = projected;
  cv::Mat light(shown.height(), shown.width(), CV_8U, shown.data()), image(kHeight, kWidth, CV_64F);
  cv::GaussianBlur(light, light, {}, scene.projector_blur_px);
  const Eigen::Affine2d board = scene.camera_from_board.inverse(), projector = scene.camera_from_projector.inverse();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double sum = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const Eigen::Vector2d at(x + (i % kSamples + 0.5) / kSamples - 0.5, y + (i / kSamples + 0.5) / kSamples - 0.5);
        const Eigen::Vector2d from = projector * at;
        const double column = std::clamp(from.x(), 0.0, shown.width() - 1.001),
                     row = std::clamp(from.y(), 0.0, shown.height() - 1.001);
        const int left = static_cast<int>(column), top = static_cast<int>(row);
        const double right = column - left, below = row - top;
        const double lit = (1 - below) * ((1 - right) * shown.at(left, top) + right * shown.at(left + 1, top)) +
                           below * ((1 - right) * shown.at(left, top + 1) + right * shown.at(left + 1, top + 1));
        const bool behind = scene.in_dark_room && !is_on_sheet(board * at);
        sum += behind ? kBehind : reflectance(board * at) * (lit / 255 + kRoom);
      }
      image.at<double>(y, x) = sum / (kSamples * kSamples);
    }
  }
  cv::GaussianBlur(image, image, {}, scene.blur_px);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  Grey8 photo(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double light = scene.black_level + 230 * image.at<double>(y, x);
      const double sigma = std::sqrt(scene.dark_variance + scene.variance_per_level * light);
      const double level = std::clamp(light + sigma * noise(random), 0., 255.);
      photo.at(x, y) = static_cast<std::uint8_t>(std::round(255 * std::pow(level / 255, scene.gamma)));
    }
  }
  return photo;
}

/// How far symbols whose centres are within half a pitch of an edge of the print are off, towards the ink; and all of
/// them, root mean square of a coordinate, and the mean.
struct Errors {
  std::size_t count = 0, beside = 0;
  double on_ink_px = 0, on_paper_px = 0, all_px = 0;
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();
};

/// Towards the nearest edge of a square, in board coordinates: its direction, and how far it is.
Eigen::Vector2d to_edge(const Eigen::Vector2d& board_mm) {
  const Eigen::Vector2d edge = (board_mm / kSquareMm).array().round() * kSquareMm;
  const Eigen::Vector2d off = edge - board_mm;
  return std::abs(off.x()) < std::abs(off.y()) ? Eigen::Vector2d(off.x(), 0) : Eigen::Vector2d(0, off.y());
}

Errors errors_of(const Scene& scene) {
  const Board board = *parse_board("chessboard:7x6:40");
  const Pattern pattern = *make_pattern({.projector_width_px = 640, .projector_height_px = 480});
  const Grey8 white = photograph(scene, Grey8(640, 480, 255), 1), lit = photograph(scene, draw_pattern(pattern), 2);
  const PosePictures pictures{white.view(), {lit.view()}, std::nullopt};
  BoardSighting sighting;
  auto view = observe_board(pictures, board, sighting);
  EXPECT_TRUE(view) << to_string(view.error());
  PatternReader reader(pattern);
  const auto read = observe_pattern(pictures, board, sighting, reader, *view);
  EXPECT_TRUE(read) << to_string(read.error());
  Errors errors;
  std::size_t on_ink = 0, on_paper = 0;
  for (const ProjectedPoint& symbol : view->symbols) {
    const Eigen::Vector2d truth = scene.camera_from_projector * symbol.projector_px;
    const Eigen::Vector2d off = symbol.camera_px - truth;
    errors.all_px += off.squaredNorm() / 2, errors.mean_px += off;
    ++errors.count;
    const Eigen::Vector2d at = scene.camera_from_board.inverse() * truth;
    const Eigen::Vector2d edge = scene.camera_from_board.linear() * to_edge(at);
    const double near = edge.norm(), half_pitch = 0.5 * 1.4 * pattern.pitch_px();
    const Eigen::Vector2d inside = at / kSquareMm;
    if (near > half_pitch || near < 0.2 * half_pitch) continue;
    if (inside.minCoeff() < 0 || inside.x() > kColumns || inside.y() > kRows) continue;
    const bool ink = reflectance(at) == kInk;
    (ink ? errors.on_ink_px : errors.on_paper_px) += (ink ? -off : off).dot(edge.normalized());
    ++(ink ? on_ink : on_paper);
  }
  errors.all_px = std::sqrt(errors.all_px / static_cast<double>(errors.count));
  errors.mean_px /= static_cast<double>(errors.count);
  errors.on_ink_px /= static_cast<double>(on_ink), errors.on_paper_px /= static_cast<double>(on_paper);
  errors.beside = on_ink + on_paper;
  return errors;
}

// Divided by the white picture and no more, symbols beside an edge of the print lie off towards the ink, by 0.06 to
// 0.2 px.
TEST(ObservePattern, FindsSymbolsBesideAnEdgeOfThePrintWhereTheyAre) {
  for (const double blur_px : {0.4, 0.7, 1.1}) {
    const Errors errors = errors_of({.blur_px = blur_px});
    SCOPED_TRACE(testing::Message() << "blur " << blur_px << " px, " << errors.count << " symbols, " << errors.beside
                                    << " beside an edge: on ink " << errors.on_ink_px << " px, on paper "
                                    << errors.on_paper_px << " px, all " << errors.all_px << " px");
    EXPECT_GT(errors.beside, 150U);
    EXPECT_NEAR(errors.on_ink_px, 0, 0.03);
    EXPECT_NEAR(errors.on_paper_px, 0, 0.03);
    EXPECT_LT(errors.all_px, 0.06);
  }
}

TEST(ObservePattern, FindsThemUnderAnyBlackLevel) {
  for (const double black_level : {0.0, 12.0}) {
    const Errors errors = errors_of({.black_level = black_level});
    SCOPED_TRACE(testing::Message() << "black at " << black_level << ", " << errors.count << " symbols: on ink "
                                    << errors.on_ink_px << " px, on paper " << errors.on_paper_px << " px, all "
                                    << errors.all_px << " px");
    EXPECT_NEAR(errors.on_ink_px, 0, 0.03);
    EXPECT_NEAR(errors.on_paper_px, 0, 0.03);
    EXPECT_LT(errors.all_px, 0.06);
  }
}

// A board that is nearer than the others is less sharp. Did that shift all its symbols by 0.01 px, focal lengths would
// be off by 0.01 %.
TEST(ObservePattern, FindsSymbolsOnTheAverageWhereTheyAreHoweverBlurred) {
  for (const auto& [camera_px, projector_px] : {std::pair(0.4, 0.4), std::pair(0.6, 0.6), std::pair(0.8, 0.9)}) {
    const Errors errors = errors_of({.blur_px = camera_px, .projector_blur_px = projector_px});
    SCOPED_TRACE(testing::Message() << "camera " << camera_px << " px, projector " << projector_px << " px, "
                                    << errors.count << " symbols: " << errors.mean_px.transpose() << " px");
    EXPECT_GT(errors.count, 300U);
    EXPECT_LT(errors.mean_px.cwiseAbs().maxCoeff(), 0.008);
  }
}

// Taken as a part of the pattern, the noise beside the board drowned all of it at a gamma of 0.5.
TEST(ObservePattern, FindsSymbolsOfCamerasWithGammaBeforeADarkRoom) {
  for (const double gamma : {0.45, 0.5, 0.55, 0.6, 0.8, 1.0}) {
    const Errors errors = errors_of(
        {.black_level = 0,
         .dark_variance = 0.5,
         .variance_per_level = 0.094,
         .gamma = gamma,
         .in_dark_room = true,
         .camera_from_board = Eigen::Translation2d(200, 160) * Eigen::Rotation2Dd(0.08) * Eigen::Scaling(0.8),
         .camera_from_projector = Eigen::Translation2d(20, 40) * Eigen::Rotation2Dd(-0.03) * Eigen::Scaling(0.8)});
    SCOPED_TRACE(testing::Message() << "gamma " << gamma << ", " << errors.count << " symbols, " << errors.all_px
                                    << " px");
    EXPECT_GT(errors.count, 350U);
    EXPECT_LT(errors.all_px, 0.25);
  }
}

TEST(FullShareOfPrint, CountsWhatAReflectionLeavesNoPointOf) {
  const Board board = *parse_board("chessboard:7x6:40");
  const Scene scene;
  Grey8 white = photograph(scene, Grey8(640, 480, 255), 1);
  const auto sighting = find_board(white.view(), board);
  ASSERT_TRUE(sighting) << to_string(sighting.error());
  EXPECT_LT(full_share_of_print(white.view(), board, *sighting), 0.01);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if ((scene.camera_from_board.inverse() * Eigen::Vector2d(x, y)).x() < 0.82 * kColumns * kSquareMm)
        white.at(x, y) = 255;
    }
  }
  EXPECT_NEAR(full_share_of_print(white.view(), board, *sighting), 0.82, 0.02);
}

}  // namespace
}  // namespace slsd
