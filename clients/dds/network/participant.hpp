// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include "core/result.hpp"
#include "network/network_options.hpp"

namespace slsd::dds {

/// The name of the flow controller of clouds and images.
inline constexpr const char* kPace = "slsd pace";

/// The greatest number of unread bytes in a socket of this host.
[[nodiscard]] int largest_receive_buffer();

/// A participant's settings: where it listens, which participants it looks for, and how fast it sends.
/// @errors kInvalidArgument: no such interface or peer
[[nodiscard]] Result<eprosima::fastdds::dds::DomainParticipantQos> participant_qos(
    eprosima::fastdds::dds::DomainParticipantQos qos, const NetworkOptions& options);

}  // namespace slsd::dds
