// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/cloud/shade_points.hpp"
#include "core/code/codebook.hpp"
#include "core/decode/decoding.hpp"
#include "core/decode/lattice.hpp"
#include "core/decode/options.hpp"
#include "core/executor.hpp"
#include "core/exposure/frame_noise.hpp"
#include "core/geometry/calibration.hpp"
#include "core/geometry/measured_box.hpp"
#include "core/geometry/pixel_ray.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// The symbols of a frame in space, from which a dense cloud starts. Valid as long as the decoding.
struct DecodedSymbols {
  const Lattice* lattice;
  std::span<const PixelRay> rays;     ///< one for each symbol: the ray of its centre
  std::span<const double> depths_mm;  ///< one for each symbol, along the camera's z axis, as triangulated from its
                                      ///< centre
  FrameNoise noise;                   ///< noise of the frame
};

/// Decodes frames of one camera that sees one pattern. Keeps its buffers from frame to frame, and allocates nothing
/// once they have grown to a frame's size.
/// @thread thread-bound: one decoder to a thread
class Decoder {
 public:
  /// Prepares the prototypes and the rays of the pattern's cells.
  /// @param pattern  one for all cameras that see it, which share its contents
  /// @param earlier  shares its prototypes if its symbols and scale are the same, and may be at work; null: none
  /// @errors kMismatch: the calibration's projector differs in size from the pattern; kInvalidArgument; kUnsupported:
  ///         the camera's images are too large
  [[nodiscard]] static Result<Decoder> create(const IndexedPattern& pattern, const Calibration& calibration,
                                              std::size_t camera_index, const DecodeOptions& options,
                                              const Decoder* earlier = nullptr);
  /// Makes an equal decoder for another thread, in a hundredth of the time. It shares constant data, and its buffers
  /// start at the size of these.
  [[nodiscard]] Decoder another() const;

  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;
  ~Decoder();

  [[nodiscard]] std::uint8_t camera_index() const;  ///< index in the calibration

  /// Limits decoding to these pixels of the frame, with some cells around them as evidence; empty: all of them. The
  /// look of symbols is measured there, so that points differ from those of the whole frame by a part of their noise.
  /// Symbols further away have no regions.
  void set_part(const std::optional<PixelRectangle>& part);

  /// Decodes an image to points. The result is valid until the next call. If nothing is found, the result is empty,
  /// with its counters.
  /// @param full      the level of a saturated pixel: 255, 1023, 65535...; if missing, HeldFullLevel estimates it
  /// @param executor  helps with the stages without changing their results; null: this thread alone
  /// @errors kMismatch: the frame's size differs from the calibration's
  [[nodiscard]] Result<const Decoding*> decode(const GreyView& frame, std::optional<double> full = std::nullopt,
                                               StageObserver* observer = nullptr, Executor* executor = nullptr);
  /// Returns the symbols of the last decoded frame.
  [[nodiscard]] DecodedSymbols symbols(Executor& executor);
  [[nodiscard]] DecodedSymbols symbols() {
    SerialExecutor alone;
    return symbols(alone);
  }

 private:
  struct Parts;
  [[nodiscard]] Result<> check_size(const GreyView& frame) const;
  explicit Decoder(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

/// Decodes a frame. If there is also a frame in white light, it divides that light out first, which removes the edges
/// of print and wood. If the scene moved between the two frames, and the frame alone gives more points, that result
/// counts: the white frame never costs points.
/// @errors as Decoder::decode(); kMismatch: the frames differ in size
/// @thread thread-bound, like the decoder
[[nodiscard]] Result<const Decoding*> decode_in_light(Decoder& decoder, const GreyView& frame, const SceneLight& light,
                                                      StageObserver* observer = nullptr, Executor* executor = nullptr);

}  // namespace slsd
