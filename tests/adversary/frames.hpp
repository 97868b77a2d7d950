// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/cloud.hpp"
#include "core/code/pattern.hpp"
#include "core/geometry/calibration.hpp"
#include "core/image.hpp"
#include "tests/adversary/random_numbers.hpp"

namespace slsd::adversary {

/// Kinds of frames that are made to mislead the decoder.
enum class Kind : std::uint8_t {
  kSlats1,         ///< horizontal slats one symbol high at random depths
  kSlats1to2,      ///< of 1 to 2 symbols
  kSlats2,         ///< of 2 symbols
  kSlats3to6,      ///< of 3 to 6 symbols
  kShelves,        ///< boards of 1 to 2 symbols before a wall that shows 2 to 8 symbols between them
  kPickets,        ///< upright pickets, 1 to 6 symbols wide
  kForeign,        ///< another array of the same letters
  kForeignBeside,  ///< the true pattern on one part, another array beside it
  kRandom,         ///< letters at random
  kRandomBeside,   ///< beside the true pattern
  kMirrored,       ///< the pattern in a mirror, with its symbols or without
  kMutated,        ///< 5 to 40 % of the letters changed
  kTiled,          ///< a part of the pattern, 2 to 14 cells wide and high, over and over
  kShiftedRows,    ///< bands of 1 to 3 rows shifted by some columns each
  kSwappedPatch,   ///< two parts of the pattern, 1 to 10 cells wide and high, swapped
  kTwoProjectors,  ///< the light of a second projector with another array beside and over the first
  kTwoAlike,       ///< the light of a second projector with the same pattern
};
inline constexpr int kKinds = 17;
[[nodiscard]] std::string_view to_string(Kind kind);

/// Letters as a projector shows them on the places of the pattern, and of which cell each is the light.
struct Shown {
  int rows = 0, columns = 0;
  std::vector<std::int8_t> letters;                 ///< row by row; -1: none of the pattern's
  std::vector<std::array<std::int16_t, 2>> source;  ///< row and column of the cell; -1: of none

  [[nodiscard]] int index(int row, int column) const { return row * columns + column; }
  [[nodiscard]] bool contains(int row, int column) const {
    return row >= 0 && column >= 0 && row < rows && column < columns;
  }
};

/// A projector's light: what it shows, and where the camera sees it.
struct Light {
  Shown shown;
  Grey8 image;
  /// Projector px from camera px, homogeneous: one to a surface.
  std::vector<Eigen::Matrix3f> projector_from_camera;
};

struct Verdict {
  int right = 0;  ///< points whose cell is the one whose light is there
  int wrong = 0;
  /// Points of a light that is the pattern's over five by five places around, all of them where they could be by their
  /// epipolar lines: as if that part of the pattern were on another surface. No decoder can tell.
  int undecidable = 0;
  int visible = 0;  ///< places of the first projector whose light is a cell's and that the camera sees whole
  std::vector<CloudPoint> wrong_points;
};

/// A frame and what is known of it.
struct Frame {
  Grey8 image;
  std::vector<Light> lights;
  Image<std::uint8_t> surface;  ///< at each pixel; kNoSurface: dark

  static constexpr std::uint8_t kNoSurface = 255;
};

/// Draws such frames: a part of the camera of paper_rig(), in some ten milliseconds each.
/// @thread thread-bound: keeps its buffers
class FrameMaker {
 public:
  /// @param foreign  another array of the same letters and size
  FrameMaker(const Pattern& pattern, CodeArray foreign);

  /// The same kind and number give the same frame on every machine.
  [[nodiscard]] Frame make(Kind kind, std::uint32_t number);

  /// Compares a frame's points with what was drawn.
  /// @param tolerance_px  how far off its epipolar line a symbol may be that no decoder can tell from a right one
  [[nodiscard]] Verdict judge(const Frame& frame, const std::vector<CloudPoint>& points, double tolerance_px) const;

  /// Projector px from camera px, homogeneous, of the plane normal . X = distance in the camera's frame.
  [[nodiscard]] Eigen::Matrix3f seen_on_plane(const Eigen::Vector3d& normal, double distance_mm) const;

  /// Whose camera has 800x600 pixels.
  [[nodiscard]] const Calibration& calibration() const { return rig_; }
  [[nodiscard]] const Pattern& pattern() const { return pattern_; }

 private:
  [[nodiscard]] Shown true_letters() const;
  [[nodiscard]] Shown letters_of(Kind kind, Random& random) const;
  void lay_surfaces(Kind kind, Random& random, Frame& frame) const;
  void add_second_projector(Kind kind, Random& random, Frame& frame) const;
  [[nodiscard]] Grey8 draw(const Shown& shown, bool mirrored) const;
  void expose(Random& random, Frame& frame);
  [[nodiscard]] bool is_side_alike(const Light& light, int surface, int row, int column, const CloudPoint& point) const;
  [[nodiscard]] bool undecidable(const Frame& frame, const Light& light, int surface, int row, int column,
                                 const CloudPoint& point, double tolerance_px) const;

  Pattern pattern_;
  CodeArray foreign_;
  Calibration rig_;
  std::vector<Grey8> glyphs_;
  std::vector<float> noise_;
};

}  // namespace slsd::adversary
