// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "clients/model/build_model.hpp"
#include "clients/model/live_clouds.hpp"
#include "core/result.hpp"

namespace slsd::model {

struct LiveOptions {
  int views = 0;  ///< of a turntable, each scanned at a line of the standard input; 0: the object turns freely
  bool until_closed = false;      ///< ends when the object was seen from all sides
  std::optional<double> seconds;  ///< the longest time
};

/// Tells of each cloud. @param left_out  why it has no place; empty: it has one
using OnCloud = std::function<void(const ModelBuilder&, const SeenSides&, const std::string& left_out)>;

/// Follows an object through the clouds of a running service, and tells what it still has to see.
/// @thread thread-bound
class LiveSession {
 public:
  LiveSession(LiveClouds clouds, const ModelOptions& model, const LiveOptions& options, Tell tell, OnCloud on_cloud);

  /// Leaves out what a cloud of the empty scene shows. @errors as ModelBuilder::set_background()
  [[nodiscard]] Result<> set_background(std::string_view ply) { return builder_.set_background(ply); }
  /// Follows until a limit or the user ends it (Interrupt). @errors of LiveClouds
  [[nodiscard]] Result<> follow();
  [[nodiscard]] std::size_t placed() const { return builder_.placed(); }
  /// Builds the model of the clouds so far. @errors as ModelBuilder::finish()
  [[nodiscard]] Result<Model> finish(const Advance& advance);
  [[nodiscard]] LiveClouds& clouds() { return clouds_; }

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] Result<> follow_object();
  [[nodiscard]] Result<> follow_turntable();
  [[nodiscard]] Result<> scan_view(int view);
  /// @return the sides that were seen so far
  [[nodiscard]] Result<SeenSides> add(const std::optional<std::string>& ply);
  [[nodiscard]] bool enough(const SeenSides& sides) const;
  void say(const std::string& sentence);
  void show_progress(const SeenSides& sides);

  LiveClouds clouds_;
  ModelBuilder builder_;
  LiveOptions options_;
  Tell tell_;
  OnCloud on_cloud_;
  std::string reason_;  // why the latest cloud has no place
  bool input_ended_ = false;
  bool progress_ = false;  // a line of progress is not ended
  int told_ = 0;           // of 12 sectors
  Clock::time_point begin_ = Clock::now();
};

}  // namespace slsd::model
