// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/memory_budget.hpp"

#include <numeric>

namespace slsd {
namespace {

constexpr std::size_t kAlwaysGranted = 20 << 10;  // the longest status, and each error

}  // namespace

bool MemoryBudget::lend(std::size_t bytes) {
  if (bytes > limit_bytes_ || lent_ + bytes > limit_bytes_ / 2 || held_ + bytes > limit_bytes_) return false;
  lent_ += bytes;
  held_ += bytes;
  return true;
}

void MemoryBudget::give_back(std::size_t bytes) {
  lent_ -= bytes;
  held_ -= bytes;
}

MemoryAccount::~MemoryAccount() {
  budget_.held_ -= held();
  if (!user_) return;
  const auto others = budget_.held_by_user_.find(*user_);
  if (others != budget_.held_by_user_.end() && (others->second -= held()) == 0) budget_.held_by_user_.erase(others);
}

std::size_t MemoryAccount::held() const {
  return std::accumulate(parts_.begin(), parts_.end(), std::size_t{0});
}

bool MemoryAccount::resize(Part part, std::size_t bytes) {
  const std::size_t now = parts_[static_cast<std::size_t>(part)];
  if (bytes > now && bytes > kAlwaysGranted) {
    const std::size_t limit = budget_.limit_bytes_;
    if (bytes > limit) return false;  // and the sums below cannot overflow
    const std::size_t mine = (user_ ? budget_.held_by_user_[*user_] : held()) - now + bytes;
    const std::size_t all = budget_.held_ - now + bytes;
    if (all > limit || mine > limit - all) return false;
  }
  set(part, bytes);
  return true;
}

void MemoryAccount::set(Part part, std::size_t bytes) {
  std::size_t& held = parts_[static_cast<std::size_t>(part)];
  budget_.held_ = budget_.held_ - held + bytes;
  if (user_) budget_.held_by_user_[*user_] += bytes - held;
  held = bytes;
}

}  // namespace slsd
