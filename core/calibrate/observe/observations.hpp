// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace slsd {

/// A camera's observation of a known thing: a point of the board or a pixel of the projector.
struct BoardPoint {
  Eigen::Vector2d camera_px;  ///< distorted, as seen
  Eigen::Vector2d board_mm;
  bool outlying = false;  ///< left out, as it lies off the others
};
struct ProjectedPoint {
  Eigen::Vector2d camera_px;     ///< distorted, as seen
  Eigen::Vector2d projector_px;  ///< distorted; exact
  double sigma_px = 1;           ///< one standard deviation of the camera pixel, up to a factor common to all
  bool outlying = false;
};

/// One camera's look at one pose of the board.
struct PoseView {
  std::size_t camera = 0;
  std::vector<BoardPoint> corners;
  std::vector<ProjectedPoint> symbols;
  /// Noise of this view's points over that of all, as the adjustment finds it: pictures differ in sharpness and light.
  double corner_noise = 1, symbol_noise = 1;
  double blur_px = 0;              ///< one standard deviation of the blur at the board's edges; 0: not known
  double clipped_share = 0;        ///< share of the board's pixels at full level
  std::size_t hidden_symbols = 0;  ///< unseen symbols in one place on the board, where the pattern should be
  bool hidden_clipped = false;     ///< and the white picture is at full level there
  std::optional<Eigen::Vector2d>
      shift_px;  ///< shift of the print from the white picture to the pattern's, if both show it
};

/// The subject that is shown to the cameras.
enum class PoseSubject {
  kBoard,  ///< the board that is calibrated by
  kPlane,  ///< the reference plane, for the second step: its print is taken for true
};

/// One pose of the board or the plane, seen by one camera or more at the same time.
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

/// All that is calibrated from.
struct Observations {
  std::vector<NamedCamera> cameras;
  ImageSize projector;
  std::vector<PoseObservation> poses;

  [[nodiscard]] std::size_t count(PoseSubject subject) const {
    return static_cast<std::size_t>(std::ranges::count(poses, subject, &PoseObservation::subject));
  }
};

}  // namespace slsd
