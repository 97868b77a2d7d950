// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace slsd {

/// A camera's observation of a known point: of the board, or a pixel of the projector.
struct BoardPoint {
  Eigen::Vector2d camera_px;  ///< distorted, as observed
  Eigen::Vector2d board_mm;
  bool outlying = false;  ///< ignored, because it contradicts the others
};
struct ProjectedPoint {
  Eigen::Vector2d camera_px;     ///< distorted, as seen
  Eigen::Vector2d projector_px;  ///< distorted; exact
  double sigma_px = 1;           ///< one standard deviation of the camera pixel, up to a common factor
  bool outlying = false;
};

/// One camera's view of one pose of the board.
struct PoseView {
  std::size_t camera = 0;
  std::vector<BoardPoint> corners;
  std::vector<ProjectedPoint> symbols;
  /// Noise of this view's points relative to all, estimated by the adjustment: pictures differ in sharpness and light.
  double corner_noise = 1, symbol_noise = 1;
  double blur_px = 0;              ///< one standard deviation of the blur at the board's edges; 0: unknown
  double clipped_share = 0;        ///< share of the board's saturated pixels
  std::size_t hidden_symbols = 0;  ///< number of unseen symbols in one place on the board where the pattern should be
  bool hidden_clipped = false;     ///< and the white picture is saturated there
  std::optional<Eigen::Vector2d>
      shift_px;  ///< shift of the print from the white picture to the pattern's, if both show the print
};

/// The object in front of the cameras.
enum class PoseSubject {
  kBoard,  ///< the board for the calibration
  kPlane,  ///< the reference plane for the second step: its print counts as exact
};

/// One pose of the board or the plane, seen by one or more cameras at the same time.
struct PoseObservation {
  std::string name;
  std::vector<PoseView> views;
  PoseSubject subject = PoseSubject::kBoard;
};

struct ImageSize {
  int width_px = 0, height_px = 0;
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

struct NamedCamera {
  std::string name;
  ImageSize size;
};

/// All input of a calibration.
struct Observations {
  std::vector<NamedCamera> cameras;
  ImageSize projector;
  std::vector<PoseObservation> poses;

  [[nodiscard]] std::size_t count(PoseSubject subject) const {
    return static_cast<std::size_t>(std::ranges::count(poses, subject, &PoseObservation::subject));
  }
};

}  // namespace slsd
