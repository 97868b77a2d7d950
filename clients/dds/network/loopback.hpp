// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

namespace slsd::dds {

/// UDP on loopback alone, even with nodes that announce addresses of the host's other interfaces. ROS nodes do so even
/// if restricted to this host; Fast DDS's own transport does not answer them.
/// @param udp  provides the other settings
[[nodiscard]] std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> loopback_transport(
    std::shared_ptr<eprosima::fastdds::rtps::UDPv4TransportDescriptor> udp);

}  // namespace slsd::dds
