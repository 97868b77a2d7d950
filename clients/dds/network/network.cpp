// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "network/network.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstring>
#include <list>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include "network/leaving.hpp"
#include "network/participant.hpp"
#include "network/write_watch.hpp"

namespace slsd::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using namespace std::chrono_literals;

constexpr int kDenseCloudBytes = 10 << 20;
constexpr std::uint8_t kCycloneVendor[] = {0x01, 0x10};
constexpr int kTransformsKept = 100;  // as tf2 does
constexpr auto kHearing = 1s;         // time to discover a client's reply reader
constexpr auto kBlockingMax = 5;      // seconds that a write waits until the previous one is sent
constexpr int kLooksMost = 30;        // of one second each; longer than any limit of a write
constexpr auto kBacklogMax = 1s;      // time for earlier data to be sent

/// Samples of any type, as bytes.
class BytesType : public fast::TopicDataType {
 public:
  explicit BytesType(const char* name) {
    setName(name);
    m_typeSize = 4096;  // initial size; it grows
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const Bytes& bytes = *static_cast<Bytes*>(data);
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

template <typename Qos>
void set_quality(Qos& qos, Quality quality, bool best_effort) {
  const bool sensor = quality == Quality::kSensor, latched = quality == Quality::kLatched;
  qos.reliability().kind = sensor && best_effort ? fast::BEST_EFFORT_RELIABILITY_QOS : fast::RELIABLE_RELIABILITY_QOS;
  qos.reliability().max_blocking_time = {kBlockingMax, 0};
  qos.durability().kind = latched ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = latched ? 1 : sensor ? 5 : quality == Quality::kTransforms ? kTransformsKept : 10;
  qos.resource_limits().allocated_samples = qos.history().depth;
  qos.data_sharing().off();
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
}

template <typename Qos>
void set_type_hash(Qos& qos, const ros::Type& type) {
  const std::string text = std::string("typehash=") + type.hash + ";";
  qos.user_data().assign(text.begin(), text.end());
}

// Requests and repeats lost data at once, not after the usual seconds.
fast::DataWriterQos writer_qos(const ros::Type& type, Quality quality, bool best_effort) {
  fast::DataWriterQos qos;
  set_quality(qos, quality, best_effort);
  set_type_hash(qos, type);
  auto& times = qos.reliable_writer_qos().times;
  times.heartbeatPeriod = eprosima::fastrtps::Duration_t(0.02);
  times.nackResponseDelay = eprosima::fastrtps::Duration_t(0.001);
  if (quality == Quality::kSensor) {
    qos.liveliness().kind = fast::MANUAL_BY_TOPIC_LIVELINESS_QOS;  // for heartbeats; the lease never ends
    qos.publish_mode().kind = fast::ASYNCHRONOUS_PUBLISH_MODE;
    qos.publish_mode().flow_controller_name = kPace;
  }
  return qos;
}

fast::DataReaderQos reader_qos(const ros::Type& type, Quality quality, bool best_effort) {
  fast::DataReaderQos qos;
  set_quality(qos, quality, best_effort);
  // One history serves all writers of the topic.
  if (quality == Quality::kLatched) qos.history().depth = qos.resource_limits().allocated_samples = kTransformsKept;
  set_type_hash(qos, type);
  qos.reliable_reader_qos().times.heartbeatResponseDelay = eprosima::fastrtps::Duration_t(0.001);
  return qos;
}

std::array<std::uint8_t, 16> bytes_of(const rtps::GUID_t& guid) {
  std::array<std::uint8_t, 16> bytes;
  std::memcpy(bytes.data(), guid.guidPrefix.value, 12);
  std::memcpy(bytes.data() + 12, guid.entityId.value, 4);
  return bytes;
}

rtps::GUID_t guid_of(const std::array<std::uint8_t, 16>& bytes) {
  rtps::GUID_t guid;
  std::memcpy(guid.guidPrefix.value, bytes.data(), 12);
  std::memcpy(guid.entityId.value, bytes.data() + 12, 4);
  return guid;
}

}  // namespace

/// Network events, reported by its threads. No DDS function is called while `mutex` is held.
struct Events {
  std::mutex mutex;
  std::condition_variable changed;
};

/// The time until the written clouds and images are sent.
class Backlog {
 public:
  explicit Backlog(double bytes_per_s) : bytes_per_s_(bytes_per_s) {}
  /// Reserves room for this many more bytes, if there is any. Without this check, a writer that is too fast would drop
  /// every sample shortly before completion.
  bool take(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (until_ > now + kBacklogMax) return false;
    const std::chrono::duration<double> takes(static_cast<double>(bytes) / bytes_per_s_);
    until_ = std::max(until_, now) + std::chrono::duration_cast<std::chrono::nanoseconds>(takes);
    return true;
  }

