// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/glfw/glfw_projector.hpp"

#include <utility>

#include "core/image_size.hpp"

namespace slsd {

GlfwProjector::GlfwProjector(GlfwProjectorOptions options)
    : options_(std::move(options)),
      description_{"glfw", options_.monitor, options_.width_px, options_.height_px},
      screen_(options_),
      thread_([this] {
        const int events = screen_.handle_events();
        connected_ = screen_.is_open();
        return events;
      }) {}

GlfwProjector::~GlfwProjector() {
  if (thread_.started()) thread_.run([this] { screen_.end(); });
}

Result<> GlfwProjector::open() {
  if (auto valid = options_.validate(); !valid) return valid;
  if (auto started = thread_.start(); !started) return started;
  Result<> opened;
  thread_.run([&] {
    opened = screen_.open();
    connected_ = screen_.is_open();
    if (!opened) return;
    description_.monitor = screen_.output().name;
    description_.model = screen_.output().model;
    description_.serial = screen_.output().serial;
    warnings_ = screen_.warnings();
  });
  return opened;
}

Result<MonotonicTime> GlfwProjector::show(const Grey8& image) {
  if (auto there = check(); !there) return tl::unexpected(there.error());
  if (image.width() != options_.width_px || image.height() != options_.height_px) {
    return fail(ErrorCode::kMismatch,
                "the image is " + size_text(image.width(), image.height()) + " pixels, the projector " +
                    size_text(options_.width_px, options_.height_px) + "; make the pattern for this projector",
                "monitor " + description_.monitor);
  }
  Result<MonotonicTime> shown;
  thread_.run([&] {
    shown = screen_.show(image);
    connected_ = screen_.is_open();
  });
  return shown;
}

// What is asked of the server here it answers as it is now: an event that tells of the loss may still be under way.
Result<> GlfwProjector::check() {
  if (connected_) {
    thread_.run([this] {
      screen_.handle_events();
      connected_ = screen_.is_open();
    });
  }
  if (connected_) return {};
  return fail(ErrorCode::kDisconnected, "the projector is not there; check its cable and its power",
              description_.monitor.empty() ? "projector" : "monitor " + description_.monitor);
}

Result<Grey8> GlfwProjector::read_back() {
  if (auto there = check(); !there) return tl::unexpected(there.error());
  Result<Grey8> screen;
  thread_.run([&] { screen = screen_.read_back(); });
  return screen;
}

}  // namespace slsd
