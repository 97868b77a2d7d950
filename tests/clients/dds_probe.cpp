// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cinttypes>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <CLI/CLI.hpp>

#include "ros.h"

namespace {

using namespace std::chrono_literals;

const std::map<std::string, const dds_topic_descriptor_t*> kTypes{
    {"PointCloud2", &sensor_msgs_msg_dds__PointCloud2__desc},
    {"CameraInfo", &sensor_msgs_msg_dds__CameraInfo__desc},
    {"Image", &sensor_msgs_msg_dds__Image__desc},
    {"String", &std_msgs_msg_dds__String__desc},
    {"TFMessage", &tf2_msgs_msg_dds__TFMessage__desc},
    {"DiagnosticArray", &diagnostic_msgs_msg_dds__DiagnosticArray__desc}};

std::atomic<bool> ended{false};

enum class Quality { kSensor, kBestEffort, kService, kLatched };

/// A participant on loopback, of another maker's DDS than slsd-dds.
class Network {
 public:
  explicit Network(std::uint32_t domain) {
    const char* loopback =
        "<CycloneDDS><Domain id=\"any\"><General><MaxMessageSize>65500 B</MaxMessageSize><FragmentSize>64000 "
        "B</FragmentSize>"
        "<Interfaces><NetworkInterface name=\"lo\"/></Interfaces><AllowMulticast>false</AllowMulticast></General>"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>120</MaxAutoParticipantIndex>"
        "<Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery><Internal><SocketReceiveBufferSize max=\"64 MB\"/>"
        "<NackDelay>5 ms</NackDelay><AckDelay>1 ms</AckDelay></Internal></Domain></CycloneDDS>";
    domain_ = dds_create_domain(domain, loopback);
    participant_ = dds_create_participant(domain, nullptr, nullptr);
  }
  ~Network() { dds_delete(domain_); }
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  [[nodiscard]] dds_entity_t writer(const dds_topic_descriptor_t& type, const std::string& topic,
                                    Quality quality) const {
    return made(dds_create_writer, type, topic, quality);
  }
  [[nodiscard]] dds_entity_t reader(const dds_topic_descriptor_t& type, const std::string& topic,
                                    Quality quality) const {
    return made(dds_create_reader, type, topic, quality);
  }

 private:
  template <typename Create>
  dds_entity_t made(Create create, const dds_topic_descriptor_t& type, const std::string& topic,
                    Quality quality) const {
    const bool sensor = quality == Quality::kSensor || quality == Quality::kBestEffort;
    const bool latched = quality == Quality::kLatched;
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, quality == Quality::kBestEffort ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE,
                         0);
    dds_qset_durability(qos, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, latched ? 1 : sensor ? 5 : 10);
    const dds_entity_t on = dds_create_topic(participant_, &type, topic.c_str(), nullptr, nullptr);
    const dds_entity_t entity = create(participant_, on, qos, nullptr);
    dds_delete_qos(qos);
    if (entity < 0) std::fprintf(stderr, "%s: %s\n", topic.c_str(), dds_strretcode(entity)), std::exit(1);
    return entity;
  }

  dds_entity_t domain_, participant_;
};

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

// What came, as it was on the wire: whoever reads it needs no IDL.
std::string taken(dds_entity_t reader) {
  ddsi_serdata* data = nullptr;
  dds_sample_info_t info;
  if (dds_takecdr(reader, &data, 1, &info, DDS_ANY_STATE) <= 0) return {};
  const std::uint32_t size = ddsi_serdata_size(data);
  std::string bytes(size, '\0');
  ddsi_serdata_to_ser(data, 0, size, bytes.data());
  ddsi_serdata_unref(data);
  return info.valid_data ? bytes : std::string();
}

