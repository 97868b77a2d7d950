// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "core/board/board.hpp"
#include "core/board/board_ink.hpp"
#include "programs/calibrate/session/pose_source.hpp"
#include "programs/latency/timepiece.hpp"

namespace slsd {

/// How somebody holds the board: its middle in the camera's frame, tilted about the camera's x and y.
struct HeldBoard {
  Eigen::Vector3d middle_mm{0, 0, 650};
  double tilt_x_rad = 0, tilt_y_rad = 0;

  friend bool operator==(const HeldBoard&, const HeldBoard&) = default;
};

/// A projector and cameras that see a board as somebody holds it, in a time that passes only with pictures and pauses.
/// All cameras stand in one place; without distortion.
class BoardStage final : public PoseSource {
 public:
  /// Where the board is at the next picture; nothing: out of view.
  std::function<std::optional<HeldBoard>(const BoardStage&)> operate;
  std::function<bool(const BoardStage&)> lost = [](const auto&) { return false; };  ///< whether the cameras are
  std::function<bool(std::size_t camera)> blind = [](std::size_t) { return false; };
  double exposure = 1;
  std::chrono::milliseconds frame{100};
  int samples = 2;  ///< of a pixel, each way

  BoardStage(const Board& board, const ImageSize& projector, std::vector<std::string> cameras = {"left"});

  [[nodiscard]] const std::vector<std::string>& cameras() const override { return cameras_; }
  [[nodiscard]] ImageSize projector() const override { return projector_; }
  void show(const Grey8& image) override { shown_ = image; }
  [[nodiscard]] Result<std::vector<GreyImage>> grab() override;

  [[nodiscard]] Timepiece timepiece();
  [[nodiscard]] std::chrono::nanoseconds passed() const { return now_ - MonotonicTime{}; }
  [[nodiscard]] int pictures() const { return pictures_; }
  /// Of those pictures, the ones under something else than white.
  [[nodiscard]] int coded() const { return coded_; }

  /// Projector pixel from camera pixel on the board.
  [[nodiscard]] Eigen::Matrix3d projector_from_camera(const HeldBoard& held) const;

 private:
  [[nodiscard]] Eigen::Matrix3d camera_from_board(const HeldBoard& held) const;
  [[nodiscard]] Eigen::Matrix3d projector_from_board(const HeldBoard& held) const;
  [[nodiscard]] double reflectance(const Eigen::Vector2d& board_mm) const;
  [[nodiscard]] Grey8 photograph(const std::optional<HeldBoard>& held) const;
  [[nodiscard]] const Grey8& look(const std::optional<HeldBoard>& held);

  Board board_;
  Eigen::Vector2d half_board_mm_;
  Grey8 ink_;  ///< of the board, at some pixels to a millimetre
  ImageSize projector_;
  std::vector<std::string> cameras_;
  Grey8 shown_;
  MonotonicTime now_{};
  int pictures_ = 0, coded_ = 0;
  /// The last picture, and of what: most are of the same.
  struct Memory {
    std::optional<HeldBoard> held;
    Grey8 shown, picture;
  };
  std::optional<Memory> memory_;
};

}  // namespace slsd
