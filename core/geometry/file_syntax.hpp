// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace slsd {

struct SyntaxProblem {
  int line;  ///< from 1
  std::string message;
};

/// Whether every line has a form that a calibration file can have, of what OpenCV writes and
/// people change in it.
///
///     %YAML:1.0                       first, then one ---
///     key: value                      value: number, word, "text", !!opencv-matrix, or nothing
///        -                            begins a map of a sequence; a key may follow on the line
///        key: [ 1., 2.5e-3,           a list of numbers, over as many lines as it takes
///            .Nan ]
///     # comment
/// @thread reentrant
[[nodiscard]] std::optional<SyntaxProblem> syntax_problem(std::string_view text);

}  // namespace slsd
