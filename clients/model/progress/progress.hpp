// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "clients/model/build_model.hpp"
#include "clients/model/progress/preview_points.hpp"
#include "core/result.hpp"

namespace slsd::model {

/// Tells people and other programs how far a model is: sentences on standard error; on request an object of JSON on
/// each line of standard output, and a preview in a file. docs/model.md has the objects.
/// @thread thread-bound
class Progress {
 public:
  /// @param lines    print lines of JSON
  /// @param preview  file of the preview; empty: none
  Progress(bool lines, std::filesystem::path preview) : lines_(lines), file_(std::move(preview)) {}

  void say(const std::string& sentence);
  /// Tells of one more cloud.
  /// @param left_out  why it has no place; empty: it has one
  void add_cloud(const ModelBuilder& builder, const SeenSides& sides, const std::string& left_out);
  /// Tells that clouds are fused. @param done  of them @param clouds  in all; 0: their places are adjusted
  void build(std::size_t done, std::size_t clouds);
  /// Makes the model the preview.
  void finish(const Mesh& mesh);
  /// Prints the last line. @return whether it could be written
  bool report(nlohmann::json report);
  /// @return the exit status
  int fail(const Error& error);

 private:
  void print(const nlohmann::json& line);
  void write_preview(const PreviewPoints& points);

  bool lines_;
  std::filesystem::path file_;
  PreviewPoints points_{60'000};
  std::size_t clouds_ = 0;
  std::size_t added_ = 0;      ///< clouds in points_
  std::size_t previewed_ = 0;  ///< clouds in the file
  std::chrono::steady_clock::time_point next_preview_{};
};

}  // namespace slsd::model
