// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "endpoints.hpp"

#include <algorithm>

#include "messages.hpp"

namespace slsd::dds {

using namespace std::chrono_literals;

bool is_ros_name(const std::string& name) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return !name.empty() && letter(name[0]) &&
         std::all_of(name.begin(), name.end(), [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '_'; });
}

Result<Trigger> Trigger::open(const Network& network, const std::string& name) {
  const auto topic = network.reader(ros::Empty::kType, "rt/" + name + "/trigger", Quality::kService);
  const auto requests = network.reader(ros::TriggerRequest::kType, "rq/" + name + "/triggerRequest", Quality::kService);
  const auto replies = network.writer(ros::TriggerResponse::kType, "rr/" + name + "/triggerReply", Quality::kService);
  if (!topic || !requests) return tl::unexpected((topic ? requests : topic).error());
  if (!replies) return tl::unexpected(replies.error());
  Trigger trigger;
  trigger.network_ = &network;
  trigger.topic_ = *topic, trigger.requests_ = *requests, trigger.replies_ = *replies;
  return trigger;
}

void Trigger::answer(const Scan& scan) const {
  if (!network_->wait_for({requests_, topic_}, 1s)) return;
  while (const auto request = requests_.take()) {
    if (!request->from.is_cyclone) {
      const auto [done, text] = scan();
      replies_.reply(ros::TriggerResponse{done, text}, request->from);
    } else if (const auto asked = decode<ros::CycloneHeader>(request->bytes)) {
      const auto [done, text] = scan();
      replies_.reply(ros::WithCycloneHeader<ros::TriggerResponse>{*asked, {done, text}}, request->from);
    }
  }
  // One scan answers all waiting triggers, because each came before it began.
  bool asked = false;
  while (topic_.take()) asked = true;
  if (asked) (void)scan();
}

void write_diagnosis(const Writer& writer, const Diagnosis& diagnosis, const std::string& hardware,
                     const std::string& of) {
  ros::DiagnosticStatus status{static_cast<std::uint8_t>(diagnosis.level), of, diagnosis.message, hardware, {}};
  for (const auto& [key, value] : diagnosis.values) status.values.push_back({key, value});
  writer.write(ros::DiagnosticArray{{stamp_now(), {}}, {status}});
}

}  // namespace slsd::dds
