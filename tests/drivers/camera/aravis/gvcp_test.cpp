// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/gvcp.hpp"

#include <cstddef>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "core/printable.hpp"
#include "drivers/camera/aravis/gige/configure_network.hpp"
#include "tests/doubles/gige/control_port.hpp"
#include "tests/doubles/gige/wire.hpp"

namespace slsd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::uint16_t kId = 0x1234;

std::vector<std::uint8_t> discovery_answer() {
  std::vector<std::uint8_t> answer(8 + 0xf8, 0);
  answer[3] = 3;
  answer[6] = 0x12;
  answer[7] = 0x34;
  const auto write = [&](std::size_t offset, const std::string& text) {
    std::copy(text.begin(), text.end(), answer.begin() + static_cast<std::ptrdiff_t>(8 + offset));
  };
  write(0x48, "Maker");
  write(0x68, std::string(32, 'M'));
  write(0xd8, "S77");
  return answer;
}

TEST(ReadGvcpDiscovery, ReadsWhoTheDeviceIs) {
  const auto device = read_gvcp_discovery(discovery_answer(), kId);
  ASSERT_TRUE(device);
  EXPECT_EQ(device->name(), "Maker-S77");
  EXPECT_EQ(device->model, std::string(32, 'M'));
}

TEST(ReadGvcpDiscovery, MakesNamesPrintable) {
  auto answer = discovery_answer();
  for (const std::size_t offset : {0x48, 0x68, 0xd8}) {
    answer[8 + offset] = '\n';
    answer[9 + offset] = 0x1b;
    answer[10 + offset] = 0xff;
  }
  const auto device = read_gvcp_discovery(answer, kId);
  ASSERT_TRUE(device);
  for (const std::string& text : {device->vendor, device->model, device->serial}) {
    EXPECT_EQ(text, printable(text));
    EXPECT_EQ(text.find_first_of("\n\x1b\xff"), std::string::npos);
  }
}

TEST(PacketSizeWarning, AsksForNoMtuThatIsThere) {
  HostInterface interface;
  interface.name = "eth1";
  interface.mtu_bytes = 1500;
  EXPECT_THAT(packet_size_warning(1400, interface).advice,
              HasSubstr("set the MTU of eth1, and of every switch, to 9000"));
  EXPECT_THAT(packet_size_warning(1400, std::nullopt).advice, HasSubstr("set the MTU of the interface"));
  interface.mtu_bytes = 9000;
  EXPECT_THAT(packet_size_warning(1400, interface).advice, HasSubstr("eth1 takes 9000: allow 9000 on every switch"));
}

TEST(FragmentsWarning, NamesTheRemedy) {
  HostInterface interface;
  interface.name = "eth1";
  EXPECT_THAT(fragments_warning(9000, interface).advice, HasSubstr("set packet_bytes to 1500 or less, or to 0"));
  EXPECT_THAT(fragments_warning(0, interface).advice, HasSubstr("set packet_bytes to 1500; or set the MTU of eth1"));
  EXPECT_THAT(fragments_warning(0, std::nullopt).advice, HasSubstr("set the MTU of the interface"));
}

TEST(PacketSocketWarning, NamesTheInterface) {
  HostInterface interface;
  interface.name = "eth1";
  EXPECT_THAT(packet_socket_warning(interface).advice, HasSubstr("other devices keep sending on eth1,"));
  EXPECT_THAT(packet_socket_warning(std::nullopt).advice, HasSubstr("other devices keep sending on the interface,"));
}

TEST(ReadGvcpDiscovery, RefusesOtherAnswers) {
  for (const std::size_t place : {0, 1, 2, 3, 6, 7}) {
    auto answer = discovery_answer();
    answer[place] = 0x80;
    EXPECT_FALSE(read_gvcp_discovery(answer, kId));
  }
  auto short_one = discovery_answer();
  short_one.pop_back();
  EXPECT_FALSE(read_gvcp_discovery(short_one, kId));
}

RC_GTEST_PROP(ReadGvcpDiscovery, TakesAnyBytes, (std::vector<std::uint8_t> bytes)) {
  bytes.resize(bytes.size() % 600);
  RC_ASSERT(!read_gvcp_discovery(bytes, 0) || bytes.size() >= 256);
  RC_ASSERT(!read_gvcp_value(bytes, 0) || bytes.size() >= 12);
}

TEST(ReadGvcpValue, ReadsTheMostSignificantByteFirst) {
  const std::vector<std::uint8_t> answer{0, 0, 0, 0x81, 0, 4, 0x12, 0x34, 0x12, 0x34, 0x56, 0x78};
  EXPECT_EQ(read_gvcp_value(answer, kId), 0x12345678u);
  EXPECT_EQ(read_gvcp_value(answer, kId + 1), std::nullopt);
}

TEST(GvcpRead, AsksForARegister) {
  EXPECT_THAT(gvcp_read(0xa00, kId), ElementsAre(0x42, 1, 0, 0x80, 0, 4, 0x12, 0x34, 0, 0, 0x0a, 0));
}

// Aravis sends a command again whose answer it does not hear within half a second: two triggers would be two frames.
TEST(GigeDouble, DoesOnceWhatIsSentAgainBecauseItsAnswerWasLate) {
  test::RegisterFile registers("DOUBLE-1", 64, 48);
  std::vector<std::uint32_t> written;
  test::ControlEvents events;
  events.written = [&](std::uint32_t address, std::uint32_t) { written.push_back(address); };
  test::ControlPort port(registers, events);
  std::vector<std::uint8_t> command;
  const auto write = [&](std::uint32_t address, std::uint32_t value, std::uint32_t id) {
    test::WireWriter(command).u8(0x42).u8(1).u16(0x82).u16(8).u16(id).u32(address).u32(value);
    return port.answer(command, sockaddr_in{});
  };
  write(test::kControlPrivilege, 2, 1);
  written.clear();
  const auto answer = write(test::kTriggerSoftware, 1, 2);
  EXPECT_EQ(write(test::kTriggerSoftware, 1, 2), answer);
  EXPECT_EQ(written.size(), 1U);
  write(test::kTriggerSoftware, 1, 3);
  EXPECT_EQ(written.size(), 2U);
}

TEST(HostInterface, ReachesTheAddressesOfItsNetwork) {
  const auto address = [](std::uint32_t value) { return in_addr{htonl(value)}; };
  const HostInterface interface { "eth1", address(0x0a000001), address(0xffffff00) };
  EXPECT_TRUE(interface.reaches(address(0x0a0000fe)));
  EXPECT_FALSE(interface.reaches(address(0x0a0001fe)));
  EXPECT_EQ(interface.text(), "eth1 (10.0.0.1/24)");
}

}  // namespace
}  // namespace slsd
