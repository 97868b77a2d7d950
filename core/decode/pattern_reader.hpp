// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "core/code/codebook.hpp"
#include "core/decode/centres/symbol_match.hpp"
#include "core/exposure/frame_noise.hpp"
#include "core/exposure/light_levels.hpp"
#include "core/geometry/homography.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// Reads the pattern on one plane, at most a little bent, without any calibration: the scale and the turn of the
/// pattern in the frame are searched for, and what was found in one frame is where the search begins in the next.
/// Without the epipolar line to check a symbol by, some in a thousand are wrong.
/// @thread thread-bound
class PatternReader {
 public:
  explicit PatternReader(IndexedPattern pattern);
  PatternReader(PatternReader&&) noexcept;
  PatternReader& operator=(PatternReader&&) noexcept;
  ~PatternReader();

  /// @param frame  best with the light of the surface divided out
  /// @param noise  of the frame, if it cannot be measured: where light was divided out, it does not follow the level
  /// @return empty where the pattern is not seen
  /// @errors kUnsupported: the frame is too large
  [[nodiscard]] Result<std::vector<SymbolMatch>> read(const GreyView& frame,
                                                      const std::optional<FrameNoise>& noise = std::nullopt);

  [[nodiscard]] const Pattern& pattern() const { return pattern_.pattern(); }
  /// Number of shapes of a symbol's size in the last frame. Many shapes of which none was read show another pattern.
  [[nodiscard]] std::size_t shapes() const { return shapes_; }

 private:
  struct Trial;
  /// A frame, and how many times smaller it is than the one that is read.
  struct Shrunk {
    GreyView frame;
    int factor;
  };
  /// The frame in which symbols of a scale have a size that is quick to read, and no larger than needed to be exact.
  [[nodiscard]] Shrunk frame_for(double scale, const GreyView& frame);
  /// Noise of a shrunk frame, as far as it is known.
  [[nodiscard]] std::optional<FrameNoise> noise_of(const Shrunk& frame) const;
  [[nodiscard]] std::vector<SymbolMatch> attempt(const Homography& camera_from_projector, const GreyView& frame,
                                                 bool is_there);
  [[nodiscard]] std::vector<double> likely_scales(const GreyView& frame);
  [[nodiscard]] std::vector<SymbolMatch> search(const GreyView& frame);
  [[nodiscard]] std::vector<SymbolMatch> refine(std::vector<SymbolMatch> found, const GreyView& frame);

  IndexedPattern pattern_;                                                         // shared with its trials
  std::vector<std::unique_ptr<Trial>> trials_;                                     // one to a scale
  std::optional<Homography> last_;                                                 // camera from projector
  std::map<int, std::variant<Image<std::uint8_t>, Image<std::uint16_t>>> shrunk_;  // of this frame, by their factors
  HeldFullLevel full_level_;
  double full_ = 255;                // of the frame that is read
  std::optional<FrameNoise> noise_;  // the same
  std::size_t shapes_ = 0;
};

}  // namespace slsd