int call(const Network& network, const std::string& name) {
  const auto requests =
      network.writer(std_srvs_srv_dds__Trigger_Request__desc, "rq/" + name + "/triggerRequest", Quality::kService);
  const auto replies =
      network.reader(std_srvs_srv_dds__Trigger_Response__desc, "rr/" + name + "/triggerReply", Quality::kService);
  const std_srvs_srv_dds__Trigger_Request_ request{0x1122334455667788, 42, 0};
  for (int tries = 0; tries < 20; ++tries) {  // the service is to know of both first
    dds_publication_matched_status_t matched{};
    dds_get_publication_matched_status(requests, &matched);
    dds_subscription_matched_status_t heard{};
    dds_get_subscription_matched_status(replies, &heard);
    if (matched.current_count > 0 && heard.current_count > 0) break;
    ::usleep(250'000);
  }
  ::usleep(500'000);
  dds_write(requests, &request);
  void* sample = nullptr;
  dds_sample_info_t info;
  const auto end = std::chrono::steady_clock::now() + 20s;
  while (dds_take(replies, &sample, &info, 1, 1) != 1) {
    if (std::chrono::steady_clock::now() > end) return 1;
    ::usleep(10'000);
  }
  const auto* reply = static_cast<const std_srvs_srv_dds__Trigger_Response_*>(sample);
  std::printf("%" PRIx64 " %" PRId64 " %d %s\n", reply->client_guid, reply->sequence_number, reply->success,
              reply->message);
  return 0;
}

/// A cloud as somebody else may write it: its header says what it wants to.
struct ForeignCloud {
  std::string frame_id = "left_optical_frame";
  std::uint32_t width = 100, height = 1, point_step = 20, row_step = 2000, bytes = 2000, x_offset = 0;
  bool is_bigendian = false;
};

void add_header(CLI::App& app, ForeignCloud& cloud) {
  app.add_option("--frame", cloud.frame_id);
  app.add_option("--width", cloud.width);
  app.add_option("--height", cloud.height);
  app.add_option("--point-step", cloud.point_step);
  app.add_option("--row-step", cloud.row_step);
  app.add_option("--bytes", cloud.bytes);
  app.add_option("--x-offset", cloud.x_offset);
  app.add_flag("--big-endian", cloud.is_bigendian);
}

// Another header for the clouds to come: a line of standard input, with the options of a header. It saves the seconds
// that another writer needs to be found.
std::optional<ForeignCloud> next_header() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  std::string line;
  if (::poll(&input, 1, 0) <= 0 || !std::getline(std::cin, line)) return std::nullopt;
  ForeignCloud cloud;
  CLI::App app;
  add_header(app, cloud);
  app.parse(line);
  return cloud;
}

int write_clouds(const Network& network, const std::string& topic, ForeignCloud cloud, double seconds) {
  const auto writer = network.writer(sensor_msgs_msg_dds__PointCloud2__desc, "rt/" + topic, Quality::kSensor);
  std::string x = "x", y = "y", z = "z";
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!ended && std::chrono::steady_clock::now() < end) {
    if (auto next = next_header()) cloud = std::move(*next);
    sensor_msgs_msg_dds__PointField_ fields[] = {
        {x.data(), cloud.x_offset, 7, 1}, {y.data(), 4, 7, 1}, {z.data(), 8, 7, 1}};
    std::vector<std::uint8_t> data(cloud.bytes);
    const std::int64_t now = now_ns();
    sensor_msgs_msg_dds__PointCloud2_ message{};
    message.header = {{static_cast<std::int32_t>(now / 1'000'000'000), static_cast<std::uint32_t>(now % 1'000'000'000)},
                      cloud.frame_id.data()};
    message.height = cloud.height, message.width = cloud.width;
    message.fields = {3, 3, fields, false};
    message.is_bigendian = cloud.is_bigendian;
    message.point_step = cloud.point_step, message.row_step = cloud.row_step;
    message.data = {cloud.bytes, cloud.bytes, data.data(), false};
    dds_write(writer, &message);
    ::usleep(100'000);
  }
  return 0;
}

// Lines of standard input, each with `tf` or `tf_static`, parent, child, the stamp (seconds, nanoseconds), place and
// quaternion; an empty line sends the transforms before it as one message.
int write_transforms(const Network& network) {
  const auto& type = tf2_msgs_msg_dds__TFMessage__desc;
  const std::map<std::string, dds_entity_t> writers{
      {"tf", network.writer(type, "rt/tf", Quality::kService)},
      {"tf_static", network.writer(type, "rt/tf_static", Quality::kLatched)}};
  std::vector<std::vector<std::string>> waiting;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    const std::vector<std::string> told(std::istream_iterator<std::string>(words), {});
    if (!told.empty()) waiting.push_back(told);
    if (!told.empty() || waiting.empty()) continue;
    std::vector<geometry_msgs_msg_dds__TransformStamped_> transforms;
    for (auto& each : waiting) {
      const auto number = [&](std::size_t i) { return std::strtod(each.at(i).c_str(), nullptr); };
      transforms.push_back(
          {{{static_cast<std::int32_t>(number(3)), static_cast<std::uint32_t>(number(4))}, each[1].data()},
           each[2].data(),
           {{number(5), number(6), number(7)}, {number(8), number(9), number(10), number(11)}}});
    }
    const auto count = static_cast<std::uint32_t>(transforms.size());
    const tf2_msgs_msg_dds__TFMessage_ message{{count, count, transforms.data(), false}};
    dds_write(writers.at(waiting[0][0]), &message);
    waiting.clear();
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Reads topics of ROS 2 on loopback: each sample's size (4 bytes) and bytes; or, with --stamps, a line for each.");
  std::uint32_t domain = 0;
  std::vector<std::string> topics;
  std::string type = "PointCloud2", service;
  std::uint64_t count = 1;
  double seconds = 20;
  bool stamps = false, sensor = false, latched = false;
  app.add_option("--domain", domain)->required();
  app.add_option("--topic", topics, "without rt/");
  app.add_option("--type", type);
  app.add_option("--count", count);
  app.add_option("--seconds", seconds);
  app.add_option("--call", service, "the trigger service of this scanner");
  std::string written;
  ForeignCloud cloud;
  app.add_option("--write", written,
                 "write clouds to this topic, of a header with these; a line of standard input gives others:");
  add_header(app, cloud);
  bool writes_transforms = false;
  app.add_flag("--transforms", writes_transforms, "write transforms of standard input to /tf and /tf_static");
  app.add_flag("--stamps", stamps, "topic, stamp, time of arrival (ns), bytes");
  app.add_flag("--best-effort", sensor, "ask for no more than sensors' QoS");
  app.add_flag("--latched", latched, "ask for what was said before");
  CLI11_PARSE(app, argc, argv);
  std::signal(SIGTERM, [](int) { ended = true; });  // the others are told then
  const Network network(domain);
  if (!written.empty()) return write_clouds(network, written, cloud, seconds);
  if (writes_transforms) return write_transforms(network);
  if (!service.empty()) return call(network, service);
  std::vector<dds_entity_t> readers;
  const Quality quality = latched ? Quality::kLatched : sensor ? Quality::kBestEffort : Quality::kSensor;
  for (const std::string& topic : topics) readers.push_back(network.reader(*kTypes.at(type), "rt/" + topic, quality));
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  const dds_entity_t set = dds_create_waitset(dds_get_participant(readers.at(0)));
  for (std::size_t i = 0; i < readers.size(); ++i)
    dds_waitset_attach(set, dds_create_readcondition(readers[i], DDS_NOT_READ_SAMPLE_STATE),
                       static_cast<dds_attach_t>(i));
  for (std::uint64_t seen = 0; !ended && seen < count && std::chrono::steady_clock::now() < end;) {
    dds_waitset_wait(set, nullptr, 0, DDS_MSECS(200));
    for (std::size_t i = 0; i < readers.size(); ++i) {
      for (std::string bytes; seen < count && !(bytes = taken(readers[i])).empty(); ++seen) {
        const std::int64_t arrived = now_ns();
        const auto size = static_cast<std::uint32_t>(bytes.size());
        std::int32_t stamp[2] = {};  // behind the encapsulation's four bytes
        std::memcpy(stamp, bytes.data() + 4, sizeof stamp);
        if (stamps) {
          std::printf("%s %d.%09d %" PRId64 " %u\n", topics[i].c_str(), stamp[0], stamp[1], arrived, size);
        } else {
          std::fwrite(&size, sizeof size, 1, stdout);
          std::fwrite(bytes.data(), 1, size, stdout);
        }
        std::fflush(stdout);
      }
    }
  }
}
