// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "core/geometry/file_syntax.hpp"

namespace slsd {

/// A value of a calibration file, and what is below it.
struct FileNode {
  enum class Kind { kEmpty, kNumber, kText, kNumbers, kMap, kSequence };
  Kind kind = Kind::kEmpty;
  double number = 0;
  std::string text{};
  std::vector<double> numbers{};  ///< NaN for what is none
  std::vector<std::pair<std::string, FileNode>> entries{};
  std::vector<FileNode> items{};

  /// What the key of this map holds; null where it is not there or holds nothing.
  [[nodiscard]] const FileNode* find(std::string_view key) const;
};

/// Reads a calibration file: what syntax_problem() lets through, of OpenCV's YAML.
/// @thread reentrant
[[nodiscard]] tl::expected<FileNode, SyntaxProblem> read_file_tree(std::string_view text);

}  // namespace slsd
