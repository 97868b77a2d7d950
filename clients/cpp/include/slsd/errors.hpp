// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace slsd::client {

/// An error answered by the service, or an error of the connection. The class tells its kind.
class ScannerError : public std::runtime_error {
 public:
  explicit ScannerError(const std::string& message, std::string name = {}, std::string where = {}, int code = 0)
      : std::runtime_error(message), name_(std::move(name)), where_(std::move(where)), code_(code) {}

  /// The error's name in the protocol: "frame_late".
  [[nodiscard]] const std::string& name() const { return name_; }
  /// A file's line, a camera, a key, a socket, or empty.
  [[nodiscard]] const std::string& where() const { return where_; }
  /// The error's code in the protocol: -32018. 0 if the error is not the service's.
  [[nodiscard]] int code() const { return code_; }

 private:
  std::string name_, where_;
  int code_;
};

/// A parameter is unknown or out of range, or the service does not know the method.
class InvalidRequest : public ScannerError {
  using ScannerError::ScannerError;
};
/// No such camera or file; no camera or calibration is configured; a replay has ended.
class NotFound : public ScannerError {
  using ScannerError::ScannerError;
};
/// The client has no right to make this request.
class PermissionDenied : public ScannerError {
  using ScannerError::ScannerError;
};
/// Too many requests or clients, or too little memory: ask again later, or for less.
class Busy : public ScannerError {
  using ScannerError::ScannerError;
};
/// A device was not ready in time (where() names it), or the service did not answer at all.
class TimedOut : public ScannerError {
  using ScannerError::ScannerError;
};
/// The service is stopping.
class Cancelled : public ScannerError {
  using ScannerError::ScannerError;
};
/// The camera or the projector is gone, or does not fit configuration and calibration.
class DeviceError : public ScannerError {
  using ScannerError::ScannerError;
};
/// A frame was lost, torn, late, stale or skewed in every try within the time.
class FrameError : public ScannerError {
  using ScannerError::ScannerError;
};
/// Nobody listens at the socket, or the service hung up.
class ConnectionLost : public ScannerError {
  using ScannerError::ScannerError;
};
/// Nobody listens at the socket.
class NoService : public ConnectionLost {
  using ConnectionLost::ConnectionLost;
};
/// The answer breaks the protocol: another program, or another version, listens there.
class ProtocolError : public ScannerError {
  using ScannerError::ScannerError;
};

}  // namespace slsd::client
