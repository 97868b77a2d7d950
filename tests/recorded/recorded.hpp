// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "tests/adversary/frames.hpp"

namespace slsd {

/// Frames of one kind: misleading ones (16 or 8 px), or a scene of the corpus.
struct FrameGroup {
  int symbol_size_px = 0;
  adversary::Kind kind = {};
  std::string_view scene;  ///< empty: misleading ones

  [[nodiscard]] std::string name() const;  ///< "16px_slats_1_to_2"
};

/// All whose decoding is recorded, in the order of decoded.txt.
[[nodiscard]] std::vector<FrameGroup> recorded_groups();

/// What the decoder makes of a group: a line to each frame, as decoded.txt has it, that starts with the group's name
/// and tells what became of the regions, how they are linked, which cells were decoded, where, and how exactly.
[[nodiscard]] Result<std::vector<std::string>> record(const FrameGroup& group);

}  // namespace slsd
