// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>

struct _ArvFakeCamera;

namespace slsd::test {

/// Where the registers are that the double acts on: the bootstrap registers of GigE Vision, and those that camera.xml
/// names.
enum Register : std::uint32_t {
  kCurrentAddress = 0x24,
  kDescriptionUrl = 0x200,
  kWidth = 0x100,
  kHeight = 0x104,
  kSensorHeight = 0x118,
  kSensorWidth = 0x11c,
  kAcquisition = 0x124,
  kPixelFormat = 0x128,
  kFramePeriodUs = 0x138,
  kTriggerMode = 0x300,
  kTriggerSource = 0x304,
  kTriggerSoftware = 0x30c,
  kCapability = 0x934,
  kHeartbeatTimeoutMs = 0x938,
  kTickFrequencyHigh = 0x93c,
  kTickFrequencyLow = 0x940,
  kTimestampControl = 0x944,
  kTimestampHigh = 0x948,
  kTimestampLow = 0x94c,
  kControlPrivilege = 0xa00,
  kControllerPort = 0xa04,
  kControllerAddress = 0xa14,
  kStreamPort = 0xd00,
  kStreamPacketSize = 0xd04,
  kStreamPacketDelay = 0xd08,
  kStreamAddress = 0xd18,
  kExposureTime = 0x8000,  ///< double, microseconds
  kGain = 0x8008,          ///< double, decibels
  kExposureAuto = 0x8010,
  kGainAuto = 0x8014,
  kActionDeviceKey = 0x8024,
  kActionGroupKey = 0x8028,
  kActionGroupMask = 0x802c,
  kPtpEnable = 0x8030,
  kChunkMode = 0x8034,
  kHasChunks = 0x803c,
  kChunkImageEnable = 0x8040,
  kChunkTimestampEnable = 0x8044,
  kChunkExposureTimeEnable = 0x8048,
  kChunkGainEnable = 0x804c,
  kHasSoftwareTrigger = 0x8050,
  kPtpStatus = 0x8054,
};

/// The memory of a GigE Vision device: Aravis' register file, with the description in camera.xml.
/// @thread thread-bound
class RegisterFile {
 public:
  /// @param serial  at most 15 letters
  RegisterFile(const std::string& serial, int width_px, int height_px);
  ~RegisterFile();
  RegisterFile(const RegisterFile&) = delete;
  RegisterFile& operator=(const RegisterFile&) = delete;

  [[nodiscard]] std::uint32_t read(std::uint32_t address) const;
  [[nodiscard]] double read_double(std::uint32_t address) const;
  void write(std::uint32_t address, std::uint32_t value);
  void write_double(std::uint32_t address, double value);

  /// @return false where there is no such memory
  [[nodiscard]] bool read_bytes(std::uint32_t address, std::span<std::uint8_t> bytes) const;
  [[nodiscard]] bool write_bytes(std::uint32_t address, std::span<const std::uint8_t> bytes);
  /// From now on the register keeps its value, whatever is written.
  void hold(std::uint32_t address) { held_.insert(address); }

 private:
  _ArvFakeCamera* camera_;
  std::size_t description_bytes_ = 0;
  std::set<std::uint32_t> held_;
};

}  // namespace slsd::test
