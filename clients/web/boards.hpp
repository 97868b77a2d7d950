// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace slsd::web {

/// A calibration board that is ready to print.
struct PrintableBoard {
  std::string name;      ///< the file's, without ".pdf"
  std::string board;     ///< what --board takes, such as "charuco:11x7:23:17.25:DICT_5X5_1000"
  double width_mm = 0;   ///< of the paper
  double height_mm = 0;  ///< of the paper
  std::string pdf;       ///< the file's bytes
};

/// Reads the boards of a folder, as slsd --print-board writes them. Leaves out other files.
/// @return the smallest paper first
/// @errors kNotFound: no such folder, or no boards in it
/// @thread reentrant
[[nodiscard]] Result<std::vector<PrintableBoard>> read_boards(const std::filesystem::path& folder);

/// Finds title and paper in the text of a PDF by slsd --print-board.
/// @return without a name; `board` is empty if it is no such file
/// @thread reentrant
[[nodiscard]] PrintableBoard parse_board_pdf(std::string pdf);

}  // namespace slsd::web
