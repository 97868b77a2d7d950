// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>

#include "drivers/log/log_field.hpp"

namespace slsd {

/// The kind of a log line, as an id that stays the same when texts change. Find lines with `journalctl MESSAGE_ID=...`;
/// systemd/slsd.catalog explains each id.
/// @thread thread-bound, like LogField
class MessageId {
 public:
  explicit MessageId(std::string_view id) : field_("MESSAGE_ID", std::string(id)) {}

  static constexpr std::string_view kReady = "6534f3d961e4478bade71977201baeb6";
  static constexpr std::string_view kDoesNotStart = "c3fd981d3d694073bf5707d84006407a";
  static constexpr std::string_view kReloadRefused = "1d594b45e01c4bd7b9028cf169180f1c";
  static constexpr std::string_view kDeviceLost = "4d5bfa985efe404790a7f9fc62e585d8";
  static constexpr std::string_view kDeviceBack = "04324fc36207479cb53e9d568e9ec55c";
  static constexpr std::string_view kScanFailed = "aa8fd2b94774407b8c04099fd35bb9fd";
  static constexpr std::string_view kScansSucceedAgain = "ef524f38709b4081bbaec6e21729338b";
  static constexpr std::string_view kKnocked = "4e5ac60293ec4966936042b5c3f69600";
  static constexpr std::string_view kCalibratedAgain = "0a43972d56184129b7bf199920f86d58";
  static constexpr std::string_view kOtherHardware = "06a95463198045fc9b98ddefd0f669a0";
  static constexpr std::string_view kClientDropped = "60ee2824ab474af9beae94870643e285";
  static constexpr std::string_view kClientRefused = "f2409a92560c460db8edd9acbbb3e527";
  static constexpr std::string_view kLogDropped = "aa938ec835dc4c28b302cff082de3384";
  static constexpr std::string_view kBundleWritten = "214f95d4483d44b1ba3a4215c68bef6d";

 private:
  LogField field_;
};

}  // namespace slsd
