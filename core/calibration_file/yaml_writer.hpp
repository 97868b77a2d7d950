// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

namespace slsd {

/// Writes the YAML of OpenCV's FileStorage, line by line.
/// @thread thread-bound
class YamlWriter {
 public:
  void begin_sequence(const char* key) { line(std::string(key) + ":"), indent_ += 3; }
  void end_sequence() { indent_ -= 3; }
  void begin_map() { line("-"), indent_ += 3; }
  void end_map() { indent_ -= 3; }

  void write(const char* key, int value);
  void write(const char* key, double value);
  void write(const char* key, const std::string& value);
  void write(const char* key, const Eigen::Ref<const Eigen::MatrixXd>& matrix);
  template <class T>
  void write(const char* key, const std::optional<T>& value) {
    if (value) write(key, *value);
  }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  void line(const std::string& words) { text_ += std::string(indent_, ' ') + words + "\n"; }

  std::string text_ = "%YAML:1.0\n---\n";
  std::size_t indent_ = 0;
};

}  // namespace slsd
