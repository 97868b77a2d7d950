// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/randr_output.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <future>
#include <memory>
#include <thread>

#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/extensions/Xrandr.h>

#include "core/image_size.hpp"
#include "core/printable.hpp"
#include "drivers/projector/x11/edid.hpp"
#include "drivers/projector/x11/x_display.hpp"

namespace slsd {
namespace {

constexpr auto kAnswerMax = std::chrono::seconds(5);
constexpr double kMillimetresPerPixel = 25.4 / 96;  // X's assumption if the size is unknown

template <auto Free>
struct Freeing {
  template <class T>
  void operator()(T* pointer) const {
    Free(pointer);
  }
};
using Resources = std::unique_ptr<XRRScreenResources, Freeing<XRRFreeScreenResources>>;
using OutputInfo = std::unique_ptr<XRROutputInfo, Freeing<XRRFreeOutputInfo>>;
using CrtcInfo = std::unique_ptr<XRRCrtcInfo, Freeing<XRRFreeCrtcInfo>>;
using CrtcGamma = std::unique_ptr<XRRCrtcGamma, Freeing<XRRFreeGamma>>;
template <class T>
using XMemory = std::unique_ptr<T, Freeing<XFree>>;

struct Property {
  Atom type = None;
  std::vector<std::uint8_t> bytes;
};

// Xlib returns 32-bit values as longs.
Property read_property(Display* display, RROutput output, const char* name) {
  const Atom atom = XInternAtom(display, name, True);
  if (atom == None) return {};
  Atom type = None;
  int format = 0;
  unsigned long items = 0;
  unsigned long left = 0;
  unsigned char* values = nullptr;
  XRRGetOutputProperty(display, output, atom, 0, 1024, False, False, AnyPropertyType, &type, &format, &items, &left,
                       &values);
  const XMemory<unsigned char> owned(values);
  if (values == nullptr) return {};
  const std::size_t item_bytes = format == 32 ? sizeof(long) : static_cast<std::size_t>(format) / 8;
  return {type, std::vector<std::uint8_t>(values, values + items * item_bytes)};
}

std::string read_word(Display* display, RROutput output, const char* name) {
  const Property property = read_property(display, output, name);
  if (property.type != XA_ATOM || property.bytes.size() < sizeof(Atom)) return {};
  const Atom atom = *reinterpret_cast<const Atom*>(property.bytes.data());
  const XMemory<char> word(XGetAtomName(display, atom));
  return word ? printable(word.get()) : "";
}

const XRRModeInfo* mode_info(const XRRScreenResources& resources, RRMode mode) {
  for (int i = 0; i < resources.nmode; ++i) {
    if (resources.modes[i].id == mode) return &resources.modes[i];
  }
  return nullptr;
}

double refresh_of(const XRRModeInfo& mode) {
  double lines = mode.vTotal;
  if ((mode.modeFlags & RR_DoubleScan) != 0) lines *= 2;
  if ((mode.modeFlags & RR_Interlace) != 0) lines /= 2;
  return mode.hTotal > 0 && lines > 0 ? static_cast<double>(mode.dotClock) / (mode.hTotal * lines) : 0.0;
}

bool is_active(const XRRCrtcGamma& gamma) {
  for (int i = 0; i < gamma.size; ++i) {
    const double linear = 65535.0 * i / std::max(1, gamma.size - 1);
    for (const unsigned short value : {gamma.red[i], gamma.green[i], gamma.blue[i]}) {
      if (std::abs(value - linear) > 257.0) return true;  // one step of 8 bits; less is rounding by the driver
    }
  }
  return false;
}

bool is_identity(const XTransform& transform) {
  const auto& m = transform.matrix;
  return m[0][1] == 0 && m[0][2] == 0 && m[1][0] == 0 && m[1][2] == 0 && m[2][0] == 0 && m[2][1] == 0 &&
         m[0][0] == m[2][2] && m[1][1] == m[2][2];
}

int rotation_of(Rotation rotation) {
  if ((rotation & RR_Rotate_90) != 0) return 90;
  if ((rotation & RR_Rotate_180) != 0) return 180;
  return (rotation & RR_Rotate_270) != 0 ? 270 : 0;
}

DesktopArea area_of(const XRRCrtcInfo& crtc) {
  return {crtc.x, crtc.y, static_cast<int>(crtc.width), static_cast<int>(crtc.height)};
}

void read_modes(const XRRScreenResources& resources, const XRROutputInfo& info, RRMode now, RandrOutput& output) {
  for (int i = 0; i < info.nmode; ++i) {
    const XRRModeInfo* mode = mode_info(resources, info.modes[i]);
    if (mode == nullptr || (mode->modeFlags & RR_Interlace) != 0) continue;
    output.modes.push_back(
        {mode->id, static_cast<int>(mode->width), static_cast<int>(mode->height), refresh_of(*mode)});
  }
  if (const XRRModeInfo* mode = mode_info(resources, now)) {
    output.mode_width_px = static_cast<int>(mode->width);
    output.mode_height_px = static_cast<int>(mode->height);
    output.refresh_hz = refresh_of(*mode);
  }
  const XRRModeInfo* native = info.npreferred > 0 ? mode_info(resources, info.modes[0]) : nullptr;
  if (native == nullptr) return;
  output.native_width_px = static_cast<int>(native->width);
  output.native_height_px = static_cast<int>(native->height);
}

void read_light_path(Display* display, RRCrtc crtc, RandrOutput& output) {
  XRRCrtcTransformAttributes* attributes = nullptr;
  if (XRRGetCrtcTransform(display, crtc, &attributes) != 0 && attributes != nullptr) {
    const XMemory<XRRCrtcTransformAttributes> owned(attributes);
    output.transformed = !is_identity(attributes->currentTransform);
  }
  if (const CrtcGamma gamma(XRRGetCrtcGamma(display, crtc)); gamma) output.gamma_active = is_active(*gamma);
  output.rgb_range = read_word(display, output.id, "Broadcast RGB");
  const std::string underscan = read_word(display, output.id, "underscan");
  output.underscan = !underscan.empty() && underscan != "off";
}

std::optional<RandrOutput> read_output(Display* display, XRRScreenResources* resources, RROutput id) {
  const OutputInfo info(XRRGetOutputInfo(display, resources, id));
  if (!info || info->connection == RR_Disconnected) return std::nullopt;
  RandrOutput output;
  output.id = id;
  output.name = printable({info->name, static_cast<std::size_t>(info->nameLen)});
  const EdidIdentity identity = read_edid(read_property(display, id, "EDID").bytes);
  output.model = printable(identity.model);
  output.serial = printable(identity.serial);
  output.primary = XRRGetOutputPrimary(display, DefaultRootWindow(display)) == id;
  const CrtcInfo crtc(info->crtc != None ? XRRGetCrtcInfo(display, resources, info->crtc) : nullptr);
  output.on = crtc && crtc->mode != None;
  read_modes(*resources, *info, output.on ? crtc->mode : None, output);
  if (!output.on) return output;
  output.area = area_of(*crtc);
  output.rotation_deg = rotation_of(crtc->rotation);
  output.reflected = (crtc->rotation & (RR_Reflect_X | RR_Reflect_Y)) != 0;
  read_light_path(display, info->crtc, output);
  return output;
}

RRCrtc free_crtc(Display* display, XRRScreenResources* resources, const XRROutputInfo& info) {
  if (info.crtc != None) return info.crtc;
  for (int i = 0; i < info.ncrtc; ++i) {
    const CrtcInfo crtc(XRRGetCrtcInfo(display, resources, info.crtcs[i]));
    if (crtc && crtc->noutput == 0) return info.crtcs[i];
  }
  return None;
}

void grow_desktop(Display* display, int width_px, int height_px) {
  const Window root = DefaultRootWindow(display);
  XWindowAttributes now{};
  if (XGetWindowAttributes(display, root, &now) == 0) return;
  width_px = std::max(width_px, now.width);
  height_px = std::max(height_px, now.height);
  if (width_px == now.width && height_px == now.height) return;
  XRRSetScreenSize(display, root, width_px, height_px, static_cast<int>(std::lround(width_px * kMillimetresPerPixel)),
                   static_cast<int>(std::lround(height_px * kMillimetresPerPixel)));
}

Result<std::vector<RandrOutput>> ask_for_outputs() {
  survive_x_errors();
  const std::unique_ptr<Display, Freeing<XCloseDisplay>> display(XOpenDisplay(nullptr));
  if (!display) return no_display();
  std::atomic<bool> lost = false;
  survive_loss(display.get(), lost);
  int major = 0;
  int minor = 0;
  if (XRRQueryVersion(display.get(), &major, &minor) == 0 || major < 1 || (major == 1 && minor < 3)) {
    return fail(ErrorCode::kUnsupported, "the X server lacks RandR 1.3: use a newer one", DisplayString(display.get()));
  }
  return read_outputs(display.get());
}

}  // namespace

bool RandrOutput::pans() const {
  if (!on || transformed || mode_width_px == 0) return false;
  const bool turned = rotation_deg % 180 != 0;
  return area.width_px > (turned ? mode_height_px : mode_width_px) ||
         area.height_px > (turned ? mode_width_px : mode_height_px);
}

std::vector<RandrOutput> read_outputs(_XDisplay* display, Probe probe) {
  std::vector<RandrOutput> outputs;
  const Window root = DefaultRootWindow(display);
  const Resources resources(probe == Probe::kHardware ? XRRGetScreenResources(display, root)
                                                      : XRRGetScreenResourcesCurrent(display, root));
  for (int i = 0; resources && i < resources->noutput; ++i) {
    if (auto output = read_output(display, resources.get(), resources->outputs[i])) outputs.push_back(*output);
  }
  return outputs;
}

std::optional<DesktopArea> lit_area(_XDisplay* display, unsigned long output) {
  const Resources resources(XRRGetScreenResourcesCurrent(display, DefaultRootWindow(display)));
  if (!resources) return std::nullopt;
  const OutputInfo info(XRRGetOutputInfo(display, resources.get(), output));
  if (!info || info->connection == RR_Disconnected || info->crtc == None) return std::nullopt;
  const CrtcInfo crtc(XRRGetCrtcInfo(display, resources.get(), info->crtc));
  if (!crtc || crtc->mode == None) return std::nullopt;
  return area_of(*crtc);
}

const RandrMode* find_mode(const RandrOutput& output, int width_px, int height_px, double refresh_hz) {
  const RandrMode* best = nullptr;
  for (const RandrMode& mode : output.modes) {
    if (mode.width_px != width_px || mode.height_px != height_px) continue;
    if (best == nullptr || std::abs(mode.refresh_hz - refresh_hz) < std::abs(best->refresh_hz - refresh_hz)) {
      best = &mode;
    }
  }
  return best;
}

DesktopArea place_of(const RandrOutput& output, const std::vector<RandrOutput>& outputs, int width_px, int height_px) {
  const DesktopArea here{output.area.x_px, output.area.y_px, width_px, height_px};
  bool free = true;
  int right_px = 0;
  for (const RandrOutput& other : outputs) {
    if (other.id == output.id || !other.on) continue;
    free = free && !overlap(other.area, here);
    right_px = std::max(right_px, other.area.x_px + other.area.width_px);
  }
  return free ? here : DesktopArea{right_px, 0, width_px, height_px};
}

Result<> set_output(_XDisplay* display, const RandrOutput& output, const std::vector<RandrOutput>& outputs,
                    int width_px, int height_px, double refresh_hz) {
  const std::string where = "monitor " + output.name;
  const RandrMode* mode = find_mode(output, width_px, height_px, refresh_hz);
  if (mode == nullptr) {
    return fail(ErrorCode::kMismatch,
                "it has no mode of " + size_text(width_px, height_px) +
                    " pixels: set [projector] width_px and height_px to its native size" +
                    (output.native_width_px > 0 ? ", " + size_text(output.native_width_px, output.native_height_px)
                                                : std::string()),
                where);
  }
  const Resources resources(XRRGetScreenResourcesCurrent(display, DefaultRootWindow(display)));
  const OutputInfo info(resources ? XRRGetOutputInfo(display, resources.get(), output.id) : nullptr);
  const RRCrtc crtc = info ? free_crtc(display, resources.get(), *info) : None;
  if (crtc == None) return fail(ErrorCode::kUnsupported, "the graphics card cannot drive another monitor", where);
  const DesktopArea place = place_of(output, outputs, width_px, height_px);
  grow_desktop(display, place.x_px + width_px, place.y_px + height_px);
  RROutput id = output.id;
  const Status set = XRRSetCrtcConfig(display, resources.get(), crtc, CurrentTime, place.x_px, place.y_px, mode->id,
                                      RR_Rotate_0, &id, 1);
  if (set == RRSetConfigSuccess) return {};
  return fail(ErrorCode::kUnsupported,
              "the X server refuses to set it to " + size_text(width_px, height_px) + " pixels", where);
}

// Xlib waits without limit for a hung server, so this runs on a thread that may be abandoned.
Result<std::vector<RandrOutput>> list_outputs() {
  std::packaged_task<Result<std::vector<RandrOutput>>()> ask(ask_for_outputs);
  auto outputs = ask.get_future();
  try {
    std::thread(std::move(ask)).detach();
  } catch (const std::system_error&) {
    return fail(ErrorCode::kNoSpace, "cannot start a thread for the display");
  }
  if (outputs.wait_for(kAnswerMax) == std::future_status::ready) return outputs.get();
  return no_answer();
}

}  // namespace slsd
