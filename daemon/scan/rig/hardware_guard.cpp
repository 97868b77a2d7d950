// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/rig/hardware_guard.hpp"

#include <spdlog/spdlog.h>

#include "daemon/scan/message_ids.hpp"
#include "daemon/scan/rig/hardware.hpp"

namespace slsd {

Result<> HardwareGuard::check(const std::shared_ptr<ScanSetup>& setup, const Rig& rig) {
  const std::uint64_t openings = rig.openings();
  if (setup_.lock() == setup && openings == openings_) return verdict_;
  setup_ = setup, openings_ = openings;
  verdict_ = setup->calibration ? check_hardware(*setup->calibration, rig.status()) : Result<>();
  if (!verdict_ && setup->other_hardware == OtherHardware::kWarn) {
    const MessageId id(MessageId::kOtherHardware);
    spdlog::warn("{}", to_string(verdict_.error()));
    verdict_ = {};
  }
  return verdict_;
}

}  // namespace slsd
