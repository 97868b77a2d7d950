// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "network/loopback.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastrtps/utils/IPFinder.h>
#include <fastrtps/utils/IPLocator.h>

namespace slsd::dds {
namespace {

namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::rtps::IPFinder;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::rtps::LocatorsIterator;
using eprosima::fastrtps::rtps::octet;
using eprosima::fastrtps::rtps::SenderResource;

constexpr const char* kAddress = "127.0.0.1";

bool is_of_this_host(const Locator_t& locator) {
  std::vector<IPFinder::info_IP> own;
  IPFinder::getIPs(&own, true);
  return std::any_of(own.begin(), own.end(), [&](const IPFinder::info_IP& one) {
    return one.type != IPFinder::IP6 && one.type != IPFinder::IP6_LOCAL &&
           IPLocator::compareAddress(locator, one.locator);
  });
}

class Loopback : public rtps::ChainingTransport {
 public:
  explicit Loopback(const rtps::ChainingTransportDescriptor& descriptor)
      : ChainingTransport(descriptor), descriptor_(descriptor.low_level_descriptor) {}

  rtps::TransportDescriptorInterface* get_configuration() override { return descriptor_.get(); }

  bool transform_remote_locator(const Locator_t& remote, Locator_t& result) const override {
    if (!IsLocatorSupported(remote) || !is_of_this_host(remote)) return false;
    result = remote;
    return IPLocator::setIPv4(result, kAddress);
  }

  bool send(SenderResource* socket, const octet* bytes, std::uint32_t size, LocatorsIterator* to, LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) override {
    return socket->send(bytes, size, to, end, timeout);
  }

  void receive(rtps::TransportReceiverInterface* to, const octet* bytes, std::uint32_t size, const Locator_t& local,
               const Locator_t& remote) override {
    to->OnDataReceived(bytes, size, local, remote);
  }

 private:
  std::shared_ptr<rtps::TransportDescriptorInterface> descriptor_;  ///< shared with the participant's settings
};

struct LoopbackDescriptor : rtps::ChainingTransportDescriptor {
  using ChainingTransportDescriptor::ChainingTransportDescriptor;
  [[nodiscard]] rtps::TransportInterface* create_transport() const override { return new Loopback(*this); }
};

}  // namespace

std::shared_ptr<rtps::TransportDescriptorInterface> loopback_transport(
    std::shared_ptr<rtps::UDPv4TransportDescriptor> udp) {
  udp->interfaceWhiteList.assign(1, kAddress);
  return std::make_shared<LoopbackDescriptor>(std::move(udp));
}

}  // namespace slsd::dds
