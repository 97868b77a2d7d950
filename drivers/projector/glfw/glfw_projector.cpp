// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/glfw/glfw_projector.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "core/image_size.hpp"
#include "drivers/projector/x11/x_display.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

// An X server that has not answered for this long counts as hung. If it is only slow, the work still continues.
constexpr std::chrono::nanoseconds kHangs = 2s;
constexpr std::chrono::nanoseconds kOpeningHangs = 5s;
constexpr auto kScreenshotMax = 10s;

}  // namespace

GlfwProjector::GlfwProjector(GlfwProjectorOptions options)
    : options_(std::move(options)),
      description_{"glfw", options_.monitor, options_.width_px, options_.height_px},
      thread_(options_) {
  // Without DRI3, Mesa tries the older DRI2. Current servers refuse that, and Mesa prints it on stderr at each start
  // before it draws on the processor. Set here, while the process has one thread.
  ::setenv("LIBGL_DRI2_DISABLE", "true", 0);
}

std::string GlfwProjector::where() const {
  return description_.monitor.empty() ? "projector" : "monitor " + description_.monitor;
}

tl::unexpected<Error> GlfwProjector::fail_gone() const {
  return fail(ErrorCode::kDisconnected, "the projector is not connected; check its cable and its power", where());
}

// Waits for the end of the thread's last order.
Result<> GlfwProjector::wait(MonotonicTime deadline) const {
  const MonotonicTime hangs = thread_.begun() + (is_under_way(Task::kOpen) ? kOpeningHangs : kHangs);
  if (thread_.wait(std::min(deadline, hangs))) return {};
  if (steady_clock::now() < hangs)
    return fail(ErrorCode::kTimeout, "the projector needs more time: allow a longer timeout", where());
  Error error = no_answer().value();
  error.where = where();
  return tl::unexpected(std::move(error));
}

Result<> GlfwProjector::begin(Order order, MonotonicTime deadline, void (*work)(ProjectorScreen&, Order&)) {
  if (auto done = wait(deadline); !done) return done;
  order_.reset();
  if (order.task != Task::kOpen && !thread_.screen_open()) return fail_gone();
  order_ = std::make_shared<Order>(std::move(order));
  thread_.begin([order = order_, work](ProjectorScreen& screen) { work(screen, *order); });
  return {};
}

Result<> GlfwProjector::open(MonotonicTime deadline) {
  if (auto valid = options_.validate(); !valid) return valid;
  if (auto started = thread_.start(); !started) return started;
  if (!is_under_way(Task::kOpen)) {
    if (auto done = wait(deadline); !done) return done;
    if (order_ && thread_.screen_open()) return {};  // it was hung or slow, and still shows its image
    const auto open_screen = [](ProjectorScreen& screen, Order& order) {
      order.opened = screen.open();
      order.output = screen.output();
      order.warnings = screen.warnings();
    };
    if (auto begun = begin({Task::kOpen}, deadline, open_screen); !begun) return begun;
  }
  if (auto done = wait(deadline); !done) return done;
  const auto order = std::exchange(order_, nullptr);
  if (!order->opened) return order->opened;
  description_.monitor = order->output.name;
  description_.model = order->output.model;
  description_.serial = order->output.serial;
  warnings_ = order->warnings;
  return {};
}

Result<MonotonicTime> GlfwProjector::show(const Grey8& image, MonotonicTime deadline) {
  if (image.width() != options_.width_px || image.height() != options_.height_px) {
    if (!thread_.screen_open()) return fail_gone();
    return fail(ErrorCode::kMismatch,
                "the image is " + size_text(image.width(), image.height()) + " pixels, the projector " +
                    size_text(options_.width_px, options_.height_px) + "; make the pattern for this projector",
                where());
  }
  if (!is_under_way(Task::kShow) || !(order_->image == image)) {
    const auto show_image = [](ProjectorScreen& screen, Order& order) { order.shown = screen.show(order.image); };
    if (auto begun = begin({Task::kShow, image}, deadline, show_image); !begun) return tl::unexpected(begun.error());
  }
  if (auto done = wait(deadline); !done) return tl::unexpected(done.error());
  return std::exchange(order_, nullptr)->shown;
}

// The server answers queries with its current state, while an event about the loss may still be under way.
Result<> GlfwProjector::check(MonotonicTime deadline) {
  if (!is_under_way(Task::kCheck)) {
    const auto look = [](ProjectorScreen& screen, Order&) { screen.handle_events(); };
    if (auto begun = begin({Task::kCheck}, deadline, look); !begun) return begun;
  }
  if (auto done = wait(deadline); !done) return done;
  order_.reset();
  return thread_.screen_open() ? Result<>() : fail_gone();
}

Result<Grey8> GlfwProjector::read_back() {
  const MonotonicTime deadline = steady_clock::now() + kScreenshotMax;
  const auto take = [](ProjectorScreen& screen, Order& order) { order.screenshot = screen.read_back(); };
  if (auto begun = begin({Task::kReadBack}, deadline, take); !begun) return tl::unexpected(begun.error());
  if (auto done = wait(deadline); !done) return tl::unexpected(done.error());
  return std::exchange(order_, nullptr)->screenshot;
}

}  // namespace slsd