 private:
  double bytes_per_s_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point until_;
};

struct Writer::State : fast::DataWriterListener {
  State(Events& heard, Leaving& of_all, Backlog* waiting) : events(heard), leaving(of_all), backlog(waiting) {}
  void on_publication_matched(fast::DataWriter*, const fast::PublicationMatchedStatus& info) override {
    const std::lock_guard lock(events.mutex);
    const auto guid = bytes_of(rtps::iHandle2GUID(info.last_subscription_handle));
    if (info.current_count_change > 0) readers.insert(guid);
    if (info.current_count_change < 0) readers.erase(guid);
    events.changed.notify_all();
  }

  Events& events;
  Leaving& leaving;
  Backlog* backlog;                    ///< set for a sensor topic
  fast::DataWriter* writer = nullptr;  ///< null if it was made after the network was left
  std::set<std::array<std::uint8_t, 16>> readers;
};

struct Reader::State : fast::DataReaderListener {
  State(Events& heard, Leaving& of_all) : events(heard), leaving(of_all) {}
  void on_data_available(fast::DataReader*) override {
    const std::lock_guard lock(events.mutex);
    arrived = true;
    events.changed.notify_all();
  }
  void on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& info) override {
    writers = info.current_count;
  }

  Events& events;
  Leaving& leaving;
  fast::DataReader* reader = nullptr;  ///< null if it was made after the network was left
  std::atomic<bool> arrived{false};
  std::atomic<int> writers{0};
};

struct Network::State : fast::DomainParticipantListener {
  explicit State(const NetworkOptions& options)
      : best_effort(options.best_effort), backlog(options.rate_max_mb * 1e6) {}
  void on_publisher_discovery(fast::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) override {
    const std::lock_guard lock(events.mutex);
    const rtps::GUID_t& guid = info.info.guid();
    if (info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER) {
      others.erase(guid);
    } else if (!participant || guid.guidPrefix != participant->guid().guidPrefix) {
      others[guid] = info.info.topicName().to_string();
    }
  }
  void on_participant_discovery(fast::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& info) override {
    if (info.status != rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT &&
        info.status != rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT) {
      return;
    }
    const std::lock_guard lock(events.mutex);
    std::erase_if(others, [&](const auto& one) { return one.first.guidPrefix == info.info.m_guid.guidPrefix; });
  }

  fast::Topic* topic(const ros::Type& type, const std::string& name) {
    fast::Topic*& known = topics[name];
    if (known) return known;
    participant->register_type(fast::TypeSupport(new BytesType(type.name)));
    return known = participant->create_topic(name, type.name, fast::TOPIC_QOS_DEFAULT);
  }

  void tell_node() {
    if (node.node_name.empty()) return;
    const ros::ParticipantEntitiesInfo info{{bytes_of(participant->guid())}, {node}};
    Bytes bytes = encode(info);
    node_writer->write(&bytes);
  }

