// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string_view>

namespace slsd {

/// A dictionary of square markers, as OpenCV's aruco module names and holds it.
struct MarkerFamily {
  std::string_view name;
  int opencv_number;  ///< cv::aruco::PREDEFINED_DICTIONARY_NAME
  int bits;           ///< bits to a side, without the black border of one cell
  int count;          ///< number of markers

  /// Cells to a marker's side, its black border with it.
  [[nodiscard]] constexpr int cells() const { return bits + 2; }
};

/// All that there are, of each size the smallest first.
/// @thread reentrant
[[nodiscard]] std::span<const MarkerFamily> marker_families();

/// @return nullptr where there is none of that name; else valid for ever
/// @thread reentrant
[[nodiscard]] const MarkerFamily* find_marker_family(std::string_view name);

/// Tells whether a cell of a marker is black; cell (0, 0) is the top left of its border.
/// @param id      0 to family.count - 1
/// @param column  0 to family.cells() - 1, as is row
/// @thread reentrant
[[nodiscard]] bool is_black(const MarkerFamily& family, int id, int column, int row);

}  // namespace slsd
