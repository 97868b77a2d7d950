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
  using Quality = Network::Quality;
  const auto topic = network.reader(std_msgs_msg_dds__Empty__desc, "rt/" + name + "/trigger", Quality::kService);
  const auto requests =
      network.reader(std_srvs_srv_dds__Trigger_Request__desc, "rq/" + name + "/triggerRequest", Quality::kService);
  const auto replies =
      network.writer(std_srvs_srv_dds__Trigger_Response__desc, "rr/" + name + "/triggerReply", Quality::kService);
  for (const auto* made : {&topic, &requests, &replies}) {
    if (!*made) return tl::unexpected(made->error());
  }
  Trigger trigger;
  trigger.topic_ = *topic, trigger.requests_ = *requests, trigger.replies_ = *replies;
  return trigger;
}

void Trigger::answer(const Scan& scan) const {
  if (!wait_for({requests_, topic_}, 1s)) return;
  void* sample = nullptr;
  dds_sample_info_t info;
  while (dds_take(requests_, &sample, &info, 1, 1) > 0) {
    const auto request = *static_cast<const std_srvs_srv_dds__Trigger_Request_*>(sample);
    dds_return_loan(requests_, &sample, 1);
    sample = nullptr;
    if (!info.valid_data) continue;
    auto [done, text] = scan();
    const std_srvs_srv_dds__Trigger_Response_ reply{request.client_guid, request.sequence_number, done, text.data()};
    dds_write(replies_, &reply);
  }
  // However many came meanwhile: each of them came before the scan began.
  bool asked = false;
  while (dds_take(topic_, &sample, &info, 1, 1) > 0) {
    asked = asked || info.valid_data;
    dds_return_loan(topic_, &sample, 1);
    sample = nullptr;
  }
  if (asked) (void)scan();
}

void write_diagnosis(dds_entity_t writer, Diagnosis diagnosis, std::string hardware, std::string of) {
  std::string none;
  std::vector<diagnostic_msgs_msg_dds__KeyValue_> pairs;
  for (auto& [key, value] : diagnosis.values) pairs.push_back({key.data(), value.data()});
  const auto count = static_cast<std::uint32_t>(pairs.size());
  diagnostic_msgs_msg_dds__DiagnosticStatus_ status{static_cast<std::uint8_t>(diagnosis.level),
                                                    of.data(),
                                                    diagnosis.message.data(),
                                                    hardware.data(),
                                                    {count, count, pairs.data(), false}};
  const diagnostic_msgs_msg_dds__DiagnosticArray_ all{{stamp_now(), none.data()}, {1, 1, &status, false}};
  dds_write(writer, &all);
}

}  // namespace slsd::dds
