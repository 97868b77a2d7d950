// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/frames/chunk_reader.hpp"

#include <span>

#include "drivers/camera/aravis/frames/frame_chunks.hpp"

namespace slsd {
namespace {

bool is_float(ArvCamera* camera, const char* name) {
  return ARV_IS_GC_FLOAT(arv_device_get_feature(arv_camera_get_device(camera), name));
}

}  // namespace

ChunkReader::ChunkReader(ArvCamera* camera, const ChunkSelection& selection, std::size_t image_bytes,
                         std::chrono::nanoseconds apart_max)
    : parser_(arv_camera_create_chunk_parser(camera)),
      selection_(selection),
      image_bytes_(image_bytes),
      apart_max_(apart_max),
      exposure_time_{"ChunkExposureTime", is_float(camera, "ChunkExposureTime")},
      gain_{"ChunkGain", is_float(camera, "ChunkGain")} {
  if (!arv_camera_is_gv_device(camera)) return;
  GErrorSlot error;
  ArvDevice* device = arv_camera_get_device(camera);
  tick_frequency_hz_ = arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device), error.out());
  order_ = std::endian::big;
}

std::optional<FrameChunks> ChunkReader::read(ArvBuffer* buffer) {
  if (!parser_ || !is_laid_out(buffer)) return std::nullopt;
  FrameChunks chunks;
  if (selection_.exposure_time && !(chunks.exposure_us = value(exposure_time_, buffer))) return std::nullopt;
  if (selection_.gain && !(chunks.gain_db = value(gain_, buffer))) return std::nullopt;
  if (!selection_.timestamp) return chunks;
  const auto stamp = timestamp(buffer);
  if (!stamp) return std::nullopt;
  const std::chrono::nanoseconds frame_stamp(arv_buffer_get_timestamp(buffer));
  chunks.exposure_start = chunk_time(*stamp, frame_stamp, tick_frequency_hz_, apart_max_);
  same_clock_ = same_clock_ || chunks.exposure_start;
  return chunks.exposure_start || !same_clock_ ? std::optional(chunks) : std::nullopt;
}

// Aravis would find chunks in arbitrary bytes.
bool ChunkReader::is_laid_out(ArvBuffer* buffer) const {
  if (!arv_buffer_has_chunks(buffer)) return false;
  std::size_t bytes = 0;
  const auto* frame = static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer, &bytes));
  return is_image_with_chunks(std::span(frame, bytes), image_bytes_, order_);
}

std::optional<std::uint64_t> ChunkReader::timestamp(ArvBuffer* buffer) const {
  GErrorSlot error;
  const gint64 stamp = arv_chunk_parser_get_integer_value(parser_.get(), buffer, "ChunkTimestamp", error.out());
  return error.failed() ? std::nullopt : std::optional(static_cast<std::uint64_t>(stamp));
}

std::optional<double> ChunkReader::value(const Number& number, ArvBuffer* buffer) const {
  GErrorSlot error;
  double value = 0.0;
  if (number.is_float)
    value = arv_chunk_parser_get_float_value(parser_.get(), buffer, number.name, error.out());
  else
    value = static_cast<double>(arv_chunk_parser_get_integer_value(parser_.get(), buffer, number.name, error.out()));
  return error.failed() ? std::nullopt : std::optional(value);
}

}  // namespace slsd
