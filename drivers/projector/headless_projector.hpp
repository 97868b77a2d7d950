// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/projector/projector.hpp"

namespace slsd {

/// The keys of the [projector] table that a headless projector reads.
struct HeadlessProjectorOptions {
  int width_px = 1280;                            ///< 1 to 16384
  int height_px = 800;                            ///< 1 to 16384
  double refresh_hz = 60.0;                       ///< 1 to 1000
  std::vector<std::uint64_t> disconnect_at = {};  ///< at which calls of show(), counted from 1, it is found unplugged

  [[nodiscard]] Result<> validate() const;
};

/// A projector that nobody sees: keeps the image, keeps the time of its refreshes.
/// @thread thread-bound
class HeadlessProjector final : public Projector {
 public:
  explicit HeadlessProjector(HeadlessProjectorOptions options);

  [[nodiscard]] const ProjectorDescription& description() const override { return description_; }
  [[nodiscard]] Result<> open() override;
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image) override;
  [[nodiscard]] Result<Grey8> read_back() override;

  /// Pulls the plug: every call but open() gives kDisconnected from now on.
  void disconnect() { shown_.reset(); }

 private:
  [[nodiscard]] Result<> check_connected() const;
  [[nodiscard]] MonotonicTime next_refresh(MonotonicTime after) const;

  HeadlessProjectorOptions options_;
  ProjectorDescription description_;
  std::optional<Grey8> shown_;  ///< empty while it is not connected
  MonotonicTime first_refresh_;
  std::uint64_t shows_ = 0;
};

}  // namespace slsd
