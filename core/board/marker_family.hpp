// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>
#include <string_view>

namespace slsd {

/// A dictionary of square markers, by its name and number in OpenCV's aruco module.
struct MarkerFamily {
  std::string_view name;
  int opencv_number;  ///< cv::aruco::PREDEFINED_DICTIONARY_NAME
  int bits;           ///< bits along a side, without the black border of one cell
  int count;          ///< number of markers

  /// Cells along a marker's side, including its black border.
  [[nodiscard]] constexpr int cells() const { return bits + 2; }
};

/// All families; for each number of bits, the smallest first.
/// @thread reentrant
[[nodiscard]] std::span<const MarkerFamily> marker_families();

/// @return nullptr if there is none of that name; otherwise always valid
/// @thread reentrant
[[nodiscard]] const MarkerFamily* find_marker_family(std::string_view name);

/// Tells whether a cell of a marker is black; cell (0, 0) is the top left of its border.
/// @param id      0 to family.count - 1
/// @param column  0 to family.cells() - 1, as is row
/// @thread reentrant
[[nodiscard]] bool is_black(const MarkerFamily& family, int id, int column, int row);

}  // namespace slsd
