// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/glfw/display_thread.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <poll.h>

#include "drivers/system/thread_name.hpp"
#include "drivers/system/wake_event.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto kEndMax = 3s;  // for removing the window

}  // namespace

struct DisplayThread::Shared {
  explicit Shared(const GlfwProjectorOptions& options) : screen(options) {}

  ProjectorScreen screen;  ///< used only on the thread
  std::atomic<bool> open{false};
  WakeEvent woken;
  std::mutex mutex;  ///< guards the members below
  std::condition_variable changed;
  Work work;  ///< empty: no work is under way
  MonotonicTime since{};
  bool running = false;
  bool stop = false;
};

DisplayThread::DisplayThread(const GlfwProjectorOptions& options) : shared_(std::make_shared<Shared>(options)) {}

DisplayThread::~DisplayThread() {
  std::unique_lock lock(shared_->mutex);
  shared_->stop = true;
  shared_->woken.wake();
  const bool stuck = shared_->work != nullptr;
  shared_->changed.wait_for(lock, stuck ? 0s : kEndMax, [this] { return !shared_->running; });
}

Result<> DisplayThread::start() {
  const std::lock_guard lock(shared_->mutex);
  if (shared_->running) return {};
  if (auto opened = shared_->woken.open(); !opened) return opened;
  try {
    std::thread([shared = shared_] { serve(shared); }).detach();
  } catch (const std::system_error&) {
    return fail(ErrorCode::kNoSpace, "cannot start a thread for the display", "projector");
  }
  shared_->running = true;
  return {};
}

void DisplayThread::begin(Work work) {
  const std::lock_guard lock(shared_->mutex);
  shared_->work = std::move(work);
  shared_->since = steady_clock::now();
  shared_->woken.wake();
}

bool DisplayThread::wait(MonotonicTime until) const {
  std::unique_lock lock(shared_->mutex);
  return shared_->changed.wait_until(lock, until, [this] { return !shared_->work; });
}

MonotonicTime DisplayThread::begun() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->since;
}

bool DisplayThread::screen_open() const {
  return shared_->open;
}

void DisplayThread::serve(const std::shared_ptr<Shared>& shared) {
  name_this_thread("display");
  ProjectorScreen& screen = shared->screen;
  std::unique_lock lock(shared->mutex);
  while (!shared->stop) {
    if (const Work work = shared->work) {
      lock.unlock();
      work(screen);
      shared->open = screen.is_open();
      lock.lock();
      shared->work = nullptr;
      shared->changed.notify_all();
      continue;
    }
    lock.unlock();
    const int events = screen.handle_events();
    shared->open = screen.is_open();
    std::array descriptors{pollfd{shared->woken.descriptor(), POLLIN, 0}, pollfd{events, POLLIN, 0}};
    ::poll(descriptors.data(), descriptors.size(), -1);
    shared->woken.reset();
    lock.lock();
  }
  lock.unlock();
  screen.end();
  lock.lock();
  shared->running = false;
  shared->changed.notify_all();
}

}  // namespace slsd
