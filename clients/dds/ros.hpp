// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

/// ROS 2's messages, with the fields and their order in ROS's own .msg and .srv files.
namespace slsd::dds::ros {

/// A type with its ROS 2 name in DDS, and the hash of its description (REP 2016).
struct Type {
  const char* name;
  const char* hash;
};

struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  static void fields(auto& m, auto&& each) { each(m.sec, m.nanosec); }
};

struct Header {
  Time stamp;
  std::string frame_id;
  static void fields(auto& m, auto&& each) { each(m.stamp, m.frame_id); }
};

struct Empty {
  static constexpr Type kType{"std_msgs::msg::dds_::Empty_",
                              "RIHS01_20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312"};
  std::uint8_t structure_needs_at_least_one_member = 0;
  static void fields(auto& m, auto&& each) { each(m.structure_needs_at_least_one_member); }
};

struct String {
  static constexpr Type kType{"std_msgs::msg::dds_::String_",
                              "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"};
  std::string data;
  static void fields(auto& m, auto&& each) { each(m.data); }
};

struct PointField {
  enum : std::uint8_t { kUint8 = 2, kFloat32 = 7 };
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;
  std::uint32_t count = 1;
  static void fields(auto& m, auto&& each) { each(m.name, m.offset, m.datatype, m.count); }
};

struct PointCloud2 {
  static constexpr Type kType{"sensor_msgs::msg::dds_::PointCloud2_",
                              "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"};
  Header header;
  std::uint32_t height = 0, width = 0;
  std::vector<PointField> point_fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = false;
  static void fields(auto& m, auto&& each) {
    each(m.header, m.height, m.width, m.point_fields, m.is_bigendian, m.point_step, m.row_step, m.data, m.is_dense);
  }
};

struct RegionOfInterest {
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;
  bool do_rectify = false;
  static void fields(auto& m, auto&& each) { each(m.x_offset, m.y_offset, m.height, m.width, m.do_rectify); }
};

struct CameraInfo {
  static constexpr Type kType{"sensor_msgs::msg::dds_::CameraInfo_",
                              "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"};
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi;
  static void fields(auto& m, auto&& each) {
    each(m.header, m.height, m.width, m.distortion_model, m.d, m.k, m.r, m.p, m.binning_x, m.binning_y, m.roi);
  }
};

struct Image {
  static constexpr Type kType{"sensor_msgs::msg::dds_::Image_",
                              "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"};
  Header header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;
  std::vector<std::uint8_t> data;
  static void fields(auto& m, auto&& each) {
    each(m.header, m.height, m.width, m.encoding, m.is_bigendian, m.step, m.data);
  }
};

struct CompressedImage {
  static constexpr Type kType{"sensor_msgs::msg::dds_::CompressedImage_",
                              "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a"};
  Header header;
  std::string format;
  std::vector<std::uint8_t> data;
  static void fields(auto& m, auto&& each) { each(m.header, m.format, m.data); }
};

struct Vector3 {
  double x = 0, y = 0, z = 0;
  static void fields(auto& m, auto&& each) { each(m.x, m.y, m.z); }
};

struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
  static void fields(auto& m, auto&& each) { each(m.x, m.y, m.z, m.w); }
};

struct TransformStamped {
  Header header;
  std::string child_frame_id;
  Vector3 translation;
  Quaternion rotation;
  static void fields(auto& m, auto&& each) { each(m.header, m.child_frame_id, m.translation, m.rotation); }
};

struct TFMessage {
  static constexpr Type kType{"tf2_msgs::msg::dds_::TFMessage_",
                              "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"};
  std::vector<TransformStamped> transforms;
  static void fields(auto& m, auto&& each) { each(m.transforms); }
};

struct KeyValue {
  std::string key, value;
  static void fields(auto& m, auto&& each) { each(m.key, m.value); }
};

struct DiagnosticStatus {
  std::uint8_t level = 0;
  std::string name, message, hardware_id;
  std::vector<KeyValue> values;
  static void fields(auto& m, auto&& each) { each(m.level, m.name, m.message, m.hardware_id, m.values); }
};

struct DiagnosticArray {
  static constexpr Type kType{"diagnostic_msgs::msg::dds_::DiagnosticArray_",
                              "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"};
  Header header;
  std::vector<DiagnosticStatus> status;
  static void fields(auto& m, auto&& each) { each(m.header, m.status); }
};

struct TriggerRequest {
  static constexpr Type kType{"std_srvs::srv::dds_::Trigger_Request_",
                              "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"};
  std::uint8_t structure_needs_at_least_one_member = 0;
  static void fields(auto& m, auto&& each) { each(m.structure_needs_at_least_one_member); }
};

struct TriggerResponse {
  static constexpr Type kType{"std_srvs::srv::dds_::Trigger_Response_", TriggerRequest::kType.hash};
  bool success = false;
  std::string message;
  static void fields(auto& m, auto&& each) { each(m.success, m.message); }
};

/// Relates a reply to its request in rmw_cyclonedds; both begin with it.
struct CycloneHeader {
  std::uint64_t client_guid = 0;
  std::int64_t sequence_number = 0;
  static void fields(auto& m, auto&& each) { each(m.client_guid, m.sequence_number); }
};

template <typename Message>
struct WithCycloneHeader {
  CycloneHeader header;
  Message message;
  static void fields(auto& m, auto&& each) { each(m.header, m.message); }
};

/// The GUID of a participant, a writer or a reader.
struct Gid {
  std::array<std::uint8_t, 16> data{};
  static void fields(auto& m, auto&& each) { each(m.data); }
};

struct NodeEntitiesInfo {
  std::string node_namespace, node_name;
  std::vector<Gid> reader_gid_seq, writer_gid_seq;
  static void fields(auto& m, auto&& each) { each(m.node_namespace, m.node_name, m.reader_gid_seq, m.writer_gid_seq); }
};

/// The nodes of a participant, as `ros2 node list` reads them.
struct ParticipantEntitiesInfo {
  static constexpr Type kType{"rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
                              "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"};
  Gid gid;
  std::vector<NodeEntitiesInfo> node_entities_info_seq;
  static void fields(auto& m, auto&& each) { each(m.gid, m.node_entities_info_seq); }
};

}  // namespace slsd::dds::ros
