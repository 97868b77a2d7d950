// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/bundle/bundle_store.hpp"

#include <algorithm>
#include <system_error>
#include <vector>

#include "core/utc_text.hpp"
#include "drivers/files/file.hpp"
#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

namespace fs = std::filesystem;
using std::chrono::system_clock;

constexpr std::size_t kWaysMax = 64;
constexpr std::size_t kWayBytesMax = 80;
constexpr std::string_view kExtension = ".tar";
constexpr std::size_t kTimeBytes = 17;  // "20260131T120000Z-"

// Tells whether the client caused or cancelled the failure. An error about a missing file or device names it in
// `where`; one about an unconfigured camera does not.
bool of_the_client(const Error& error) {
  if (error.code == ErrorCode::kCancelled || error.code == ErrorCode::kBusy) return true;
  return error.where.empty() && (error.code == ErrorCode::kNotFound || error.code == ErrorCode::kInvalidArgument);
}

// "frame_torn-camera_left"
std::string way_of(const Error& error) {
  std::string way = std::string(to_string(error.code)) + (error.where.empty() ? "" : "-" + error.where);
  const auto odd = [](char c) {
    return !((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_');
  };
  std::ranges::replace_if(way, odd, '_');
  return way.substr(0, kWayBytesMax);
}

std::string stamp(system_clock::time_point now) {
  std::string text = utc_text(now);
  std::erase_if(text, [](char c) { return c == '-' || c == ':'; });
  return text;
}

// Our bundles, oldest first: their names begin with the time.
std::vector<fs::path> bundles_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
    const std::string name = each->path().filename().string();
    if (name.size() > kTimeBytes + kExtension.size() && name[0] != '.' && name.ends_with(kExtension))
      files.push_back(each->path());
  }
  std::ranges::sort(files);
  return files;
}

}  // namespace

std::uint64_t BundleStore::written() const {
  const std::lock_guard lock(mutex_);
  return written_;
}

bool BundleStore::claim(const Error& error, system_clock::time_point now) {
  if (folder_.empty() || bytes_max_ == 0 || of_the_client(error)) return false;
  const std::lock_guard lock(mutex_);
  const std::string way = way_of(error);
  if (claimed_.contains(way) || claimed_.size() >= kWaysMax) return false;
  if (last_ && now >= *last_ && now - *last_ < kPause) return false;  // the clock may have been set back
  const std::string ending = "-" + way + std::string(kExtension);
  for (const fs::path& file : bundles_in(folder_)) {
    if (!file.filename().string().ends_with(ending)) continue;
    claimed_.insert(way);
    return false;
  }
  claimed_.insert(way);
  last_ = now;
  return true;
}

Result<fs::path> BundleStore::put(const Error& error, std::string_view bundle, system_clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (bundle.size() > bytes_max_) {
    return fail(
        ErrorCode::kNoSpace,
        "the bundle has " + std::to_string(bundle.size()) + " bytes, more than [black_box] disk_max_mb: raise it",
        folder_.string());
  }
  std::error_code failed;
  if (fs::create_directories(folder_, failed)) {
    fs::permissions(folder_, fs::perms::owner_all, failed);  // pictures may be confidential
  }
  if (failed) return tl::unexpected(system_error(failed.value(), "cannot create the folder", folder_));
  std::vector<fs::path> files = bundles_in(folder_);
  std::uintmax_t bytes = bundle.size();
  for (const fs::path& file : files) {
    const std::uintmax_t size = fs::file_size(file, failed);
    bytes += failed ? 0 : size;
  }
  // Makes room first, so that the limits hold at every moment.
  for (std::size_t i = 0; i < files.size() && (files.size() - i >= kFilesMax || bytes > bytes_max_); ++i) {
    const std::uintmax_t size = fs::file_size(files[i], failed);
    bytes -= failed ? 0 : size;
    fs::remove(files[i], failed);
  }
  const fs::path file = folder_ / (stamp(now) + "-" + way_of(error) + std::string(kExtension));
  if (auto done = write_file_atomically(file, bundle); !done) return tl::unexpected(done.error());
  ++written_;
  return file;
}

}  // namespace slsd
