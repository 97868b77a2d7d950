// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/gige/register_file.hpp"

#include <array>
#include <bit>
#include <cstdlib>
#include <cstring>

#include <arv.h>

namespace slsd::test {
namespace {

// The program may run where the sources are not.
const char* description_file() {
  const char* elsewhere = std::getenv("SLSD_GIGE_DESCRIPTION");
  return elsewhere != nullptr ? elsewhere : SLSD_SOURCE_DIR "/tests/doubles/gige/camera.xml";
}

constexpr std::uint32_t kResendAndWriteMemory = 1u << 2 | 1u << 1;
constexpr std::uint32_t kPacketBytes = 1400;

}  // namespace

RegisterFile::RegisterFile(const std::string& serial, int width_px, int height_px)
    : camera_(arv_fake_camera_new_full(serial.c_str(), description_file())) {
  arv_fake_camera_get_genicam_xml(camera_, &description_bytes_);
  for (const auto address : {kSensorWidth, kWidth}) write(address, static_cast<std::uint32_t>(width_px));
  for (const auto address : {kSensorHeight, kHeight}) write(address, static_cast<std::uint32_t>(height_px));
  write(kCapability, kResendAndWriteMemory);
  write(kStreamPacketSize, kPacketBytes);
  // As cameras are delivered: everything automatic, and settings that nobody asked for.
  write(kExposureAuto, 2);
  write(kGainAuto, 2);
  write_double(kExposureTime, 123.0);
  write_double(kGain, 7.0);
  write(kChunkImageEnable, 1);
}

RegisterFile::~RegisterFile() {
  g_object_unref(camera_);
}

std::uint32_t RegisterFile::read(std::uint32_t address) const {
  guint32 value = 0;
  arv_fake_camera_read_register(camera_, address, &value);
  return value;
}

double RegisterFile::read_double(std::uint32_t address) const {
  return std::bit_cast<double>(static_cast<std::uint64_t>(read(address)) << 32 | read(address + 4));
}

void RegisterFile::write(std::uint32_t address, std::uint32_t value) {
  if (!held_.contains(address)) arv_fake_camera_write_register(camera_, address, value);
}

void RegisterFile::write_double(std::uint32_t address, double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  write(address, static_cast<std::uint32_t>(bits >> 32));
  write(address + 4, static_cast<std::uint32_t>(bits));
}

bool RegisterFile::read_bytes(std::uint32_t address, std::span<std::uint8_t> bytes) const {
  const std::uint64_t end = std::uint64_t{address} + bytes.size();
  std::memset(bytes.data(), 0, bytes.size());
  if (address < ARV_FAKE_CAMERA_MEMORY_SIZE && end >= ARV_FAKE_CAMERA_MEMORY_SIZE) return false;
  // The last block of the description is asked for in whole words.
  if (address >= ARV_FAKE_CAMERA_MEMORY_SIZE + description_bytes_) return false;
  return arv_fake_camera_read_memory(camera_, address, static_cast<guint32>(bytes.size()), bytes.data());
}

bool RegisterFile::write_bytes(std::uint32_t address, std::span<const std::uint8_t> bytes) {
  if (std::uint64_t{address} + bytes.size() >= ARV_FAKE_CAMERA_MEMORY_SIZE) return false;
  if (held_.contains(address)) return true;
  return arv_fake_camera_write_memory(camera_, address, static_cast<guint32>(bytes.size()), bytes.data());
}

}  // namespace slsd::test
