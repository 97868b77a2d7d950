// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/v4l2/v4l2_device.hpp"

#include <fcntl.h>
#include <libv4l2.h>
#include <linux/videodev2.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/printable.hpp"
#include "drivers/camera/listing/sysfs.hpp"
#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

constexpr SystemErrorMeaning kMeanings[] = {
    {ENOENT, ErrorCode::kNotFound, "plug it in, or correct device"},
    {ENOTDIR, ErrorCode::kNotFound, "plug it in, or correct device"},
    {EACCES, ErrorCode::kPermissionDenied, "add the service's user to the group video"},
    {EPERM, ErrorCode::kPermissionDenied, "add the service's user to the group video"},
    {ENODEV, ErrorCode::kDisconnected, "check its cable; slsd reopens it"},
    {ENXIO, ErrorCode::kDisconnected, "check its cable; slsd reopens it"},
    {ENOTTY, ErrorCode::kUnsupported, "it is not a V4L2 camera; correct device"},
    {0, ErrorCode::kIo, "unplug it and plug it in again"},
};

}  // namespace

std::string device_text(std::span<const unsigned char> field) {
  const auto end = std::ranges::find(field, '\0');
  return printable({reinterpret_cast<const char*>(field.data()), static_cast<std::size_t>(end - field.begin())});
}

std::optional<std::filesystem::path> find_stable_link(const std::filesystem::path& node,
                                                      const std::filesystem::path& devices) {
  const std::filesystem::path links = devices / "v4l/by-id";
  if (node.parent_path() == links) return node;
  std::error_code error;
  for (const std::filesystem::path& link : entries_of(links))
    if (std::filesystem::equivalent(link, node, error)) return link;
  return std::nullopt;
}

V4l2Device::V4l2Device(int descriptor, std::string path) : descriptor_(descriptor), path_(std::move(path)) {}

V4l2Device::V4l2Device(V4l2Device&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      path_(std::move(other.path_)),
      driver_(std::move(other.driver_)),
      card_(std::move(other.card_)) {}

V4l2Device& V4l2Device::operator=(V4l2Device&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(path_, other.path_);
  std::swap(driver_, other.driver_);
  std::swap(card_, other.card_);
  return *this;
}

V4l2Device::~V4l2Device() {
  if (descriptor_ >= 0) v4l2_close(descriptor_);
}

Result<V4l2Device> V4l2Device::open(const std::string& path) {
  V4l2Device device(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC), path);
  if (device.descriptor_ < 0) return device.fail_call(errno, "cannot open the camera");
  v4l2_capability capability{};
  if (const int error = device.call(VIDIOC_QUERYCAP, &capability))
    return device.fail_call(error, "cannot query the device's capabilities");
  const __u32 can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0)
    return fail(ErrorCode::kUnsupported, "the device does not capture video; name another, often the one with index0",
                path);
  device.driver_ = device_text(capability.driver);
  device.card_ = device_text(capability.card);
  if (v4l2_fd_open(device.descriptor_, V4L2_DISABLE_CONVERSION) < 0)
    return device.fail_call(errno, "libv4l2 cannot open the camera");
  return device;
}

int V4l2Device::call(unsigned long request, void* argument) const {
  int result = 0;
  do {
    result = v4l2_ioctl(descriptor_, request, argument);
  } while (result < 0 && errno == EINTR);
  return result < 0 ? errno : 0;
}

tl::unexpected<Error> V4l2Device::fail_call(int error_number, const std::string& doing) const {
  return fail_system(error_number, doing, path_, kMeanings);
}

}  // namespace slsd
