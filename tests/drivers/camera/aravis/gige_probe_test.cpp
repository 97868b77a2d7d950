// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/gige/gige_discovery.hpp"

#include <sys/socket.h>
#include <unistd.h>
#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/doubles/gige/device_socket.hpp"
#include "tests/doubles/gige/register_file.hpp"
#include "tests/doubles/gige/wire.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;

/// A device whose registers can be read, and which answers each question after the answer to the one before, once more.
class LateDevice {
 public:
  LateDevice() : socket_(test::bind_control_port(address_)) {
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~LateDevice() {
    thread_.request_stop();
    thread_.join();
    if (socket_ >= 0) ::close(socket_);
  }
  LateDevice(const LateDevice&) = delete;
  LateDevice& operator=(const LateDevice&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  static std::uint32_t value_of(std::uint32_t address) {
    if (address == test::kControlPrivilege) return 2;
    return address == test::kControllerAddress ? 0x0a000005 : 4711;
  }

  void run(const std::stop_token& stop) {
    std::array<std::uint8_t, 64> question{};
    std::vector<std::uint8_t> answer;
    while (!stop.stop_requested()) {
      sockaddr_in from{};
      socklen_t from_bytes = sizeof(from);
      auto* const asker = reinterpret_cast<sockaddr*>(&from);
      const auto bytes = ::recvfrom(socket_, question.data(), question.size(), MSG_DONTWAIT, asker, &from_bytes);
      if (bytes < 12) {
        std::this_thread::sleep_for(1ms);
        continue;
      }
      const auto send = [&] { ::sendto(socket_, answer.data(), answer.size(), 0, asker, from_bytes); };
      if (!answer.empty()) send();
      test::WireReader reader{std::span(question).subspan(6)};
      const std::uint32_t id = reader.u16();
      answer.clear();
      test::WireWriter(answer).u16(0).u16(0x81).u16(4).u16(id).u32(value_of(reader.u32()));
      send();
    }
  }

  std::string address_;
  int socket_;
  std::jthread thread_;
};

TEST(GigeController, TakesNoAnswerForThatToTheNextQuestion) {
  const LateDevice device;
  GigeDevice asked;
  asked.address = device.address();
  EXPECT_EQ(gige_controller(asked, 30s), "10.0.0.5:4711");
}

}  // namespace
}  // namespace slsd
