// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/x11/desktop.hpp"

#include <algorithm>
#include <cstdlib>
#include <memory>

#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/extensions/Xrandr.h>
#include <xcb/xcb.h>

namespace slsd::test {
namespace {

// Else xrandr rounds the desktop's millimetres down at each change, after some two hundred to none, which X refuses.
const std::string kFixedDpi = "--dpi 96 --output ";

struct FreeMemory {
  void operator()(void* memory) const { std::free(memory); }
};

void put_text(std::vector<std::uint8_t>& edid, std::size_t start, std::uint8_t tag, const std::string& text) {
  edid[start + 3] = tag;
  for (std::size_t i = 0; i < 13; ++i) {
    edid[start + 5 + i] = i < text.size() ? static_cast<std::uint8_t>(text[i]) : i == text.size() ? '\n' : ' ';
  }
}

RROutput find_output(Display* display, const std::string& name) {
  XRRScreenResources* resources = XRRGetScreenResourcesCurrent(display, DefaultRootWindow(display));
  RROutput found = None;
  for (int i = 0; i < resources->noutput; ++i) {
    XRROutputInfo* info = XRRGetOutputInfo(display, resources, resources->outputs[i]);
    if (name == info->name) found = resources->outputs[i];
    XRRFreeOutputInfo(info);
  }
  XRRFreeScreenResources(resources);
  return found;
}

}  // namespace

std::vector<std::uint8_t> edid_with(const std::string& model, const std::string& serial) {
  std::vector<std::uint8_t> edid(128);
  std::fill(edid.begin() + 1, edid.begin() + 7, std::uint8_t{0xFF});
  edid[8] = 0x0C;  // "CBA"
  edid[9] = 0x41;
  edid[10] = 0x34;
  edid[11] = 0x12;
  edid[18] = 1;
  edid[19] = 4;
  if (!model.empty()) put_text(edid, 54, 0xFC, model);
  if (!serial.empty()) put_text(edid, 72, 0xFF, serial);
  int sum = 0;
  for (const std::uint8_t byte : edid) sum += byte;
  edid[127] = static_cast<std::uint8_t>(-sum);
  return edid;
}

Desktop::Desktop(const std::string& display)
    : display_(display),
      connection_(xcb_connect(display.c_str(), nullptr)),
      screen_(xcb_setup_roots_iterator(xcb_get_setup(connection_)).data) {}

Desktop::~Desktop() {
  xcb_disconnect(connection_);
}

ColourImage Desktop::screenshot(int x, int y, int width, int height) const {
  const auto cookie = xcb_get_image(connection_, XCB_IMAGE_FORMAT_Z_PIXMAP, screen_->root, static_cast<std::int16_t>(x),
                                    static_cast<std::int16_t>(y), static_cast<std::uint16_t>(width),
                                    static_cast<std::uint16_t>(height), ~0U);
  const std::unique_ptr<xcb_get_image_reply_t, FreeMemory> reply(xcb_get_image_reply(connection_, cookie, nullptr));
  if (!reply) return {};
  const std::uint8_t* blue = xcb_get_image_data(reply.get());  // blue, green, red and nothing
  ColourImage image(width, height);
  for (std::size_t i = 0; i < image.size(); ++i, blue += 4) image.data()[i] = {blue[2], blue[1], blue[0]};
  return image;
}

bool Desktop::xrandr(const std::string& arguments) const {
  return std::system(("xrandr --display " + display_ + " " + arguments + " 2>/dev/null").c_str()) == 0;
}

bool Desktop::plug(const std::string& output, const std::string& mode, const std::string& place) const {
  // The query lets the driver look for monitors: its outputs count as plugged in from when they show something.
  return xrandr("--addmode " + output + " " + mode) && xrandr(kFixedDpi + output + " --mode " + mode + " " + place) &&
         xrandr("--query >/dev/null");
}

bool Desktop::unplug(const std::string& output) const {
  return xrandr(kFixedDpi + output + " --off");
}

void Desktop::set_serial(const std::string& output, const std::string& serial) const {
  Display* display = XOpenDisplay(display_.c_str());
  const auto edid = edid_with("Beamer", serial);
  XRRChangeOutputProperty(display, find_output(display, output), XInternAtom(display, "EDID", False), XA_INTEGER, 8,
                          PropModeReplace, edid.data(), static_cast<int>(edid.size()));
  XCloseDisplay(display);
}

void Desktop::cover(int x, int y, int width, int height) {
  window_ = xcb_generate_id(connection_);
  const std::uint32_t values[] = {screen_->white_pixel, 1};
  xcb_create_window(connection_, XCB_COPY_FROM_PARENT, window_, screen_->root, static_cast<std::int16_t>(x),
                    static_cast<std::int16_t>(y), static_cast<std::uint16_t>(width), static_cast<std::uint16_t>(height),
                    0, XCB_WINDOW_CLASS_INPUT_OUTPUT, XCB_COPY_FROM_PARENT,
                    XCB_CW_BACK_PIXEL | XCB_CW_OVERRIDE_REDIRECT, values);
  xcb_map_window(connection_, window_);
  xcb_flush(connection_);
}

void Desktop::uncover() {
  xcb_destroy_window(connection_, window_);
  xcb_flush(connection_);
}

}  // namespace slsd::test
