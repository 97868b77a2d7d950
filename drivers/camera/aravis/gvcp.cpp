// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/gvcp.hpp"

#include <algorithm>
#include <cstddef>

#include "core/printable.hpp"

namespace slsd {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kKey = 0x42;
constexpr std::uint8_t kAnswerWanted = 0x01;
constexpr std::uint8_t kMayBroadcast = 0x10;  // without it, a device in another network cannot answer
constexpr std::uint8_t kDiscovery = 0x02;
constexpr std::uint8_t kAction = 0x01;  // 0x0100
constexpr std::uint8_t kScheduled = 0x80;
constexpr std::uint8_t kReadRegister = 0x80;
constexpr std::uint8_t kActionId = 1;  // actions get no answer
constexpr std::size_t kHeaderBytes = 8;
constexpr std::size_t kDiscoveryBytes = 0xf8;
constexpr std::size_t kVendorAt = 0x48;
constexpr std::size_t kModelAt = 0x68;
constexpr std::size_t kSerialAt = 0xd8;

std::uint8_t high(std::uint16_t id) {
  return static_cast<std::uint8_t>(id >> 8);
}

std::uint8_t low(std::uint16_t id) {
  return static_cast<std::uint8_t>(id);
}

/// The data of a successful answer to the command of this id; empty for anything else.
Bytes data_of(Bytes answer, std::uint8_t command, std::uint16_t id, std::size_t bytes) {
  if (answer.size() < kHeaderBytes + bytes) return {};
  const bool right = answer[0] == 0 && answer[1] == 0 && answer[2] == 0 && answer[3] == command + 1 &&
                     answer[6] == high(id) && answer[7] == low(id);
  return right ? answer.subspan(kHeaderBytes) : Bytes();
}

std::string text_at(Bytes data, std::size_t offset, std::size_t bytes) {
  const auto field = data.subspan(offset, bytes);
  return printable({reinterpret_cast<const char*>(field.data()),
                    static_cast<std::size_t>(std::ranges::find(field, 0) - field.begin())});
}

}  // namespace

std::array<std::uint8_t, 8> gvcp_discovery(std::uint16_t id) {
  return {kKey, kAnswerWanted | kMayBroadcast, 0, kDiscovery, 0, 0, high(id), low(id)};
}

std::optional<GigeDevice> read_gvcp_discovery(Bytes answer, std::uint16_t id) {
  const Bytes data = data_of(answer, kDiscovery, id, kDiscoveryBytes);
  if (data.empty()) return std::nullopt;
  return GigeDevice{{}, {}, text_at(data, kVendorAt, 32), text_at(data, kModelAt, 32), text_at(data, kSerialAt, 16)};
}

std::array<std::uint8_t, 12> gvcp_read(std::uint32_t address, std::uint16_t id) {
  return {kKey,
          kAnswerWanted,
          0,
          kReadRegister,
          0,
          4,
          high(id),
          low(id),
          static_cast<std::uint8_t>(address >> 24),
          static_cast<std::uint8_t>(address >> 16),
          static_cast<std::uint8_t>(address >> 8),
          static_cast<std::uint8_t>(address)};
}

std::vector<std::uint8_t> gvcp_action(const ActionKeys& keys, std::optional<std::uint64_t> ticks) {
  const std::uint8_t bytes = ticks ? 20 : 12;
  std::vector<std::uint8_t> command{kKey, ticks ? kScheduled : std::uint8_t{0}, kAction, 0, 0, bytes, 0, kActionId};
  const auto write = [&](std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) command.push_back(static_cast<std::uint8_t>(value >> shift));
  };
  for (const std::uint32_t word : {keys.device_key, keys.group_key, keys.group_mask}) write(word);
  if (ticks) write(static_cast<std::uint32_t>(*ticks >> 32)), write(static_cast<std::uint32_t>(*ticks));
  return command;
}

std::optional<std::uint32_t> read_gvcp_value(Bytes answer, std::uint16_t id) {
  const Bytes data = data_of(answer, kReadRegister, id, 4);
  if (data.empty()) return std::nullopt;
  return std::uint32_t{data[0]} << 24 | std::uint32_t{data[1]} << 16 | std::uint32_t{data[2]} << 8 | data[3];
}

}  // namespace slsd
