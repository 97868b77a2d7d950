// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <memory>
#include <string>

#include <arv.h>

#include "core/printable.hpp"
#include "core/result.hpp"

namespace slsd {

struct GObjectUnref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
/// Owns one reference of a GObject.
template <class T>
using GObjectPtr = std::unique_ptr<T, GObjectUnref>;

struct GFree {
  void operator()(gpointer memory) const { g_free(memory); }
};
template <class T>
using GMemoryPtr = std::unique_ptr<T, GFree>;

/// Takes the GError of one call.
class GErrorSlot {
 public:
  GErrorSlot() = default;
  ~GErrorSlot() { g_clear_error(&error_); }
  GErrorSlot(const GErrorSlot&) = delete;
  GErrorSlot& operator=(const GErrorSlot&) = delete;

  [[nodiscard]] GError** out() {
    g_clear_error(&error_);
    return &error_;
  }
  [[nodiscard]] bool failed() const { return error_ != nullptr; }
  [[nodiscard]] std::string message() const { return failed() ? printable(error_->message) : "no reason given"; }

  /// The error's code for users of the camera: kDisconnected if the device does not answer, kPermissionDenied if
  /// another application controls it, else kUnsupported.
  [[nodiscard]] ErrorCode code() const {
    if (!failed() || error_->domain != ARV_DEVICE_ERROR) return ErrorCode::kUnsupported;
    switch (error_->code) {
      case ARV_DEVICE_ERROR_TIMEOUT:
      case ARV_DEVICE_ERROR_NOT_CONNECTED:
      case ARV_DEVICE_ERROR_TRANSFER_ERROR:
        return ErrorCode::kDisconnected;
      case ARV_DEVICE_ERROR_NOT_CONTROLLER:
      case ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED:
        return ErrorCode::kPermissionDenied;
      default:
        return ErrorCode::kUnsupported;
    }
  }

 private:
  GError* error_ = nullptr;
};

}  // namespace slsd
