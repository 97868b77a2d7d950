// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "network.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <utility>

#include "drivers/system/file_descriptor.hpp"

namespace slsd::dds {
namespace {

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

// A cloud of 10 MB in 160 pieces, not in 7,400: a third of the time.
constexpr const char* kLargePieces = "<MaxMessageSize>65500 B</MaxMessageSize><FragmentSize>64000 B</FragmentSize>";
// A dense cloud comes faster than a busy reader is scheduled: its buffer is to hold it whole, as far as
// net.core.rmem_max allows. What is lost all the same is asked for at once, not after the 100 ms that are usual, and
// sent again in one go, not half a megabyte at a time.
constexpr const char* kInternal =
    "<Internal><SocketReceiveBufferSize max=\"64 MB\"/><NackDelay>5 ms</NackDelay><AckDelay>1 ms</AckDelay>"
    "<HeartbeatInterval>20 ms</HeartbeatInterval>"
    "<MaxQueuedRexmitBytes>32 MB</MaxQueuedRexmitBytes>"
    "<MaxQueuedRexmitMessages>4000</MaxQueuedRexmitMessages></Internal>";
constexpr int kDenseCloudBytes = 10 << 20;
constexpr int kParticipantsMax = 120;  // of one host, found one by one where there is no multicast

bool plain(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || std::strchr(".:-_%", c);
  });
}

std::string configuration(const NetworkOptions& options) {
  std::string text = "<CycloneDDS><Domain id=\"any\"><General>" + std::string(kLargePieces);
  if (!options.interface.empty())
    text += "<Interfaces><NetworkInterface name=\"" + options.interface + "\"/></Interfaces>";
  if (!options.peers.empty()) text += "<AllowMulticast>false</AllowMulticast>";
  text += "</General>";
  if (!options.peers.empty()) {
    text += "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>" +
            std::to_string(kParticipantsMax) + "</MaxAutoParticipantIndex><Peers>";
    for (const std::string& peer : options.peers) text += "<Peer address=\"" + peer + "\"/>";
    text += "</Peers></Discovery>";
  }
  text += std::string(kInternal) + "</Domain></CycloneDDS>";
  const char* users = std::getenv("CYCLONEDDS_URI");  // comes last: it has the last word
  return users && *users ? text + "," + users : text;
}

Qos quality_of(Network::Quality quality, bool best_effort) {
  Qos qos(dds_create_qos(), dds_delete_qos);
  const bool sensor = quality == Network::Quality::kSensor, latched = quality == Network::Quality::kLatched;
  dds_qset_reliability(qos.get(), sensor && best_effort ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE, 0);
  dds_qset_durability(qos.get(), latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, latched ? 1 : sensor ? 5 : 10);
  return qos;
}

Result<dds_entity_t> made(dds_entity_t entity, const std::string& what) {
  if (entity > 0) return entity;
  return fail(ErrorCode::kIo, "DDS: " + std::string(dds_strretcode(entity)), what);
}

// Asked of a socket, as a unit may hide /proc/sys. The kernel doubles what it grants.
int largest_receive_buffer() {
  constexpr int kMost = 1 << 30;
  const FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  int granted = 0;
  socklen_t size = sizeof granted;
  ::setsockopt(socket.number(), SOL_SOCKET, SO_RCVBUF, &kMost, sizeof kMost);
  return ::getsockopt(socket.number(), SOL_SOCKET, SO_RCVBUF, &granted, &size) == 0 ? granted / 2 : kMost;
}

}  // namespace

std::string receive_buffer_warning() {
  const int largest = largest_receive_buffer();
  if (largest >= kDenseCloudBytes) return {};
  return "net.core.rmem_max is " + std::to_string(largest) +
         ": of a dense cloud a reader on this host may lose a part, and get it late or never: "
         "echo net.core.rmem_max=67108864 >/etc/sysctl.d/60-clouds.conf, and run sysctl --system";
}

