// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/v4l2/v4l2_double.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>

namespace slsd::test {

Result<std::unique_ptr<V4l2Double>> V4l2Double::create(DoubleOptions options) {
  std::unique_ptr<V4l2Double> made(new V4l2Double(std::move(options)));
  std::string folder = std::filesystem::temp_directory_path() / "v4l2-double-XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) return fail(ErrorCode::kIo, "cannot make a folder", folder);
  made->folder_ = folder;
  auto file = FuseFile::mount(folder);
  if (!file) return tl::unexpected(file.error());
  made->file_ = std::move(*file);
  made->replug();
  // The kernel asks at each close until it was told once that nobody cares; a killed process would wait for itself.
  close(open(made->path().c_str(), O_RDWR | O_CLOEXEC));
  return made;
}

V4l2Double::~V4l2Double() {
  if (device_) device_->unplug();
  file_.reset();
  device_.reset();
  std::error_code ignored;
  std::filesystem::remove(folder_, ignored);
}

void V4l2Double::unplug() {
  file_->plug(nullptr);
  device()->unplug();
}

void V4l2Double::replug() {
  const std::lock_guard lock(mutex_);
  device_ = std::make_shared<DoubleDevice>(options_, numbers_, file_->hooks());
  file_->plug(device_);
}

void V4l2Double::stall(std::chrono::nanoseconds duration) {
  inject([&](DoubleFaults& faults) { faults.stalled_until = std::chrono::steady_clock::now() + duration; });
}

void V4l2Double::configure(const std::function<void(DoubleOptions&)>& change) {
  const std::lock_guard lock(mutex_);
  change(options_);
  device_->configure(change);
}

std::shared_ptr<DoubleDevice> V4l2Double::device() const {
  const std::lock_guard lock(mutex_);
  return device_;
}

}  // namespace slsd::test
