// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "slsd/connection.hpp"

namespace slsd::client {

/// The fields of every point.
struct Point {
  float x, y, z;           ///< mm, rig frame: x right, y down, z forward
  float sigma_mm;          ///< one standard deviation along the ray
  std::uint8_t intensity;  ///< 0 to 255
  std::uint8_t camera;
};

/// A field of a cloud's records.
struct Field {
  std::string name;
  std::size_t offset;
  std::size_t size;
  char kind;  ///< 'f' floating point, 'i' signed, 'u' unsigned
};

/// One field of all points, without a copy. Valid as long as the cloud or a copy of it.
template <class T>
class Column {
 public:
  Column(const char* first, std::size_t step, std::size_t size) : first_(first), step_(step), size_(size) {}
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] T operator[](std::size_t i) const {
    T value;
    std::memcpy(&value, first_ + i * step_, sizeof value);
    return value;
  }

 private:
  const char* first_;
  std::size_t step_, size_;
};

/// A frame of a camera: `height_px` rows of `width_px` pixels of 8 or 16 bits.
struct Frame {
  int width_px = 0;
  int height_px = 0;
  int bits = 8;
  Bytes pixels;
  std::string description;  ///< the service's description of the frame, as JSON

  [[nodiscard]] unsigned at(int x, int y) const {
    const std::size_t i =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x);
    if (bits <= 8) return static_cast<unsigned char>(pixels.data()[i]);
    std::uint16_t value;
    std::memcpy(&value, pixels.data() + 2 * i, sizeof value);
    return value;
  }
};

/// One scan. The points stay in the received records; copies of a cloud share them.
/// @thread reentrant
class Cloud {
 public:
  /// Reads the cloud in the bytes of a binary little-endian PLY file.
  /// @param description  the service's description of the scan, as JSON
  /// @throws ProtocolError: the header does not match the data
  [[nodiscard]] static Cloud read_ply(Bytes ply, std::string description = "{}");

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] Point operator[](std::size_t i) const {
    const char* record = records_ + i * record_bytes_;
    Point point{};
    std::memcpy(&point.x, record + x_, sizeof point.x);
    std::memcpy(&point.y, record + y_, sizeof point.y);
    std::memcpy(&point.z, record + z_, sizeof point.z);
    if (sigma_mm_) std::memcpy(&point.sigma_mm, record + *sigma_mm_, sizeof point.sigma_mm);
    if (intensity_) std::memcpy(&point.intensity, record + *intensity_, sizeof point.intensity);
    if (camera_) std::memcpy(&point.camera, record + *camera_, sizeof point.camera);
    return point;
  }

  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = Point;
    using difference_type = std::ptrdiff_t;
    using pointer = void;
    using reference = Point;
    Iterator(const Cloud& cloud, std::size_t i) : cloud_(&cloud), i_(i) {}
    Point operator*() const { return (*cloud_)[i_]; }
    Iterator& operator++() { return ++i_, *this; }
    Iterator operator++(int) { return {*cloud_, i_++}; }
    bool operator==(const Iterator& other) const { return i_ == other.i_; }
    bool operator!=(const Iterator& other) const { return i_ != other.i_; }

   private:
    const Cloud* cloud_;
    std::size_t i_;
  };
  [[nodiscard]] Iterator begin() const { return {*this, 0}; }
  [[nodiscard]] Iterator end() const { return {*this, size_}; }

  /// The records' fields. Clouds of symbols also have camera_u camera_v projector_u projector_v (px), symbol, column,
  /// row; clouds with normals have nx ny nz; coloured ones have red green blue (bytes).
  [[nodiscard]] const std::vector<Field>& fields() const { return fields_; }
  [[nodiscard]] bool has(std::string_view field) const { return find(field) != nullptr; }

  /// One field of all points.
  /// @throws std::invalid_argument: no field of this name, or another type than T
  template <class T>
  [[nodiscard]] Column<T> column(std::string_view name) const {
    const Field* field = find(name);
    const char kind = std::is_floating_point<T>::value ? 'f' : std::is_signed<T>::value ? 'i' : 'u';
    if (!field || field->size != sizeof(T) || field->kind != kind) {
      throw std::invalid_argument("the cloud has no field \"" + std::string(name) + "\" of this type");
    }
    return {records_ + field->offset, record_bytes_, size_};
  }

  [[nodiscard]] const char* records() const { return records_; }
  [[nodiscard]] std::size_t record_bytes() const { return record_bytes_; }
  /// The whole file.
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }
  /// The comments of the header, by their first word: scan_id, time, units, ...
  [[nodiscard]] const std::map<std::string, std::string>& comments() const { return comments_; }

  std::string description = "{}";  ///< the service's description of the scan, as JSON: docs/protocol.md
  std::string scan;                ///< the scan's id
  std::string why_empty;           ///< why there are no points, in words; empty: there are some
  std::uint64_t lost = 0;  ///< clouds that a stream lost since the previous one because the client read too slowly
  std::optional<double> sigma_calibration_mm;        ///< depth error from the calibration alone, common to all points
  std::chrono::steady_clock::time_point received{};  ///< time when the last byte of the frames arrived
  Bytes picture;                                     ///< a PNG, if requested
  std::vector<Frame> frames;                         ///< if requested

 private:
  [[nodiscard]] const Field* find(std::string_view name) const;

  Bytes bytes_;
  std::map<std::string, std::string> comments_;
  std::vector<Field> fields_;
  const char* records_ = nullptr;
  std::size_t record_bytes_ = 0, size_ = 0;
  std::size_t x_ = 0, y_ = 0, z_ = 0;
  std::optional<std::size_t> sigma_mm_, intensity_, camera_;
};

}  // namespace slsd::client
