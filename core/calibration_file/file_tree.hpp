// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

namespace slsd {

/// A value of a calibration file, with its children.
struct FileNode {
  enum class Kind { kEmpty, kNumber, kText, kMap, kSequence };
  Kind kind = Kind::kEmpty;
  double number = 0;
  std::string text{};
  std::vector<std::pair<std::string, FileNode>> entries{};
  std::vector<FileNode> items{};

  /// Value of this map's key; null if the key is missing or empty.
  [[nodiscard]] const FileNode* find(std::string_view key) const;
};

struct SyntaxProblem {
  int line;  ///< first line is 1
  std::string message;
};

/// Reads the first document of a YAML file, with or without OpenCV's header `%YAML:1.0`. Ignores tags. Bounded: rejects
/// files with too many values, or with deep or repeated ones.
/// @thread reentrant
[[nodiscard]] tl::expected<FileNode, SyntaxProblem> read_file_tree(std::string_view text);

}  // namespace slsd