  void leave() {
    const auto alone = leaving.leave();
    if (!alone.owns_lock() || !participant) return;
    participant->set_listener(nullptr);
    participant->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  Events events;
  Leaving leaving;  ///< all that call DDS use it
  bool best_effort;
  Backlog backlog;
  std::mutex making;  ///< guards the endpoints below, before `others`; locked before a use of `leaving`
  std::map<std::string, fast::Topic*> topics;
  std::list<Writer::State> writers;
  std::list<Reader::State> readers;
  ros::NodeEntitiesInfo node;  ///< not shown while it has no name
  fast::DataWriter* node_writer = nullptr;
  fast::DomainParticipant* participant = nullptr;
  fast::Publisher* publisher = nullptr;
  fast::Subscriber* subscriber = nullptr;
  std::map<rtps::GUID_t, std::string> others;  ///< topics of others' writers; guarded by `events`
};

namespace {

std::mutex networks_mutex;
std::set<Network::State*> networks;
WriteWatch write_watch;

Error not_made(const std::string& what) {
  return fail(ErrorCode::kIo, "Fast DDS cannot create it", what).value();
}

}  // namespace

bool Writer::has_readers() const {
  const std::lock_guard lock(state_->events.mutex);
  return !state_->readers.empty();
}

bool Writer::write_bytes(const Bytes& bytes, const Requester* to) const {
  if (to && !to->is_cyclone) {
    std::unique_lock lock(state_->events.mutex);
    state_->events.changed.wait_for(lock, kHearing, [&] { return state_->readers.contains(to->guid); });
  }
  const auto use = state_->leaving.use();
  if (!use.owns_lock()) return true;
  rtps::WriteParams related;
  if (to && !to->is_cyclone) {
    related.related_sample_identity().writer_guid(guid_of(to->guid));
    related.related_sample_identity().sequence_number(rtps::SequenceNumber_t(to->sequence_number));
  }
  if (state_->backlog) {
    if (has_readers() && !state_->backlog->take(bytes.size())) return false;
    // Sends a heartbeat first. Cyclone's readers skip everything older than the first sample that they hear of. A large
    // sample is still under way when the next is due.
    state_->writer->assert_liveliness();
  }
  const WriteWatch::Writing writing(write_watch);
  return state_->writer->write(const_cast<Bytes*>(&bytes), related);
}

bool Reader::has_news() const {
  return state_->arrived;
}

int Reader::writer_count() const {
  return state_->writers;
}

std::optional<Sample> Reader::take() const {
  const auto use = state_->leaving.use();
  if (!use.owns_lock()) state_->arrived = false;  // otherwise wait_for() would not wait
  if (!use.owns_lock()) return std::nullopt;
  while (true) {
    state_->arrived = false;  // reset before reading, so that later arrivals are not missed
    Sample sample;
    fast::SampleInfo info;
    if (state_->reader->take_next_sample(&sample.bytes, &info) != eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
      return std::nullopt;
    state_->arrived = true;
    if (!info.valid_data) continue;
    const rtps::GUID_t& writer = info.sample_identity.writer_guid();
    const rtps::GUID_t& related = info.related_sample_identity.writer_guid();
    sample.from.guid = bytes_of(related == rtps::GUID_t::unknown() ? writer : related);
    sample.from.sequence_number = info.sample_identity.sequence_number().to64long();
    sample.from.is_cyclone = std::memcmp(writer.guidPrefix.value, kCycloneVendor, sizeof kCycloneVendor) == 0;
    return sample;
  }
}

Network::Network(std::unique_ptr<State> state) : state_(std::move(state)) {
  const std::lock_guard lock(networks_mutex);
  networks.insert(state_.get());
}

Network::Network(Network&&) noexcept = default;

Network::~Network() {
  if (!state_) return;
  {
    const std::lock_guard lock(networks_mutex);
    networks.erase(state_.get());
  }
  state_->leave();
}

void leave_networks() {
  const std::lock_guard lock(networks_mutex);
  for (Network::State* network : networks) network->leave();
}

bool write_hangs() {
  return write_watch.look() >= kLooksMost;
}

Result<Network> Network::open(const NetworkOptions& options) {
  auto* factory = fast::DomainParticipantFactory::get_instance();
  factory->load_profiles();  // the user's own profiles, from FASTRTPS_DEFAULT_PROFILES_FILE
  const auto qos = participant_qos(factory->get_default_participant_qos(), options);
  if (!qos) return tl::unexpected(qos.error());
  auto state = std::make_unique<State>(options);
  const auto mask = fast::StatusMask::none();  // for discovery only; endpoints have their own listeners
  state->participant = factory->create_participant(options.domain, *qos, state.get(), mask);
  if (!state->participant) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot join DDS: check --interface, --peer and the ROS environment variables",
                "domain " + std::to_string(options.domain));
  }
  state->publisher = state->participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
  state->subscriber = state->participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  if (!state->publisher || !state->subscriber) return tl::unexpected(not_made("participant"));
  return Network(std::move(state));
}

