// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>

struct _XDisplay;

namespace slsd {

/// Keeps the monitors of an X server lit (DPMS off) for as long as it lives; then power saving is as it was.
/// @thread thread-bound
class StayAwake {
 public:
  /// @param display  outlives it
  [[nodiscard]] static std::unique_ptr<StayAwake> begin(_XDisplay* display);
  ~StayAwake();
  StayAwake(const StayAwake&) = delete;
  StayAwake& operator=(const StayAwake&) = delete;

 private:
  StayAwake(_XDisplay* display, bool was_enabled) : display_(display), was_enabled_(was_enabled) {}

  _XDisplay* display_;
  bool was_enabled_;
};

}  // namespace slsd
