// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <linux/videodev2.h>
#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "tests/doubles/v4l2/double_options.hpp"

namespace slsd::test {

/// The double's controls. Each call gives 0 or errno. A manual control is inactive while its automatic one is on.
/// @thread thread-bound
class DoubleControls {
 public:
  explicit DoubleControls(std::vector<DoubleControl> controls) : controls_(std::move(controls)) {}

  int query(v4l2_queryctrl& query) const;
  int query_menu(v4l2_querymenu& query) const;
  int query_extended(v4l2_query_ext_ctrl& query) const;
  int get(v4l2_control& control) const;
  int set(const v4l2_control& control);
  /// @param caller  in whose memory the array lies
  int get_extended(v4l2_ext_controls& controls, pid_t caller) const;
  int set_extended(v4l2_ext_controls& controls, pid_t caller);

  [[nodiscard]] std::optional<int> value(std::uint32_t id) const;
  /// It then says that it took a value and keeps the one before.
  void refuse(std::uint32_t id) { refused_.push_back(id); }

 private:
  [[nodiscard]] const DoubleControl* find(std::uint32_t id) const;
  [[nodiscard]] bool is_inactive(std::uint32_t id) const;

  std::vector<DoubleControl> controls_;
  std::vector<std::uint32_t> refused_;
};

}  // namespace slsd::test
