// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <vector>

#include "core/image.hpp"
#include "core/result.hpp"

namespace slsd {

/// The pixels of a camera that see the projector turn from black to white, and how bright both look there.
/// @thread reentrant
class FlashPixels {
 public:
  /// Some of a frame's pixels, always the same ones: few enough to cost little, and a copy, so that the frame can go
  /// back to its driver.
  using Samples = std::vector<double>;
  [[nodiscard]] static Samples sample(const GreyView& frame);

  /// @param dark, dark_again  of two frames of black: what differs between them is noise, or somebody walking by
  /// @param lit               of a frame of white
  /// @errors kNotFound: no flash is seen; kMismatch: frames of different sizes
  [[nodiscard]] static Result<FlashPixels> find(const Samples& dark, const Samples& dark_again, const Samples& lit);

  /// How much of the white is there. @param frame  of the same size @return about 0 for black, 1 for white
  [[nodiscard]] double share_of_white(const Samples& frame) const;

  /// Most of the pixels are saturated: a part of the white is enough for all of it, and an onset looks early.
  [[nodiscard]] bool clipped() const { return clipped_; }

 private:
  std::vector<std::size_t> chosen_;  ///< indices in the samples of a frame
  double dark_ = 0;                  ///< sum over them
  double lit_ = 0;
  bool clipped_ = false;
};

}  // namespace slsd
