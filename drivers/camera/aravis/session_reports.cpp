// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/camera/aravis/session_reports.hpp"

#include <chrono>

namespace slsd {
namespace {

using std::chrono::steady_clock;

struct Reporter {
  CaptureEvents& events;
  std::uint64_t session;
};

void free_reporter(void* reporter) {
  delete static_cast<Reporter*>(reporter);
}

void free_signal_reporter(void* reporter, GClosure*) {
  free_reporter(reporter);
}

// Runs on the stream's thread. Aravis stamps with CLOCK_REALTIME, which jumps.
void note_stream(void* user, ArvStreamCallbackType type, ArvBuffer* buffer) {
  if (type != ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE || buffer == nullptr) return;
  const Reporter& reporter = *static_cast<Reporter*>(user);
  arv_buffer_set_system_timestamp(buffer, static_cast<guint64>(steady_clock::now().time_since_epoch().count()));
  reporter.events.report_buffer(reporter.session);
}

void note_control_lost(ArvDevice*, void* user) {
  const Reporter& reporter = *static_cast<Reporter*>(user);
  reporter.events.report_lost(reporter.session, "the camera does not answer, or another application took control");
}

}  // namespace

GObjectPtr<ArvStream> make_reporting_stream(ArvCamera* camera, CaptureEvents& events, std::uint64_t session,
                                            GErrorSlot& error) {
  return GObjectPtr<ArvStream>(
      arv_camera_create_stream_full(camera, note_stream, new Reporter{events, session}, free_reporter, error.out()));
}

unsigned long report_loss(ArvDevice* device, CaptureEvents& events, std::uint64_t session) {
  return g_signal_connect_data(device, "control-lost", G_CALLBACK(note_control_lost), new Reporter{events, session},
                               free_signal_reporter, G_CONNECT_DEFAULT);
}

}  // namespace slsd
