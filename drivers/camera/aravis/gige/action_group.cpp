// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/gige/action_group.hpp"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "drivers/camera/aravis/gige/gige_discovery.hpp"

namespace slsd {
namespace {

// Covers the time between the members' threads; a longer wait would delay a single camera.
constexpr std::chrono::milliseconds kWindow{5};

}  // namespace

std::shared_ptr<ActionGroup> ActionGroup::of(const ActionKeys& keys) {
  static std::mutex mutex;
  static std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, std::weak_ptr<ActionGroup>> groups;
  const std::lock_guard lock(mutex);
  std::weak_ptr<ActionGroup>& known = groups[{keys.device_key, keys.group_key, keys.group_mask}];
  auto group = known.lock();
  if (!group) known = group = std::make_shared<ActionGroup>(keys);
  return group;
}

ActionGroup::Member::Member(std::shared_ptr<ActionGroup> group, std::string address, std::string interface)
    : group_(std::move(group)), address_(std::move(address)), interface_(std::move(interface)) {
  const std::lock_guard lock(group_->mutex_);
  group_->members_.push_back(this);
}

ActionGroup::Member::~Member() {
  const std::lock_guard lock(group_->mutex_);
  std::erase(group_->members_, this);
}

void ActionGroup::Member::trigger(const ActionTime& time) {
  ActionGroup& group = *group_;
  std::unique_lock lock(group.mutex_);
  asks_ = &time;
  const std::uint64_t before = group.commands_;
  const auto sent = [&] { return group.commands_ != before; };
  if (!group.all_ask()) group.changed_.wait_for(lock, kWindow, sent);
  if (!sent()) group.send();
}

bool ActionGroup::all_ask() const {
  return std::ranges::all_of(members_, [](const Member* member) { return member->asks_ != nullptr; });
}

std::optional<std::uint64_t> ActionGroup::time() const {
  std::uint64_t latest = 0;
  for (const Member* member : members_) {
    if (member->asks_ == nullptr) continue;
    const auto time = (*member->asks_)();
    if (!time) return std::nullopt;
    latest = std::max(latest, *time);
  }
  return latest;
}

// Sends to each device separately, because routers forward no broadcasts. Members that did not ask expose too, and
// ignore the frame.
void ActionGroup::send() {
  const auto ticks = time();
  for (Member* member : members_) {
    send_gige_action(member->address_, member->interface_, keys_, ticks);
    member->asks_ = nullptr;
  }
  ++commands_;
  changed_.notify_all();
}

}  // namespace slsd
