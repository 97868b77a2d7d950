// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "docs/tables/configuration_table.hpp"

namespace slsd {
namespace {

constexpr KeyValue kOptional = KeyValue::kOptional;

ConfigurationTable pattern() {
  return {
      "pattern",
      "",
      {{{{"file", R"("patterns/16px-6-no-repeats.toml")", kOptional}},
        "A pattern file, instead of the other keys of this table."},
       {{{"symbol_size_px", "16"}},
        "The side of a symbol's cell: 8, 10, 12, 14 or 16. Small symbols give more points, large ones reach farther."},
       {{{"spacing_px", "2", {}, "1", "16"}}, "Dark pixels between two symbols, {spacing_px}."},
       {{{"symbols", "[9, 11, 13, 14, 18, 19]"}},
        "The 2 to 8 symbols used, by their numbers in docs/alphabet.md, 1 to 25. Without this key, the best ones for "
        "the size."},
       {{{"seed", "1", {}, "0", "4294967295"}},
        "The seed of the random numbers, {seed}. The same seed gives the same pattern on every machine."},
       {{{"method", R"("no_repeats")"}},
        R"("no_repeats": all overlapping 3x3 windows differ as much as possible, and no run of letters recurs nearby )"
        R"(in its row or column. "constructive": the same, but runs may recur. "paper": as Elahi et al. 2020.)"},
       {{{"minimum_distance", "3", kOptional, "1", "9"}},
        "The least number of cells in which any two windows differ, {minimum_distance}. Without this key, the largest "
        "possible number."},
       {{{"half_turn_unique", "false"}}, "Windows also differ from every window turned by 180 degrees."},
       {{{"row_reach", "40", kOptional, "0", "512"}, {"column_reach", "10", kOptional, "0", "512"}},
        R"(Only with "no_repeats": no run recurs within this many columns of its row, or rows of its column, )"
        "{row_reach}. Runs recur if they are three equal letters, four that differ in at most one, or five that differ "
        "in at most two. Without these keys, the search maximises both, row_reach first. If the camera "
        "is above the projector, set row_reach = 0."}}};
}

ConfigurationTable projector() {
  return {
      "projector",
      "",
      {{{{"driver", R"("headless")"}},
        R"("headless" keeps the image in memory. "glfw" shows it on a monitor of the X server in DISPLAY; see )"
        "docs/projector.md."},
       {{{"monitor", R"("")"}},
        R"(The projector's monitor: name, EDID serial number, or position on the desktop, such as "+1280+0". )"
        "slsd --list shows them. Empty: the monitor that is not the primary one."},
       {{{"width_px", "1280", {}, "640", "3840"}, {"height_px", "800", {}, "360", "2160"}},
        "The monitor's native size: {width_px} wide, {height_px} high."},
       {{{"enable_output", "true", kOptional}},
        "Turn the monitor on when it is plugged in, and set it to that size. Without this key: true under "
        "slsd-display.service, else false."},
       {{{"brightness", "1.0", {}, "0", "1"}}, "Dim the picture's light by this factor, {brightness}."},
       {{{"gamma", "1.0", {}, "0.1", "10"}},
        "The projector's gamma, which slsd corrects: its light is the pixel value to this power, {gamma}, mostly 1.8 "
        "to "
        "2.4. Or a list of 2 to 256 rising numbers: its light in any unit, measured at evenly spaced values from 0 to "
        "255, such as [0.4, 7.1, 31, 76, 143]."},
       {{{"black_level", "0", {}, "0", "254"}},
        "The value sent for black, {black_level}, for a projector that clips the lowest values."},
       {{{"refresh_hz", "60.0", {}, "10", "1000"}},
        "Frames per second, {refresh_hz}. With a DLP projector, exposures must last whole frames. 0: steady light, for "
        "which any exposure is right."},
       {{{"idle", R"("pattern")"}},
        R"(The picture between scans: "pattern", "black" (spares lamp and eyes) or "white". If it is not the pattern, )"
        "a scan begins some refreshes and projector_latency_ms later, because it shows the pattern first."},
       {{{"idle_after_ms", "2000", {}, "0", "3600000"}},
        "The time from the end of a scan to that picture, {idle_after_ms}."}}};
}

ConfigurationTable calibration() {
  return {
      "calibration",
      "",
      {{{{"file", R"("")"}},
        "The calibration file: OpenCV YAML, see docs/formats.md. Empty: none, and the service cannot scan."},
       {{{"other_hardware", R"("error")"}},
        R"(If a camera's or projector's serial number differs from the calibration: "error", or "warn" and scan.)"}}};
}

ConfigurationTable decode() {
  return {
      "decode",
      "",
      {{{{"depth_min_mm", "400.0"}, {"depth_max_mm", "2500.0"}},
        "The working range along the camera's axis. A narrower range gives fewer decoding errors."},
       {{{"wrong_cells_max", "0.005", {}, "1e-9", "1"}},
        "How many symbols may get a wrong cell, on average, in a frame made to mislead the decoder, {wrong_cells_max}. "
        "It sets how certain a symbol must be. A smaller value rejects boundaries and small parts. docs/decoder.md "
        "has measurements."},
       {{{"precision", R"("standard")"}},
        R"("fine" fits the pattern to each symbol: several times as accurate as "standard", and several times as slow.)"},
       {{{"density", R"("symbols")"}},
        R"(A point for each symbol: "symbols". Or for each camera pixel: "pixels", see docs/dense.md. A request may choose )"
        "otherwise."},
       {{{"dense_stride_px", "4", {}, "1", "16"}},
        R"(With "pixels": fit the surface at every Nth camera pixel, {dense_stride_px}. Smaller is finer and slower.)"},
       {{{"dense_prune_px", "1.5", {}, "0", "16"}},
        R"(With "pixels": drop points this close to a hole or a jump in depth, {dense_prune_px}.)"},
       {{{"binarize", R"("default")"},
         {"find_regions", R"("default")"},
         {"classify", R"("default")"},
         {"centre", R"("default")"},
         {"link_grid", R"("default")"},
         {"decode_windows", R"("default")"},
         {"correspond", R"("default")"}},
        R"(How each stage works: "default", or "paper" as Elahi et al. 2020 describe it.)"}}};
}

ConfigurationTable frame() {
  return {
      "frame",
      "The frame of a cloud's points, see docs/robot.md.",
      {{{{"output", R"("rig")"}},
        R"("rig": the first camera's. "robot_base": the robot's; with the scanner on the arm, each scan then needs the )"
        "robot's pose. A request may override this key."},
       {{{"hand_eye", R"("")"}},
        R"(The hand_eye.yml that slsctl hand-eye wrote. Empty: none, and only "rig" is possible.)"}}};
}

ConfigurationTable cloud() {
  return {
      "cloud",
      "",
      {{{{"box", "[]"}},
        "Measure only within this box: x, y and z of its least corner, then of its greatest, in mm. Empty: everything. "
        "A request may override this key and those below."},
       {{{"plane", "[]"}},
        "Drop the points on or behind this plane: x, y and z of its unit normal, and its offset along the normal in "
        "mm. slsctl plane measures it. Empty: keep them."},
       {{{"box_frame", R"("rig")"}},
        "The frame of box and plane: \"rig\", the first camera's, or \"robot_base\", which needs [frame] hand_eye."},
       {{{"voxel_mm", "0.0", {}, "0", "1000"}},
        "Keep only the most certain point in each cube with this side length, {voxel_mm}. 0: keep all."},
       {{{"stride", "1", {}, "1", "64"}}, R"(With "pixels": keep the pixels of every Nth row and column, {stride}.)"}}};
}

ConfigurationTable scan() {
  return {
      "scan",
      "",
      {{{{"timeout_ms", "5000", {}, "1", "600000"}},
        "The time that a scan waits for devices and frames, {timeout_ms}, unless the request sets another."},
       {{{"exposure_skew_ms", "100", {}, "0", "10000"}},
        "The greatest difference between the starts of several cameras' exposures in one scan, {exposure_skew_ms}. If "
        "it is greater, the scan fails with frame_skewed."},
       {{{"reopen_first_ms", "100", {}, "1", "60000"}, {"reopen_longest_ms", "1000", {}, "1", "600000"}},
        "The pause before slsd reopens a failed device, {reopen_first_ms}. It doubles with each attempt, up to "
        "reopen_longest_ms: reopen_first_ms to 600000."},
       {{{"projector_latency_ms", "0.0", {}, "0", "1000"}},
        "The delay until the projector shows a new image, {projector_latency_ms}, from the end of its first whole "
        "refresh. A scan's exposure begins no sooner. slsd --calibrate --latency measures it."},
       {{{"power_line_hz", "0"}},
        "The mains frequency, 50 or 60: check exposures against the flicker of lamps. 0: no check."}}};
}

ConfigurationTable server() {
  return {
      "server",
      "",
      {{{{"socket", R"("/run/slsd/slsd.sock")"}}, "The path of the socket, at most 107 bytes."},
       {{{"socket_mode", "0o660"}},
        "The socket's permissions for owner and group. Under slsd.socket, that unit sets them."},
       {{{"observe", R"(["*"])"}, {"scan", R"(["*"])"}, {"administer", R"(["@slsd-admin"])"}},
        R"(The roles of users, groups such as "@video", or "*" for everyone who can open the socket. "observe" gives )"
        R"(status, settings and pattern; "scan" adds scans, subscriptions and frames; "administer" adds reload, set, )"
        "project and calibrate. Root and the service's user may do everything. The group slsd-admin need not exist."},
       {{{"clients_max", "256", {}, "1", "10000"}},
        "The most clients at a time, {clients_max}. A user without the role administer gets at most half of the free "
        "places."},
       {{{"request_bytes_max", "1048576", {}, "1024", "16777216"}},
        "The longest request, {request_bytes_max} bytes. A longer one is an error and ends the connection."},
       {{{"memory_max_mb", "512", {}, "16", "65536"}},
        "Memory for all clients together, {memory_max_mb} MB: requests, images, clouds, and memfds. One client gets at "
        "most half."},
       {{{"send_timeout_ms", "30000", {}, "100", "600000"}},
        "slsd drops a client that reads neither a megabyte nor a whole message in this time, {send_timeout_ms}."}}};
}

ConfigurationTable black_box() {
  return {"black_box",
          "The last scans, kept in memory with their frames. slsctl bundle writes them to one file, and slsd --replay "
          "decodes that file again. If a scan fails in a new way, the service writes such a file by itself.",
          {{{{"memory_max_mb", "16", {}, "0", "512"}},
            "The memory for these scans, {memory_max_mb} MB; 0: keep nothing. A frame of 2 megapixels takes 2 MB."},
           {{{"disk_max_mb", "64", {}, "0", "65536"}},
            "The disk space for the service's own files, {disk_max_mb} MB, and at most 8 files; 0: none. The service "
            "deletes "
            "the oldest first."},
           {{{"folder", R"("")"}},
            R"(The folder of these files. Empty: the folder "bundles" of the unit's StateDirectory=, )"
            "/var/lib/slsd/bundles, if there is one."}}};
}

}  // namespace

std::vector<ConfigurationTable> configuration_tables() {
  std::vector<ConfigurationTable> tables{pattern(), projector()};
  for (ConfigurationTable& table : camera_tables()) tables.push_back(std::move(table));
  for (const auto make : {calibration, decode, cloud, frame, scan, server, black_box}) tables.push_back(make());
  return tables;
}

}  // namespace slsd
