// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/decode/decoder.hpp"
#include "core/image.hpp"
#include "tests/adversary/frames.hpp"

namespace slsd::adversary {

/// A line of the report: the frames of one kind, or of several.
struct Row {
  int frames = 0, frames_wrong = 0, wrong = 0, undecidable = 0, right = 0;
  int decoded = 0, visible = 0;     ///< of the symbols that the camera sees whole
  std::optional<int> in_the_air{};  ///< not counted on flat surfaces

  void add(const Row& other);
};

/// Which frames are drawn, and what is told of them.
struct ReportOptions {
  int frames_of_a_kind = 1;
  int first = 0;       ///< number of each kind's first frame: those of another number are other frames
  int only_kind = -1;  ///< below 0: all kinds
  bool kept_out = false;
  double wrong_cells_max = DecodeOptions().wrong_cells_max;
  bool margins = false;  ///< counts points by margin
  bool clean = false;    ///< scenes in the best of light
  bool single = false;   ///< tells why a single frame's regions gave no point
  const char* picture = nullptr;
  std::vector<std::string> patterns{};  ///< files of the patterns that are shown; none: the default at 16 and 8 px
};

/// Number of a scene kind among all kinds: those on the grid come first.
[[nodiscard]] constexpr int number_of_scene_kind(int index) {
  return kKinds + index;
}

/// The kinds that these options draw; of scenes their indices in scene_kinds().
[[nodiscard]] std::vector<Kind> drawn_grid_kinds(const ReportOptions& options);
[[nodiscard]] std::vector<int> drawn_scene_kinds(const ReportOptions& options);

void print_heading();
void print(std::string_view name, const Row& row);

/// Tells what became of a frame: its wrong points, and what the options ask for.
void tell(const ReportOptions& options, int kind, int number, const Grey8& image, const Decoding& decoding,
          const std::vector<CloudPoint>& wrong_points);

}  // namespace slsd::adversary
