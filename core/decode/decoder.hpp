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
#include "core/geometry/pixel_ray.hpp"
#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// The symbols of a frame in space: where a dense cloud begins. Stands as long as the decoding.
struct DecodedSymbols {
  const Lattice* lattice;
  std::span<const PixelRay> rays;     ///< one to a symbol: that of its centre
  std::span<const double> depths_mm;  ///< one to a symbol, along the camera's z axis, as triangulated from its centre
  FrameNoise noise;                   ///< noise of the frame
};

/// Reads frames of one camera that see one pattern. Keeps its buffers from frame to frame: nothing is allocated once
/// they have grown to a frame's size.
/// @thread thread-bound: one decoder to a thread
class Decoder {
 public:
  /// Prepares the prototypes and the rays of the pattern's cells.
  /// @param pattern  one for all cameras that see it: what it holds is shared
  /// @errors kMismatch: the calibration's projector is not of the pattern's size; kInvalidArgument; kUnsupported: the
  ///         camera's images are too large
  [[nodiscard]] static Result<Decoder> create(const IndexedPattern& pattern, const Calibration& calibration,
                                              std::size_t camera_index, const DecodeOptions& options);
  /// A decoder of the same for another thread, in a hundredth of the time: it shares what never changes, and its
  /// buffers are as large as these have grown.
  [[nodiscard]] Decoder another() const;

  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;
  ~Decoder();

  [[nodiscard]] std::uint8_t camera_index() const;  ///< index in the calibration

  /// Image to points. The result stands until the next call. Nothing found is an empty result with its counters.
  /// @param full      the level of a saturated pixel: 255, 1023, 65535...; without it as HeldFullLevel has it
  /// @param executor  helps with the stages, and changes nothing of what they give; null: this thread alone
  /// @errors kMismatch: the frame is not of the calibration's size
  [[nodiscard]] Result<const Decoding*> decode(const GreyView& frame, std::optional<double> full = std::nullopt,
                                               StageObserver* observer = nullptr, Executor* executor = nullptr);
  /// Returns the symbols of the last decoded frame.
  [[nodiscard]] DecodedSymbols symbols();

 private:
  struct Parts;
  [[nodiscard]] Result<> check_size(const GreyView& frame) const;
  explicit Decoder(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

/// Decodes a frame, or where there is one in white light too, what is left when that is divided out: print and wood
/// have edges of their own, which then do not count. Where the scene has moved between the two, and the frame by itself
/// gives more points, these: white light costs no point.
/// @errors as Decoder::decode(); kMismatch: the frames are not of one size
/// @thread thread-bound, as the decoder
[[nodiscard]] Result<const Decoding*> decode_in_light(Decoder& decoder, const GreyView& frame, const SceneLight& light,
                                                      StageObserver* observer = nullptr, Executor* executor = nullptr);

}  // namespace slsd
