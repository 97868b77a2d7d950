// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <Eigen/Core>

#include "core/align/pattern_field.hpp"
#include "core/decode/centres/align_letters.hpp"
#include "core/image.hpp"

namespace slsd {

/// Light in a cell where its letter is dark. Print takes light from a symbol and gives none; an edge in depth puts a
/// part of another letter there.
/// @thread reentrant
class OtherLight {
 public:
  /// @param field     the letters, as blurred as the frame
  /// @param pitch_px  of the pattern's cells, projector px
  OtherLight(const GreyView& frame, const LetterFields& letters, const PatternField& field, float pitch_px)
      : frame_(frame), letters_(letters), field_(field), pitch_px_(pitch_px) {}

  /// A cell in the camera.
  struct Place {
    Eigen::Vector2f centre_px;
    Eigen::Matrix2f frame;   ///< camera px for one projector px
    float background, peak;  ///< grey levels of what lies beside it
  };
  /// The share of the cell that is lit though the letter is dark there; below 0 if the frame does not show all of it.
  [[nodiscard]] float share(int letter, const Place& place) const;

 private:
  const GreyView& frame_;
  const LetterFields& letters_;
  const PatternField& field_;
  float pitch_px_;
};

}  // namespace slsd
