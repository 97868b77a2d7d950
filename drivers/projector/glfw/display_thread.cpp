// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/glfw/display_thread.hpp"

#include <array>
#include <cstdint>
#include <system_error>

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

namespace slsd {

DisplayThread::DisplayThread(std::function<int()> handle_events) : handle_events_(std::move(handle_events)) {}

DisplayThread::~DisplayThread() {
  if (thread_.joinable()) {
    thread_.request_stop();
    wake();
    thread_.join();
  }
  if (wake_descriptor_ >= 0) ::close(wake_descriptor_);
}

Result<> DisplayThread::start() {
  if (thread_.joinable()) return {};
  if (wake_descriptor_ < 0) wake_descriptor_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (wake_descriptor_ < 0) return fail(ErrorCode::kNoSpace, "no descriptor is left for the display's thread");
  try {
    thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
  } catch (const std::system_error&) {
    return fail(ErrorCode::kNoSpace, "no thread is left for the display");
  }
  return {};
}

void DisplayThread::wake() const {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(wake_descriptor_, &one, sizeof one);
}

void DisplayThread::run(const std::function<void()>& job) {
  std::unique_lock lock(mutex_);
  job_ = &job;
  wake();
  done_.wait(lock, [&] { return job_ == nullptr; });
}

void DisplayThread::take_job() {
  std::uint64_t count = 0;
  [[maybe_unused]] const auto got = ::read(wake_descriptor_, &count, sizeof count);
  const std::lock_guard lock(mutex_);
  if (job_ == nullptr) return;
  (*job_)();
  job_ = nullptr;
  done_.notify_one();
}

void DisplayThread::serve(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "display");
  while (!stop.stop_requested()) {
    const int events = handle_events_();
    std::array descriptors{pollfd{wake_descriptor_, POLLIN, 0}, pollfd{events, POLLIN, 0}};
    ::poll(descriptors.data(), descriptors.size(), -1);
    take_job();
  }
}

}  // namespace slsd
