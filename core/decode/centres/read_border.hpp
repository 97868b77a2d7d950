// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/code/pattern.hpp"
#include "core/decode/centres/align_letters.hpp"
#include "core/decode/grid/link_grid.hpp"
#include "core/decode/grid/sightings.hpp"
#include "core/image.hpp"

namespace slsd {

/// Whether the frame's border cuts or hides the symbol at a place.
/// @param frame     of its surface
/// @param frame_px  width and height
[[nodiscard]] bool is_at_border(const Eigen::Vector2f& centre_px, const LatticeFrame& frame, float symbol_size_px,
                                const Eigen::Vector2f& frame_px);

/// Reads what the frame's border leaves of symbols. They are no points, but say of those beside them whether they are
/// of the pattern where it belongs: the corner of something else that was put there may show the right letter.
/// @thread thread-bound: keeps its buffers; the letters are shared with copies
class BorderReader {
 public:
  BorderReader(const Pattern& pattern, std::shared_ptr<const LetterFields> letters, Rules rules = {});

  /// Refuses what is decoded beside a symbol at the border that is plainly of another letter than its cell's.
  /// @param blur_px  of the pattern in the frame, standard deviation, projector px
  void refuse(const GreyView& frame, float blur_px, Sightings& seen);

 private:
  void sample_letters(float blur_px);
  [[nodiscard]] bool shows_another(const GreyView& frame, const Eigen::Vector2f& centre_px,
                                   const LatticeFrame& lattice_frame, int letter) const;

  CodeArray array_;
  Rules rules_;
  int rows_, columns_;  // of it that are shown whole
  float pitch_px_, size_px_;
  int letter_count_;
  std::shared_ptr<const LetterFields> letters_;
  std::vector<float> expected_;  // how the letters look in this frame, sample by sample
  std::vector<std::int32_t> refused_;
};

}  // namespace slsd
