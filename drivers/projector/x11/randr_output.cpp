// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/x11/randr_output.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>

#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/extensions/Xrandr.h>

#include "drivers/projector/x11/edid.hpp"
#include "drivers/projector/x11/x_errors.hpp"

namespace slsd {
namespace {

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

// Values of 32 bits come as longs.
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
  return word ? word.get() : "";
}

const XRRModeInfo* find_mode(const XRRScreenResources& resources, RRMode mode) {
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
      if (std::abs(value - linear) > 257.0) return true;  // a step of 8 bits: less is a driver's rounding
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
  if (const XRRModeInfo* mode = find_mode(resources, now)) {
    output.mode_width_px = static_cast<int>(mode->width);
    output.mode_height_px = static_cast<int>(mode->height);
    output.refresh_hz = refresh_of(*mode);
  }
  const XRRModeInfo* native = info.npreferred > 0 ? find_mode(resources, info.modes[0]) : nullptr;
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
  if (!info || info->connection == RR_Disconnected || info->crtc == None) return std::nullopt;
  const CrtcInfo crtc(XRRGetCrtcInfo(display, resources, info->crtc));
  if (!crtc || crtc->mode == None) return std::nullopt;
  RandrOutput output;
  output.id = id;
  output.name.assign(info->name, static_cast<std::size_t>(info->nameLen));
  const EdidIdentity identity = read_edid(read_property(display, id, "EDID").bytes);
  output.model = identity.model;
  output.serial = identity.serial;
  output.primary = XRRGetOutputPrimary(display, DefaultRootWindow(display)) == id;
  output.area = area_of(*crtc);
  output.rotation_deg = rotation_of(crtc->rotation);
  output.reflected = (crtc->rotation & (RR_Reflect_X | RR_Reflect_Y)) != 0;
  read_modes(*resources, *info, crtc->mode, output);
  read_light_path(display, info->crtc, output);
  return output;
}

}  // namespace

std::vector<RandrOutput> read_outputs(_XDisplay* display) {
  std::vector<RandrOutput> outputs;
  const Resources resources(XRRGetScreenResourcesCurrent(display, DefaultRootWindow(display)));
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

Result<std::vector<RandrOutput>> list_outputs() {
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

}  // namespace slsd
