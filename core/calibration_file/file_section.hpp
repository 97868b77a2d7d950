// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/calibration_file/file_tree.hpp"
#include "core/result.hpp"

namespace slsd {

/// A map of a calibration file, read key by key. It keeps the first missing or wrong key as the error; from then on
/// every read gives zeros.
/// @thread thread-bound
class FileSection {
 public:
  /// @param node   must outlive this object
  /// @param path   text before the keys in messages: "cameras[0] (left): ", or empty
  /// @param where  the file's name
  FileSection(const FileNode& node, std::string path, std::string where)
      : node_(node), path_(std::move(path)), where_(std::move(where)) {}

  [[nodiscard]] bool has(const char* key) const;
  [[nodiscard]] double number(const char* key);
  /// A whole number within [low, high].
  [[nodiscard]] int whole(const char* key, int low, int high);
  /// 1 to kMaxTextLength bytes without control characters.
  [[nodiscard]] std::string text(const char* key);
  [[nodiscard]] Eigen::Matrix3d matrix3(const char* key);
  /// Reads `count` numbers in a row or in a column; count is at most 9.
  /// @param hint  follows in the message if the count differs
  [[nodiscard]] Eigen::VectorXd vector(const char* key, int count, const std::string& hint = {});

  /// Records that this key is wrong, unless an earlier key was.
  void refuse(const std::string& key, const std::string& problem);
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }
  void set_path(std::string path) { path_ = std::move(path); }

  static constexpr std::size_t kMaxTextLength = 256;

 private:
  [[nodiscard]] const FileNode* find(const char* key);
  [[nodiscard]] std::vector<double> elements(const char* key, int& rows, int& columns);

  const FileNode& node_;
  std::string path_;
  std::string where_;
  std::optional<Error> error_;
};

}  // namespace slsd
