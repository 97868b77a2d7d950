// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/v4l2/double_device.hpp"

#include <sys/poll.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "tests/doubles/v4l2/encode_frame.hpp"

namespace slsd::test {
namespace {

v4l2_fract seconds_per_frame(double rate_hz) {
  return {1000, static_cast<__u32>(std::lround(1000 * rate_hz))};
}

template <class T>
T& as(void* argument) {
  return *static_cast<T*>(argument);
}

}  // namespace

DoubleDevice::DoubleDevice(const DoubleOptions& options, std::atomic<std::uint64_t>& numbers, Hooks hooks)
    : options_(options),
      numbers_(numbers),
      hooks_(std::move(hooks)),
      controls_(options.controls),
      fourcc_(options.formats.front().fourcc),
      size_(options.formats.front().sizes.front()),
      rate_hz_(options.rates_hz.front()) {
  for (const std::uint32_t id : options.refused_controls) controls_.refuse(id);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

DoubleDevice::~DoubleDevice() = default;

int DoubleDevice::ioctl(Owner owner, unsigned command, void* argument, pid_t caller) {
  const std::lock_guard lock(mutex_);
  if (!present_) return ENODEV;
  switch (command) {
    case VIDIOC_REQBUFS:
      return request_buffers(owner, as<v4l2_requestbuffers>(argument));
    case VIDIOC_QUERYBUF:
      return describe_buffer(as<v4l2_buffer>(argument));
    case VIDIOC_QBUF:
      return queue(owner, as<v4l2_buffer>(argument));
    case VIDIOC_DQBUF:
      return dequeue(owner, as<v4l2_buffer>(argument));
    case VIDIOC_STREAMON:
      return start(owner);
    case VIDIOC_STREAMOFF:
      return stop(owner);
    case VIDIOC_G_EXT_CTRLS:
      return controls_.get_extended(as<v4l2_ext_controls>(argument), caller);
    case VIDIOC_S_EXT_CTRLS:
      return controls_.set_extended(as<v4l2_ext_controls>(argument), caller);
    default:
      return ioctl_setting(command, argument);
  }
}

int DoubleDevice::ioctl_setting(unsigned command, void* argument) {
  switch (command) {
    case VIDIOC_QUERYCAP:
      return query_capability(as<v4l2_capability>(argument));
    case VIDIOC_ENUM_FMT:
      return enumerate_format(as<v4l2_fmtdesc>(argument));
    case VIDIOC_ENUM_FRAMESIZES:
      return enumerate_size(as<v4l2_frmsizeenum>(argument));
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return enumerate_rate(as<v4l2_frmivalenum>(argument));
    case VIDIOC_G_FMT:
      as<v4l2_format>(argument).fmt.pix.pixelformat = fourcc_;
      as<v4l2_format>(argument).fmt.pix.width = static_cast<__u32>(size_.first);
      as<v4l2_format>(argument).fmt.pix.height = static_cast<__u32>(size_.second);
      return try_format(as<v4l2_format>(argument));
    case VIDIOC_TRY_FMT:
      return try_format(as<v4l2_format>(argument));
    case VIDIOC_S_FMT:
      return set_format(as<v4l2_format>(argument));
    case VIDIOC_G_PARM:
    case VIDIOC_S_PARM:
      if (command == VIDIOC_G_PARM) as<v4l2_streamparm>(argument).parm.capture.timeperframe = {};
      return set_rate(as<v4l2_streamparm>(argument));
    case VIDIOC_QUERYCTRL:
      return controls_.query(as<v4l2_queryctrl>(argument));
    case VIDIOC_QUERYMENU:
      return controls_.query_menu(as<v4l2_querymenu>(argument));
    case VIDIOC_QUERY_EXT_CTRL:
      return controls_.query_extended(as<v4l2_query_ext_ctrl>(argument));
    case VIDIOC_G_CTRL:
      return controls_.get(as<v4l2_control>(argument));
    case VIDIOC_S_CTRL:
      return controls_.set(as<v4l2_control>(argument));
    default:
      return ENOTTY;
  }
}

int DoubleDevice::query_capability(v4l2_capability& capability) const {
  capability = {};
  std::snprintf(reinterpret_cast<char*>(capability.driver), sizeof capability.driver, "%s", options_.driver.c_str());
  std::snprintf(reinterpret_cast<char*>(capability.card), sizeof capability.card, "V4L2 double");
  std::snprintf(reinterpret_cast<char*>(capability.bus_info), sizeof capability.bus_info, "platform:double");
  capability.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  capability.capabilities = capability.device_caps | V4L2_CAP_DEVICE_CAPS;
  return 0;
}

int DoubleDevice::enumerate_format(v4l2_fmtdesc& format) const {
  if (format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || format.index >= options_.formats.size()) return EINVAL;
  format.pixelformat = options_.formats[format.index].fourcc;
  format.flags = format.pixelformat == V4L2_PIX_FMT_MJPEG ? V4L2_FMT_FLAG_COMPRESSED : 0;
  std::snprintf(reinterpret_cast<char*>(format.description), sizeof format.description, "format %u", format.index);
  return 0;
}

int DoubleDevice::enumerate_size(v4l2_frmsizeenum& size) const {
  for (const DoubleFormat& format : options_.formats) {
    if (format.fourcc != size.pixel_format || size.index >= format.sizes.size()) continue;
    size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
    size.discrete = {static_cast<__u32>(format.sizes[size.index].first),
                     static_cast<__u32>(format.sizes[size.index].second)};
    return 0;
  }
  return EINVAL;
}

int DoubleDevice::enumerate_rate(v4l2_frmivalenum& rate) const {
  if (rate.index >= options_.rates_hz.size()) return EINVAL;
  rate.type = V4L2_FRMIVAL_TYPE_DISCRETE;
  rate.discrete = seconds_per_frame(options_.rates_hz[rate.index]);
  return 0;
}

// What it lacks becomes what it has first, as in a real driver.
int DoubleDevice::try_format(v4l2_format& format) const {
  if (format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return EINVAL;
  v4l2_pix_format& pixels = format.fmt.pix;
  const DoubleFormat* made = &options_.formats.front();
  for (const DoubleFormat& candidate : options_.formats) {
    if (candidate.fourcc == pixels.pixelformat) made = &candidate;
  }
  const std::pair<int, int> asked(pixels.width, pixels.height);
  const bool has = std::find(made->sizes.begin(), made->sizes.end(), asked) != made->sizes.end();
  const auto size = has ? asked : made->sizes.front();
  pixels = {};
  pixels.pixelformat = made->fourcc;
  pixels.width = static_cast<__u32>(size.first);
  pixels.height = static_cast<__u32>(size.second - (options_.changes_format ? 8 : 0));
  pixels.field = V4L2_FIELD_NONE;
  const int row = row_bytes_of(made->fourcc, size.first);
  pixels.bytesperline = static_cast<__u32>(row > 0 ? row + options_.padding_bytes : 0);
  pixels.sizeimage = static_cast<__u32>(frame_bytes_of(made->fourcc, size.first, size.second, options_.padding_bytes));
  return 0;
}

int DoubleDevice::set_format(v4l2_format& format) {
  if (!buffers_.empty()) return EBUSY;
  if (const int error = try_format(format)) return error;
  fourcc_ = format.fmt.pix.pixelformat;
  size_ = {format.fmt.pix.width, format.fmt.pix.height};
  return 0;
}

int DoubleDevice::set_rate(v4l2_streamparm& parameters) {
  v4l2_captureparm& capture = parameters.parm.capture;
  if (parameters.type != V4L2_BUF_TYPE_VIDEO_CAPTURE) return EINVAL;
  if (capture.timeperframe.numerator != 0 && capture.timeperframe.denominator != 0) {
    const double asked_hz = static_cast<double>(capture.timeperframe.denominator) / capture.timeperframe.numerator;
    rate_hz_ = *std::min_element(options_.rates_hz.begin(), options_.rates_hz.end(), [asked_hz](double a, double b) {
      return std::abs(a - asked_hz) < std::abs(b - asked_hz);
    });
  }
  capture.capability = V4L2_CAP_TIMEPERFRAME;
  capture.timeperframe = seconds_per_frame(rate_hz_);
  return 0;
}

bool DoubleDevice::is_streaming() const {
  const std::lock_guard lock(mutex_);
  return streaming_;
}

std::optional<int> DoubleDevice::control(std::uint32_t id) const {
  const std::lock_guard lock(mutex_);
  return controls_.value(id);
}

unsigned DoubleDevice::poll(Owner owner) const {
  const std::lock_guard lock(mutex_);
  if (!present_) return POLLPRI | POLLERR | POLLHUP;
  if (!streaming_ || owner != owner_) return POLLERR;
  return done_.empty() && faults_.fail_dequeue == 0 ? 0 : POLLIN | POLLRDNORM;
}

std::vector<std::byte> DoubleDevice::read(std::uint64_t offset, std::size_t bytes) const {
  const std::lock_guard lock(mutex_);
  std::vector<std::byte> content(bytes);
  for (const auto& range : ranges_) {
    const std::uint64_t begin = std::max(offset, range->offset);
    const std::uint64_t end = std::min(offset + bytes, range->offset + range->content.size());
    if (begin < end)
      std::memcpy(content.data() + (begin - offset), range->content.data() + (begin - range->offset), end - begin);
  }
  return content;
}

void DoubleDevice::release(Owner owner) {
  const std::lock_guard lock(mutex_);
  if (owner == owner_) {
    end_stream();
    buffers_.clear();
    owner_ = nullptr;
  }
  for (const auto& range : ranges_) {
    if (range->owner == owner) range->owner = nullptr;
  }
}

void DoubleDevice::unplug() {
  {
    const std::lock_guard lock(mutex_);
    present_ = false;
    end_stream();
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
  hooks_.changed();
}

void DoubleDevice::trigger() {
  const std::lock_guard lock(mutex_);
  if (streaming_) ++triggers_;
  changed_.notify_all();
}

void DoubleDevice::inject(const std::function<void(DoubleFaults&)>& change) {
  {
    const std::lock_guard lock(mutex_);
    change(faults_);
    changed_.notify_all();
  }
  hooks_.changed();
}

void DoubleDevice::configure(const std::function<void(DoubleOptions&)>& change) {
  const std::lock_guard lock(mutex_);
  change(options_);
  for (const std::uint32_t id : options_.refused_controls) controls_.refuse(id);
}

}  // namespace slsd::test
