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

/// What in a text OpenCV's YAML reader must not be given: it recurses without bound and reads past a line's end on
/// some of what is not YAML. Nothing where the text may be handed on.
/// @thread reentrant
[[nodiscard]] std::optional<SyntaxProblem> syntax_problem(std::string_view text);

}  // namespace slsd
