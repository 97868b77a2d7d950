// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "core/cloud/pcd.hpp"
#include "core/cloud/ply.hpp"

namespace slsd {

enum class CloudFormat { kPly, kPcd };

[[nodiscard]] inline std::string_view to_string(CloudFormat format) {
  return format == CloudFormat::kPly ? "ply" : "pcd";
}
[[nodiscard]] inline CloudFormat cloud_format(std::string_view name) {
  return name == "pcd" ? CloudFormat::kPcd : CloudFormat::kPly;
}

/// The formats that somebody wants a cloud in.
struct CloudFormats {
  bool ply = false;
  bool pcd = false;

  [[nodiscard]] static CloudFormats only(CloudFormat format) {
    return {format == CloudFormat::kPly, format == CloudFormat::kPcd};
  }
  friend CloudFormats operator|(CloudFormats a, CloudFormats b) { return {a.ply || b.ply, a.pcd || b.pcd}; }
  friend bool operator==(CloudFormats, CloudFormats) = default;
};

/// Bytes that may go to several clients, which send them at their own pace: hence shared.
using SharedBytes = std::shared_ptr<const std::string>;

/// A cloud's files, each written once.
/// @thread thread-bound; the bytes are read from any
class CloudFiles {
 public:
  CloudFiles() = default;
  CloudFiles(const Cloud& cloud, CloudFormats formats) {
    if (formats.ply) (void)file(cloud, CloudFormat::kPly);
    if (formats.pcd) (void)file(cloud, CloudFormat::kPcd);
  }

  /// Writes it where it is not there yet. @param cloud  the same as before
  [[nodiscard]] const SharedBytes& file(const Cloud& cloud, CloudFormat format) {
    SharedBytes& bytes = format == CloudFormat::kPly ? ply_ : pcd_;
    if (!bytes) {
      bytes = std::make_shared<const std::string>(format == CloudFormat::kPly ? write_ply(cloud) : write_pcd(cloud));
    }
    return bytes;
  }

  [[nodiscard]] std::size_t bytes() const { return (ply_ ? ply_->size() : 0) + (pcd_ ? pcd_->size() : 0); }

 private:
  SharedBytes ply_;
  SharedBytes pcd_;
};

}  // namespace slsd
