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

/// Reads the pattern on one plane, or on a slightly bent one, without a calibration. It searches for the scale and the
/// rotation of the pattern in the frame, and starts with those of the previous frame. Without the epipolar line as a
/// check, some symbols in a thousand are wrong.
/// @thread thread-bound
class PatternReader {
 public:
  explicit PatternReader(IndexedPattern pattern);
  PatternReader(PatternReader&&) noexcept;
  PatternReader& operator=(PatternReader&&) noexcept;
  ~PatternReader();

  /// @param frame  preferably with the light of the surface divided out
  /// @param noise  noise of the frame if it cannot be measured: after division by the light it no longer follows the
  ///               level
  /// @return empty if the pattern is not seen
  /// @errors kUnsupported: the frame is too large
  [[nodiscard]] Result<std::vector<SymbolMatch>> read(const GreyView& frame,
                                                      const std::optional<FrameNoise>& noise = std::nullopt);

  [[nodiscard]] const Pattern& pattern() const { return pattern_.pattern(); }
  /// Number of shapes of a symbol's size in the last frame. If there are many and none was read, the frame shows
  /// another pattern.
  [[nodiscard]] std::size_t shapes() const { return shapes_; }

 private:
  struct Trial;
  /// A frame, and the factor by which it was shrunk.
  struct Shrunk {
    GreyView frame;
    int factor;
  };
  /// The frame in which symbols of a scale are small enough to read quickly and large enough to be exact.
  [[nodiscard]] Shrunk frame_for(double scale, const GreyView& frame);
  /// Noise of a shrunk frame, if known.
  [[nodiscard]] std::optional<FrameNoise> noise_of(const Shrunk& frame) const;
  [[nodiscard]] std::vector<SymbolMatch> attempt(const Homography& camera_from_projector, const GreyView& frame,
                                                 bool is_there);
  [[nodiscard]] std::vector<double> likely_scales(const GreyView& frame);
  [[nodiscard]] std::vector<SymbolMatch> search(const GreyView& frame);
  [[nodiscard]] std::vector<SymbolMatch> refine(std::vector<SymbolMatch> found, const GreyView& frame);

  IndexedPattern pattern_;                                                         // shared with its trials
  std::vector<std::unique_ptr<Trial>> trials_;                                     // one for each scale
  std::optional<Homography> last_;                                                 // camera from projector, of the last
                                                                                   // frame
  std::map<int, std::variant<Image<std::uint8_t>, Image<std::uint16_t>>> shrunk_;  // shrunk images of this frame, by
                                                                                   // their factors
  HeldFullLevel full_level_;
  double full_ = 255;                // saturated level of the frame that is read
  std::optional<FrameNoise> noise_;  // noise of the frame that is read
  std::size_t shapes_ = 0;
};

}  // namespace slsd