void Network::show_node(const std::string& name_space) {
  const std::lock_guard lock(state_->making);
  const auto use = state_->leaving.use();
  if (!use.owns_lock()) return;
  const auto& type = ros::ParticipantEntitiesInfo::kType;
  if (!state_->node_writer) {
    state_->node_writer = state_->publisher->create_datawriter(state_->topic(type, "ros_discovery_info"),
                                                               writer_qos(type, Quality::kLatched, false));
  }
  state_->node.node_namespace = "/" + name_space;
  state_->node.node_name = "slsd";
  if (state_->node_writer) state_->tell_node();
}

Result<Writer> Network::writer(const ros::Type& type, const std::string& topic, Quality quality) const {
  const std::lock_guard lock(state_->making);
  const auto use = state_->leaving.use();
  auto& made = state_->writers.emplace_back(state_->events, state_->leaving,
                                            quality == Quality::kSensor ? &state_->backlog : nullptr);
  if (!use.owns_lock()) return Writer(&made);
  made.writer = state_->publisher->create_datawriter(state_->topic(type, topic),
                                                     writer_qos(type, quality, state_->best_effort), &made);
  if (!made.writer) return tl::unexpected(not_made(topic));
  state_->node.writer_gid_seq.push_back({bytes_of(made.writer->guid())});
  state_->tell_node();
  return Writer(&made);
}

Result<Reader> Network::reader(const ros::Type& type, const std::string& topic, Quality quality) const {
  const std::lock_guard lock(state_->making);
  const auto use = state_->leaving.use();
  auto& made = state_->readers.emplace_back(state_->events, state_->leaving);
  if (!use.owns_lock()) return Reader(&made);
  made.reader = state_->subscriber->create_datareader(state_->topic(type, topic),
                                                      reader_qos(type, quality, state_->best_effort), &made);
  if (!made.reader) return tl::unexpected(not_made(topic));
  state_->node.reader_gid_seq.push_back({bytes_of(made.reader->guid())});
  state_->tell_node();
  return Reader(&made);
}

int Network::other_writers(const std::string& topic) const {
  const std::lock_guard lock(state_->events.mutex);
  return static_cast<int>(std::count_if(state_->others.begin(), state_->others.end(),
                                        [&](const auto& one) { return one.second == topic; }));
}

bool Network::wait_for(const std::vector<Reader>& readers, std::chrono::milliseconds time) const {
  std::unique_lock lock(state_->events.mutex);
  return state_->events.changed.wait_for(lock, time, [&] {
    return std::any_of(readers.begin(), readers.end(), [](const Reader& reader) { return reader.has_news(); });
  });
}

std::string receive_buffer_warning() {
  const int largest = largest_receive_buffer();
  if (largest >= kDenseCloudBytes) return {};
  return "net.core.rmem_max is " + std::to_string(largest) +
         ": readers on this host may get dense clouds late or never: run echo net.core.rmem_max=67108864 "
         ">/etc/sysctl.d/60-clouds.conf, then sysctl --system";
}

}  // namespace slsd::dds
