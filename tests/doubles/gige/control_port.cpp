// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/control_port.hpp"

#include <algorithm>
#include <utility>

#include "tests/doubles/gige/wire.hpp"

namespace slsd::test {
namespace {

enum Command : std::uint32_t {
  kDiscovery = 0x0002,
  kPacketResend = 0x0040,
  kReadRegister = 0x0080,
  kAction = 0x0100,
  kWriteRegister = 0x0082,
  kReadMemory = 0x0084,
  kWriteMemory = 0x0086,
};
constexpr std::uint32_t kScheduled = 0x80;
constexpr std::uint32_t kCommandKey = 0x42;
constexpr std::uint32_t kAccessDenied = 0x8006;
constexpr std::uint32_t kNoSuchAddress = 0x8003;
constexpr std::uint32_t kNoSuchCommand = 0x8001;
constexpr std::size_t kDiscoveryBytes = 0xf8;

/// An acknowledgement carries the command's number plus one.
WireWriter acknowledge(std::vector<std::uint8_t>& answer, std::uint32_t status, std::uint32_t command,
                       std::uint32_t bytes, std::uint32_t id) {
  WireWriter writer(answer);
  writer.u16(status).u16(command + 1).u16(bytes).u16(id);
  return writer;
}

bool same(const sockaddr_in& a, const sockaddr_in& b) {
  return a.sin_addr.s_addr == b.sin_addr.s_addr && a.sin_port == b.sin_port;
}

}  // namespace

ControlPort::ControlPort(RegisterFile& registers, ControlEvents events)
    : registers_(registers), events_(std::move(events)) {}

bool ControlPort::is_sent_again(std::uint32_t id, const sockaddr_in& from) const {
  return written_ && written_->id == id && same(written_->from, from);
}

bool ControlPort::may_write(std::uint32_t address, const sockaddr_in& from) const {
  if (occupied_) return false;
  return controller_ ? same(*controller_, from) : address == kControlPrivilege;
}

const std::vector<std::uint8_t>& ControlPort::answer(std::span<const std::uint8_t> command, const sockaddr_in& from) {
  answer_.clear();
  WireReader reader(command);
  if (command.size() < 8 || reader.u8() != kCommandKey) return answer_;
  const std::uint32_t flags = reader.u8();
  const std::uint32_t what = reader.u16();
  reader.u16();
  const std::uint32_t id = reader.u16();
  if (controller_ && same(*controller_, from)) heard_ = std::chrono::steady_clock::now();
  if (what == kDiscovery)
    answer_read(what, id, 0, kDiscoveryBytes);
  else if (what == kPacketResend)
    ask_resend(reader.rest());
  else if (what == kAction)
    act((flags & kScheduled) != 0, reader.rest());
  else if (what == kReadRegister)
    acknowledge(answer_, 0, what, 4, id).u32(registers_.read(reader.u32()));
  else if (what == kReadMemory)
    answer_read_memory(id, reader.rest());
  else if (what != kWriteRegister && what != kWriteMemory)
    acknowledge(answer_, kNoSuchCommand, what, 0, id);
  else if (is_sent_again(id, from))
    answer_ = answer_to_written_;
  else
    answer_write(what, id, reader.rest(), from);
  return answer_;
}

void ControlPort::answer_read(std::uint32_t what, std::uint32_t id, std::uint32_t address, std::size_t bytes) {
  block_.resize(bytes);
  (void)registers_.read_bytes(address, block_);
  acknowledge(answer_, 0, what, static_cast<std::uint32_t>(bytes), id).bytes(block_);
}

void ControlPort::answer_read_memory(std::uint32_t id, std::span<const std::uint8_t> body) {
  WireReader reader(body);
  const std::uint32_t address = reader.u32();
  block_.resize(reader.u32() & 0xffff);
  const bool there = registers_.read_bytes(address, block_);
  const auto bytes = static_cast<std::uint32_t>(4 + block_.size());
  acknowledge(answer_, there ? 0 : kNoSuchAddress, kReadMemory, bytes, id).u32(address).bytes(block_);
}

void ControlPort::answer_write(std::uint32_t what, std::uint32_t id, std::span<const std::uint8_t> body,
                               const sockaddr_in& from) {
  WireReader reader(body);
  const std::uint32_t address = reader.u32();
  const bool allowed = may_write(address, from);
  const bool there = allowed && write_block(address, reader.rest(), from);
  acknowledge(answer_, !allowed ? kAccessDenied : (there ? 0 : kNoSuchAddress), what, 4, id).u16(0).u16(there ? 1 : 0);
  written_ = {id, from};
  answer_to_written_ = answer_;
}

void ControlPort::act(bool scheduled, std::span<const std::uint8_t> body) {
  ++actions_.received;
  if (scheduled) ++actions_.scheduled;
  WireReader reader(body);
  const bool device = reader.u32() == registers_.read(kActionDeviceKey);
  const bool group = reader.u32() == registers_.read(kActionGroupKey);
  if (!device || !group || (reader.u32() & registers_.read(kActionGroupMask)) == 0) return;
  std::optional<std::uint64_t> ticks;
  if (scheduled) ticks = std::uint64_t{reader.u32()} << 32;
  if (ticks) *ticks |= reader.u32();
  events_.action(ticks);
}

void ControlPort::ask_resend(std::span<const std::uint8_t> body) {
  WireReader reader(body);
  const std::uint32_t frame = reader.u32() & 0xffff;
  const std::uint32_t first = reader.u32() & 0xffffff;
  events_.resend_asked(static_cast<std::uint16_t>(frame), first, reader.u32() & 0xffffff);
}

void ControlPort::write(std::uint32_t address, std::uint32_t value, const sockaddr_in& from) {
  if (address == kControlPrivilege && value == 0) return release();
  registers_.write(address, value);
  if (address == kControlPrivilege && !controller_) {
    controller_ = from;
    registers_.write(kControllerPort, ntohs(from.sin_port));
    registers_.write(kControllerAddress, ntohl(from.sin_addr.s_addr));
    heard_ = std::chrono::steady_clock::now();
    ++times_taken_;
  }
  events_.written(address, value);
}

// Aravis writes a feature's register as memory.
bool ControlPort::write_block(std::uint32_t address, std::span<const std::uint8_t> block, const sockaddr_in& from) {
  if (block.size() != 4) return registers_.write_bytes(address, block);
  write(address, WireReader(block).u32(), from);
  return true;
}

void ControlPort::release() {
  controller_.reset();
  for (const auto address : {kControlPrivilege, kControllerPort, kControllerAddress}) registers_.write(address, 0);
  events_.controller_left();
}

void ControlPort::expire_controller() {
  const std::chrono::milliseconds allowed(registers_.read(kHeartbeatTimeoutMs));
  if (controller_ && std::chrono::steady_clock::now() - heard_ > allowed) release();
}

void ControlPort::occupy(bool by_another) {
  if (controller_) release();
  occupied_ = by_another;
  registers_.write(kControlPrivilege, by_another ? 2 : 0);
}

}  // namespace slsd::test
