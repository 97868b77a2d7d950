// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <filesystem>
#include <string>

#include "core/result.hpp"

namespace slsd {

struct PrintRequest {
  std::filesystem::path file;  ///< .pdf, .svg or .png
  std::string board;           ///< as parse_board() reads it; empty: that which fills the paper
  std::string paper = "A4";    ///< as parse_paper() reads it
  double dpi = 300;            ///< of a PNG, 20 to 2400
};

/// Writes a board for calibrating, to be printed to true scale.
/// @errors of the board, the paper and the file; kImpossible where the board does not fit, kInvalidArgument of another
///         kind of file
/// @thread reentrant
[[nodiscard]] Result<> print_board(const PrintRequest& request);

}  // namespace slsd
