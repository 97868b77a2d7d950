// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/device/open_device.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include <arv.h>

#include "core/printable.hpp"
#include "drivers/camera/aravis/gige/gige_discovery.hpp"

// Aravis 0.8 parses descriptions of devices and of their chunks in one state for the whole process, without a lock. It
// parses in the same call that reads them from the device. A lock around that call would make all cameras wait for one
// that stops answering. Only these two functions use the state. Aravis calls them through its symbol table, in which
// the program's own functions come first. So the lock is held during parsing, and never while waiting for bytes.
namespace {

std::mutex& parsing() {
  static std::mutex mutex;
  return mutex;
}

template <class Function>
Function* of_aravis(Function*, const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

[[gnu::used, gnu::visibility("default")]] ArvDomDocument* arv_dom_document_new_from_memory(const void* buffer, int size,
                                                                                           GError** error) {
  static auto* const parse = of_aravis(arv_dom_document_new_from_memory, __func__);
  const std::lock_guard lock(parsing());
  return parse(buffer, size, error);
}

[[gnu::used, gnu::visibility("default")]] void arv_dom_document_append_from_memory(ArvDomDocument* document,
                                                                                   ArvDomNode* node, const void* buffer,
                                                                                   int size, GError** error) {
  static auto* const parse = of_aravis(arv_dom_document_append_from_memory, __func__);
  const std::lock_guard lock(parsing());
  parse(document, node, buffer, size, error);
}

}  // extern "C"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

std::string text(const char* from) {
  return from == nullptr ? "" : from;
}

constexpr milliseconds kProbe{600};
constexpr milliseconds kRelease{700};  // less than a second, the service's time to stop
constexpr milliseconds kReleasePoll{30};
constexpr std::uint64_t kHeartbeatRegister = 0x938;
constexpr std::uint32_t kHeartbeatMs = 2000;  // Aravis sends a heartbeat every second

bool is_named(const std::string& id, const std::string& vendor, const std::string& serial) {
  return id == serial || id == vendor + "-" + serial;
}

GObjectPtr<GInetAddress> inet_address(const std::string& text) {
  return GObjectPtr<GInetAddress>(g_inet_address_new_from_string(text.c_str()));
}

tl::unexpected<Error> fail_controlled(const std::string& by, const std::string& name) {
  return fail(ErrorCode::kPermissionDenied,
              "another application controls the camera" + (by.empty() ? "" : ", from " + by) +
                  "; close it there, or wait until its heartbeat times out",
              name);
}

// A device releases its controller only after this long without a heartbeat; three seconds by default.
void shorten_heartbeat(ArvDevice* device) {
  guint32 heartbeat_ms = 0;
  GErrorSlot error;
  if (!arv_device_read_register(device, kHeartbeatRegister, &heartbeat_ms, error.out())) return;
  if (heartbeat_ms > kHeartbeatMs) arv_device_write_register(device, kHeartbeatRegister, kHeartbeatMs, error.out());
}

Result<OpenedDevice> control(GObjectPtr<ArvDevice> device, std::string name, std::string address) {
  const bool gige = ARV_IS_GV_DEVICE(device.get());
  if (gige && !arv_gv_device_is_controller(ARV_GV_DEVICE(device.get()))) return fail_controlled("", name);
  if (gige) shorten_heartbeat(device.get());
  GErrorSlot error;
  GObjectPtr<ArvCamera> camera(arv_camera_new_with_device(device.get(), error.out()));
  if (!camera || error.failed()) return fail(error.code(), "the camera cannot be used: " + error.message(), name);
  return OpenedDevice{std::move(camera), std::move(name), std::move(address)};
}

/// The application that still controls the device after a while. Empty if none does, or if the device does not answer.
std::string controller_that_stays(const GigeDevice& device) {
  const auto end = steady_clock::now() + kRelease;
  for (;;) {
    std::string controller = gige_controller(device, kProbe / 2).value_or("");
    if (controller.empty() || steady_clock::now() >= end) return controller;
    std::this_thread::sleep_for(kReleasePoll);
  }
}

Result<OpenedDevice> open_when_free(const GigeDevice& found) {
  if (const std::string controller = controller_that_stays(found); !controller.empty())
    return fail_controlled(controller, found.name());
  return open_gige_device(found);
}

std::optional<GigeDevice> found_before(const AravisCameraOptions& options, const std::string& address) {
  if (address.empty()) return std::nullopt;
  auto found = probe_gige_device(address, options.interface, kProbe / 2);
  if (!found || !is_named(options.id, found->vendor, found->serial)) return std::nullopt;
  return std::move(*found);
}

}  // namespace

std::vector<Usb3Device> list_usb3_devices() {
  static std::mutex mutex;  // Aravis keeps one list; a second call removes its entries
  const std::lock_guard lock(mutex);
  arv_disable_interface("GigEVision");  // slow: discover_gige_devices() has already looked
  arv_update_device_list();
  std::vector<Usb3Device> devices;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    if (std::string_view(text(arv_get_device_protocol(i))) != "USB3Vision") continue;
    devices.push_back({text(arv_get_device_id(i)), printable(text(arv_get_device_vendor(i))),
                       printable(text(arv_get_device_serial_nbr(i)))});
  }
  return devices;
}

Result<OpenedDevice> open_device(const AravisCameraOptions& options, const std::string& address) {
  if (options.names_address()) {
    const auto found = probe_gige_device(options.id, options.interface, kProbe);
    return found ? open_when_free(*found) : tl::unexpected(found.error());
  }
  if (const auto found = found_before(options, address)) return open_when_free(*found);
  const auto named = [&](const auto& device) { return is_named(options.id, device.vendor, device.serial); };
  const auto answered = discover_gige_devices(kProbe, named);
  if (!answered.empty() && named(answered.back())) {
    const auto found = probe_gige_device(answered.back().address, options.interface, kProbe);
    return found ? open_when_free(*found) : tl::unexpected(found.error());
  }
  const auto listed = list_usb3_devices();
  const auto usb3 = std::ranges::find_if(listed, [&](const auto& one) { return named(one) || one.id == options.id; });
  if (usb3 != listed.end()) return open_usb3_device(*usb3);
  return fail(ErrorCode::kNotFound,
              "no GigE Vision or USB3 Vision camera has this name; slsd --list shows all that it finds. Name a camera "
              "in another network by its address",
              options.id);
}

Result<OpenedDevice> open_gige_device(const GigeDevice& found) {
  const std::string name = found.name();
  const auto interface = inet_address(found.interface);
  const auto address = inet_address(found.address);
  GErrorSlot error;
  GObjectPtr<ArvDevice> device(arv_gv_device_new(interface.get(), address.get(), error.out()));
  if (!device || error.failed()) return fail(error.code(), "the camera cannot be opened: " + error.message(), name);
  return control(std::move(device), name, found.address);
}

Result<OpenedDevice> open_usb3_device(const Usb3Device& listed) {
  const std::string name = listed.vendor + "-" + listed.serial;
  GErrorSlot error;
  GObjectPtr<ArvDevice> device(arv_open_device(listed.id.c_str(), error.out()));
  if (!device || error.failed())
    return fail(error.failed() ? error.code() : ErrorCode::kPermissionDenied,
                "the camera cannot be opened: " + error.message() +
                    "; if it is a USB camera, check that the udev rules let this user write to it",
                name);
  return control(std::move(device), name, "");
}

}  // namespace slsd
