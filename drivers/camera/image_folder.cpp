// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/image_folder.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>

#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 8> kExtensions{".png", ".tif", ".tiff", ".pgm", ".ppm", ".pnm", ".jpg", ".jpeg"};

bool is_image_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool hidden = path.filename().string().starts_with('.');
  return !hidden && std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

std::size_t bytes_of(const GreyImage& image) {
  return std::visit([](const auto& pixels) { return pixels.size() * sizeof(*pixels.data()); }, image);
}

}  // namespace

Result<> ImageFolder::open(const fs::path& path, const ReadImageOptions& options, std::size_t cache_bytes) {
  path_ = path;
  options_ = options;
  cache_left_bytes_ = cache_bytes;
  images_.clear();
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (error) return fail_system(error.value(), "cannot read", path);
  if (fs::is_directory(status)) return list_folder();
  images_.push_back({path, {}, std::nullopt});
  return {};
}

Result<> ImageFolder::list_folder() {
  std::error_code error;
  for (fs::directory_iterator it(path_, error), end; !error && it != end; it.increment(error)) {
    std::error_code ignored;
    if (is_image_name(it->path()) && !it->is_directory(ignored)) images_.push_back({it->path(), {}, std::nullopt});
  }
  if (error) return fail_system(error.value(), "cannot list", path_);
  if (images_.empty())
    return fail(ErrorCode::kNotFound,
                "this folder has no PNG, TIFF, PGM, PPM or JPEG image; record some, or check the path", path_.string());
  std::sort(images_.begin(), images_.end(),
            [](const Entry& a, const Entry& b) { return a.path.native() < b.path.native(); });
  return {};
}

Result<const GreyImage*> ImageFolder::image(std::size_t i) {
  Entry& entry = images_[i];
  const auto version = version_of(entry.path);
  const bool gone = !version && (errno == ENOENT || errno == ENOTDIR);
  if (!version && !version_of(path_)) return fail(ErrorCode::kDisconnected, "is gone; put it back", path_.string());
  // Its images may have been replaced by others.
  if (gone) return fail(ErrorCode::kDisconnected, "is gone; the folder is listed again", entry.path.string());
  if (entry.decoded && version == entry.version) return &*entry.decoded;
  return decode(entry, version.value_or(Version{}));
}

Result<const GreyImage*> ImageFolder::decode(Entry& entry, const Version& version) {
  if (entry.decoded) cache_left_bytes_ += bytes_of(*entry.decoded);
  entry.decoded.reset();
  auto image = read_image(entry.path, options_);
  if (!image) return tl::unexpected(std::move(image.error()));
  const std::size_t bytes = bytes_of(*image);
  if (bytes > cache_left_bytes_) return &(uncached_ = std::move(*image));
  cache_left_bytes_ -= bytes;
  entry.version = version;
  return &entry.decoded.emplace(std::move(*image));
}

std::optional<ImageFolder::Version> ImageFolder::version_of(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  const std::int64_t seconds = status.st_mtim.tv_sec;
  return Version{status.st_ino, status.st_size, seconds * 1'000'000'000 + status.st_mtim.tv_nsec};
}

}  // namespace slsd
