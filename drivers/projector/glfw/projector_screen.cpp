// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/glfw/projector_screen.hpp"

#include <chrono>
#include <utility>

#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <spdlog/spdlog.h>

#include "core/image_size.hpp"
#include "drivers/projector/x11/choose_output.hpp"

namespace slsd {
namespace {

constexpr int kSideMaxPx = 16384;
constexpr auto kProbePeriod = std::chrono::seconds(2);  // probing may disturb other monitors

struct DestroyImage {
  void operator()(XImage* image) const { XDestroyImage(image); }
};

std::uint8_t channel(unsigned long pixel, unsigned long mask) {
  return static_cast<std::uint8_t>((pixel & mask) / (mask & ~(mask - 1)));
}

}  // namespace

Result<> GlfwProjectorOptions::validate() const {
  if (width_px < 1 || width_px > kSideMaxPx)
    return fail(ErrorCode::kInvalidArgument, "must be between 1 and 16384", "width_px");
  if (height_px < 1 || height_px > kSideMaxPx)
    return fail(ErrorCode::kInvalidArgument, "must be between 1 and 16384", "height_px");
  if (auto valid = light.validate(); !valid) return valid;
  return {};
}

Result<> ProjectorScreen::open() {
  close();
  if (auto opened = open_session(); !opened) return opened;
  if (auto found = find_output(); !found) return found;
  if (auto opened = open_window(); !opened) {
    // GLFW keeps the modes of the first monitor at an output. If another is connected there now, it would always set
    // the nearest of the old modes.
    opened.error().code == ErrorCode::kMismatch ? end() : close();
    return opened;
  }
  const auto shown = show(Grey8(options_.width_px, options_.height_px));
  if (shown) return {};
  close();
  return tl::unexpected(shown.error());
}

void ProjectorScreen::close() {
  swapped_ = false;
  clock_.reset();
  painter_.reset();
  window_.reset();
}

void ProjectorScreen::end() {
  close();
  session_.reset();
}

Result<> ProjectorScreen::open_session() {
  if (session_ && !session_->lost()) return {};
  end();
  auto session = GlfwSession::open();
  if (!session) return tl::unexpected(session.error());
  session_ = std::move(*session);
  return {};
}

Result<> ProjectorScreen::find_output() {
  XSync(session_->display(), False);
  session_->handle_events();
  auto output = options_.enable_output
                    ? enabled_output()
                    : choose_output(read_outputs(session_->display()), options_.monitor, output_.name);
  if (!output) return tl::unexpected(output.error());
  const bool can_switch =
      output->native_width_px == options_.width_px && output->native_height_px == options_.height_px;
  auto fits = check_fit(*output, options_.width_px, options_.height_px);
  if (!fits && !can_switch) return fits;
  output_ = std::move(*output);
  return {};
}

// On an X server without a desktop, no other program turns monitors on or looks for them.
Result<RandrOutput> ProjectorScreen::enabled_output() {
  _XDisplay* display = session_->display();
  const auto fits = [this](const Result<RandrOutput>& output) {
    return output && output->on && check_fit(*output, options_.width_px, options_.height_px);
  };
  auto outputs = read_outputs(display);
  auto output = choose_output(outputs, options_.monitor, output_.name, true);
  if (fits(output)) return output;
  if (const auto now = std::chrono::steady_clock::now(); now - probed_ >= kProbePeriod) {
    probed_ = now;
    outputs = read_outputs(display, Probe::kHardware);
    output = choose_output(outputs, options_.monitor, output_.name, true);
  }
  if (!output || output->transformed || fits(output)) return output;
  if (auto set = set_output(display, *output, outputs, options_.width_px, options_.height_px, options_.refresh_hz);
      !set) {
    return tl::unexpected(set.error());
  }
  spdlog::info("projector: monitor {} set to {}", output->name, size_text(options_.width_px, options_.height_px));
  XSync(display, False);
  session_->handle_events();
  return choose_output(read_outputs(display), output->name, {}, true);
}

Result<> ProjectorScreen::open_window() {
  auto window = FullscreenWindow::open(*session_, output_, options_.width_px, options_.height_px);
  if (!window) return tl::unexpected(window.error());
  window_ = std::move(*window);
  auto painter = TexelPainter::create(options_.width_px, options_.height_px, LightCurve(options_.light));
  if (!painter) return tl::unexpected(painter.error());
  painter_ = *painter;
  const auto outputs = read_outputs(session_->display());
  auto output = choose_output(outputs, output_.name, {});
  if (!output) return tl::unexpected(output.error());
  if (auto fits = check_fit(*output, options_.width_px, options_.height_px); !fits) return fits;
  output_ = std::move(*output);
  warnings_ = output_warnings(output_, outputs);
  clock_ = RefreshClock::open(DisplayString(session_->display()), window_->id(), output_.refresh_hz);
  return {};
}

void ProjectorScreen::redraw() {
  painter_->draw();
  settle();
  clock_->prepare();
  window_->swap();
  swapped_ = true;
}

// One swap at a time, because the report of a complete swap does not say which.
void ProjectorScreen::settle() {
  if (std::exchange(swapped_, false)) static_cast<void>(clock_->wait_refresh());
}

Result<> ProjectorScreen::check_open() const {
  if (is_open()) return {};
  return fail(ErrorCode::kDisconnected, "the projector is not connected; check its cable and its power",
              output_.name.empty() ? "projector" : "monitor " + output_.name);
}

Result<MonotonicTime> ProjectorScreen::show(const Grey8& image) {
  handle_events();
  if (auto there = check_open(); !there) return tl::unexpected(there.error());
  painter_->load(image);
  painter_->draw();
  settle();
  clock_->prepare();
  window_->swap();
  auto refresh = clock_->wait_refresh();
  handle_events();
  if (auto there = check_open(); !there) return tl::unexpected(there.error());
  return refresh;
}

Result<Grey8> ProjectorScreen::read_back() {
  handle_events();
  if (auto there = check_open(); !there) return tl::unexpected(there.error());
  const DesktopArea& area = output_.area;
  const std::unique_ptr<XImage, DestroyImage> screen(
      XGetImage(session_->display(), DefaultRootWindow(session_->display()), area.x_px, area.y_px,
                static_cast<unsigned>(area.width_px), static_cast<unsigned>(area.height_px), AllPlanes, ZPixmap));
  if (!screen) {
    handle_events();
    return fail(ErrorCode::kDisconnected, "the X server gives no screenshot of it", "monitor " + output_.name);
  }
  Grey8 image(area.width_px, area.height_px);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      image.at(x, y) = channel(XGetPixel(screen.get(), x, y), screen->green_mask);
    }
  }
  return image;
}

// If a monitor was briefly gone, GLFW moves its window elsewhere.
bool ProjectorScreen::is_in_place() const {
  return lit_area(session_->display(), output_.id) == output_.area && window_->covers(output_.area);
}

int ProjectorScreen::handle_events() {
  if (!session_) return -1;
  do {  // queries may read further events, which the descriptor then no longer shows
    session_->handle_events();
    if (clock_ && window_->take_damage() && !session_->lost()) redraw();
    if (window_ && !session_->lost() && !is_in_place()) close();
  } while (!session_->lost() && XEventsQueued(session_->display(), QueuedAlready) > 0);
  if (!session_->lost()) return session_->descriptor();
  close();
  return -1;
}

}  // namespace slsd
