// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "core/result.hpp"
#include "drivers/files/read_image.hpp"

namespace slsd {

/// The images of a folder, or one image, in the byte order of their names. Keeps decoded images up to the cache's size:
/// the first ones, because in a cycle the most recent image is needed last.
/// @thread thread-bound
class ImageFolder {
 public:
  /// Lists the images and starts from the first.
  /// @errors kNotFound (path, or no image in it), kPermissionDenied, kIo
  [[nodiscard]] Result<> open(const std::filesystem::path& path, const ReadImageOptions& options,
                              std::size_t cache_bytes);

  [[nodiscard]] std::size_t size() const { return images_.size(); }

  /// The i-th image as currently on disk; valid until the next call.
  /// @errors as read_image(); kDisconnected if the folder itself or the image is gone
  [[nodiscard]] Result<const GreyImage*> image(std::size_t i);
  /// Reads the colours of the i-th image, as then on disk, whenever it is called: see read_colours().
  [[nodiscard]] std::function<Result<ColourFrame>()> colours(std::size_t i) const {
    return [path = images_[i].path, options = options_] { return read_colours(path, options); };
  }

 private:
  /// Distinguishes a file from an earlier one at the same path.
  struct Version {
    std::uint64_t node = 0;
    std::int64_t bytes = 0;
    std::int64_t modified_ns = 0;
    friend bool operator==(const Version&, const Version&) = default;
  };
  struct Entry {
    std::filesystem::path path;
    Version version;
    std::optional<GreyImage> decoded;
  };

  [[nodiscard]] static std::optional<Version> version_of(const std::filesystem::path& path);
  [[nodiscard]] Result<> list_folder();
  [[nodiscard]] Result<const GreyImage*> decode(Entry& entry, const Version& version);

  std::filesystem::path path_;
  ReadImageOptions options_;
  std::size_t cache_left_bytes_ = 0;
  std::vector<Entry> images_;
  GreyImage uncached_;
};

}  // namespace slsd