Result<Network> Network::open(const NetworkOptions& options) {
  if (!plain(options.interface) || !std::all_of(options.peers.begin(), options.peers.end(), plain)) {
    return fail(ErrorCode::kInvalidArgument, "an interface or peer is a name or an address");
  }
  const char* what_to_do = ": look at --interface, --peer and CYCLONEDDS_URI";
  const dds_entity_t domain = dds_create_domain(options.domain, configuration(options).c_str());
  if (domain < 0) {
    return fail(ErrorCode::kInvalidArgument, std::string("DDS: ") + dds_strretcode(domain) + what_to_do,
                "domain " + std::to_string(options.domain));
  }
  const dds_entity_t participant = dds_create_participant(options.domain, nullptr, nullptr);
  if (participant < 0) {
    dds_delete(domain);
    return fail(ErrorCode::kInvalidArgument, std::string("DDS: ") + dds_strretcode(participant) + what_to_do,
                "domain " + std::to_string(options.domain));
  }
  Network network(domain, participant, options.best_effort);
  const auto publications =
      made(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr), "discovery");
  if (!publications) return tl::unexpected(publications.error());
  network.publications_ = *publications;
  return network;
}

Network::Network(Network&& other) noexcept
    : domain_(std::exchange(other.domain_, 0)),
      participant_(std::exchange(other.participant_, 0)),
      publications_(other.publications_),
      best_effort_(other.best_effort_) {}

Network::~Network() {
  if (domain_ > 0) dds_delete(domain_);  // and all in it
}

Result<dds_entity_t> Network::topic(const dds_topic_descriptor_t& type, const std::string& name) const {
  return made(dds_create_topic(participant_, &type, name.c_str(), nullptr, nullptr), name);
}

Result<dds_entity_t> Network::writer(const dds_topic_descriptor_t& type, const std::string& name,
                                     Quality quality) const {
  const auto on = topic(type, name);
  if (!on) return on;
  return made(dds_create_writer(participant_, *on, quality_of(quality, best_effort_).get(), nullptr), name);
}

Result<dds_entity_t> Network::reader(const dds_topic_descriptor_t& type, const std::string& name,
                                     Quality quality) const {
  const auto on = topic(type, name);
  if (!on) return on;
  return made(dds_create_reader(participant_, *on, quality_of(quality, best_effort_).get(), nullptr), name);
}

int Network::other_writers(const std::string& name) const {
  constexpr int kMost = 1024;
  std::vector<void*> samples(kMost, nullptr);
  std::vector<dds_sample_info_t> infos(kMost);
  const int count = dds_read_mask(publications_, samples.data(), infos.data(), kMost, kMost,
                                  DDS_ANY_SAMPLE_STATE | DDS_ANY_VIEW_STATE | DDS_ALIVE_INSTANCE_STATE);
  dds_guid_t own{};
  dds_get_guid(participant_, &own);
  int others = 0;
  for (std::size_t i = 0; static_cast<int>(i) < count; ++i) {
    const auto* endpoint = static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
    const bool foreign = std::memcmp(endpoint->participant_key.v, own.v, sizeof own.v) != 0;
    if (infos[i].valid_data && foreign && endpoint->topic_name == name) ++others;
  }
  if (count > 0) dds_return_loan(publications_, samples.data(), count);
  return others;
}

bool wait_for(const std::vector<dds_entity_t>& readers, std::chrono::milliseconds time) {
  const dds_entity_t set = dds_create_waitset(dds_get_participant(readers.front()));
  std::vector<dds_entity_t> conditions;
  for (const dds_entity_t reader : readers) {
    conditions.push_back(dds_create_readcondition(reader, DDS_NOT_READ_SAMPLE_STATE));
    dds_waitset_attach(set, conditions.back(), 0);
  }
  const int ready = dds_waitset_wait(set, nullptr, 0, DDS_MSECS(time.count()));
  dds_delete(set);
  for (const dds_entity_t condition : conditions) dds_delete(condition);
  return ready > 0;
}

}  // namespace slsd::dds
