// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/projector/light_curve.hpp"
#include "drivers/projector/projector.hpp"

namespace slsd {

/// The keys of the [projector] table for a headless projector.
struct HeadlessProjectorOptions {
  int width_px = 1280;  ///< 1 to 16384
  int height_px = 800;  ///< 1 to 16384
  LightOptions light = {};
  double refresh_hz = 60.0;                       ///< 1 to 1000
  std::vector<std::uint64_t> disconnect_at = {};  ///< numbers of the images, from 1, at which it seems unplugged

  [[nodiscard]] Result<> validate() const;
};

/// A projector without a screen. Keeps the image in memory as a monitor would receive it, and times its refreshes.
/// @thread one at a time
class HeadlessProjector final : public Projector {
 public:
  explicit HeadlessProjector(HeadlessProjectorOptions options);

  [[nodiscard]] const ProjectorDescription& description() const override { return description_; }
  [[nodiscard]] Result<> open(MonotonicTime deadline) override;
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image, MonotonicTime deadline) override;
  [[nodiscard]] Result<> check(MonotonicTime deadline) override;
  [[nodiscard]] std::vector<std::string> warnings() const override { return {}; }
  [[nodiscard]] Result<Grey8> read_back() override;

  /// Simulates an unplugged cable: from now on every call except open() gives kDisconnected.
  void disconnect() { connected_ = false; }

 private:
  [[nodiscard]] Result<> begin(const Grey8& image);
  [[nodiscard]] std::chrono::nanoseconds period() const;
  [[nodiscard]] MonotonicTime next_refresh(MonotonicTime after) const;

  HeadlessProjectorOptions options_;
  ProjectorDescription description_;
  bool connected_ = false;
  MonotonicTime first_refresh_;
  Grey8 showing_, light_;                  // the requested image, and the values that a monitor would receive for it
  std::optional<MonotonicTime> complete_;  ///< end of the first refresh with the image, until show() has reported it
  std::uint64_t shows_ = 0;
};

}  // namespace slsd
