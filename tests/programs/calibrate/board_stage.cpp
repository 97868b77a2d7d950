// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/programs/calibrate/board_stage.hpp"

#include <algorithm>
#include <cmath>

namespace slsd {
namespace {

constexpr int kWidth = 960, kHeight = 720;
constexpr double kInkPerMm = 4;
constexpr double kBorderMm = 25;
constexpr double kPaper = 1, kInk = 0.25, kWall = 0.4;
constexpr double kAmbient = 12, kLight = 190;  // levels

Eigen::Matrix3d lens(double focal_px, const ImageSize& size) {
  Eigen::Matrix3d matrix;
  matrix << focal_px, 0, 0.5 * (size.width_px - 1), 0, focal_px, 0.5 * (size.height_px - 1), 0, 0, 1;
  return matrix;
}

/// The plane of the board: x, y, 1 to the camera's frame.
Eigen::Matrix3d plane(const HeldBoard& held, const Board& board) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(held.tilt_y_rad, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(held.tilt_x_rad, Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  const Eigen::Vector3d half(0.5 * board.width_mm(), 0.5 * board.height_mm(), 0);
  Eigen::Matrix3d camera_from_plane;
  camera_from_plane << turn.col(0), turn.col(1), held.middle_mm - turn * half;
  return camera_from_plane;
}

Grey8 print(const Board& board) {
  Grey8 ink(static_cast<int>(board.width_mm() * kInkPerMm), static_cast<int>(board.height_mm() * kInkPerMm), 0);
  const auto pixel = [](double mm) { return static_cast<int>(std::lround(mm * kInkPerMm)); };
  for (const InkRectangle& black : ink_of(board).rectangles) {
    for (int y = pixel(black.y_mm); y < std::min(ink.height(), pixel(black.y_mm + black.height_mm)); ++y) {
      for (int x = pixel(black.x_mm); x < std::min(ink.width(), pixel(black.x_mm + black.width_mm)); ++x) {
        ink.at(x, y) = 1;
      }
    }
  }
  return ink;
}

}  // namespace

BoardStage::BoardStage(const Board& board, const ImageSize& projector, std::vector<std::string> cameras)
    : board_(board),
      half_board_mm_(0.5 * board.width_mm(), 0.5 * board.height_mm()),
      ink_(print(board)),
      projector_(projector),
      cameras_(std::move(cameras)),
      shown_(projector.width_px, projector.height_px) {}

Timepiece BoardStage::timepiece() {
  return {[this] { return now_; }, [this](std::chrono::nanoseconds time) { now_ += time; }};
}

Result<std::vector<GreyImage>> BoardStage::grab() {
  now_ += frame;
  ++pictures_;
  if (lost(*this)) return fail(ErrorCode::kTimeout, "the camera is not ready", "camera " + cameras_.front());
  const std::optional<HeldBoard> held = operate(*this);
  if (std::any_of(shown_.data(), shown_.data() + shown_.size(), [](auto level) { return level < 255; })) ++coded_;
  std::vector<GreyImage> pictures;
  for (std::size_t i = 0; i < cameras_.size(); ++i) pictures.emplace_back(look(blind(i) ? std::nullopt : held));
  return pictures;
}

const Grey8& BoardStage::look(const std::optional<HeldBoard>& held) {
  if (!memory_ || memory_->held != held || memory_->shown != shown_) memory_ = Memory{held, shown_, photograph(held)};
  return memory_->picture;
}

Eigen::Matrix3d BoardStage::camera_from_board(const HeldBoard& held) const {
  return lens(1100, {kWidth, kHeight}) * plane(held, board_);
}

Eigen::Matrix3d BoardStage::projector_from_board(const HeldBoard& held) const {
  const Eigen::Vector3d place(150, 0, 0);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(std::atan2(150, 650), Eigen::Vector3d::UnitY()).toRotationMatrix();
  Eigen::Matrix3d points = plane(held, board_);
  points.col(2) -= place;
  return lens(1.17 * projector_.width_px, projector_) * turn * points;
}

Eigen::Matrix3d BoardStage::projector_from_camera(const HeldBoard& held) const {
  return projector_from_board(held) * camera_from_board(held).inverse();
}

double BoardStage::reflectance(const Eigen::Vector2d& board_mm) const {
  const int x = static_cast<int>(std::floor(board_mm.x() * kInkPerMm)),
            y = static_cast<int>(std::floor(board_mm.y() * kInkPerMm));
  if (ink_.view().contains(x, y)) return ink_.at(x, y) != 0 ? kInk : kPaper;
  const Eigen::Array2d over = (board_mm - half_board_mm_).array().abs() - half_board_mm_.array();
  return over.maxCoeff() < kBorderMm ? kPaper : kWall;
}

/// What is beside the board lies on its plane; where there is none, a wall.
Grey8 BoardStage::photograph(const std::optional<HeldBoard>& held) const {
  const HeldBoard place = held.value_or(HeldBoard{});
  const Eigen::Matrix3d board_from_camera = camera_from_board(place).inverse(),
                        projector_from_camera_px = projector_from_camera(place);
  const auto level = [&](const Eigen::Vector2d& pixel) {
    const double surface = held ? reflectance((board_from_camera * pixel.homogeneous()).hnormalized()) : kWall;
    const Eigen::Vector2d lit = (projector_from_camera_px * pixel.homogeneous()).hnormalized();
    const int u = static_cast<int>(std::lround(lit.x())), v = static_cast<int>(std::lround(lit.y()));
    const double light = shown_.view().contains(u, v) ? shown_.at(u, v) / 255.0 : 0;
    return exposure * surface * (kAmbient + kLight * light);
  };
  Grey8 picture(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double sum = 0;
      for (int i = 0; i < samples * samples; ++i) {
        const Eigen::Vector2d within(i % samples + 0.5, i / samples + 0.5);
        sum += level(Eigen::Vector2d(x - 0.5, y - 0.5) + within / samples);
      }
      picture.at(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(sum / (samples * samples)), 0L, 255L));
    }
  }
  return picture;
}

}  // namespace slsd
