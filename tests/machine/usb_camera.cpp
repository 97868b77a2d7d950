// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
//
// A USB camera in user space for the kernel's own drivers (vhci_hcd and uvcvideo): UVC 1.1, grey, bulk transfers, with
// exposure time and gain.
//   usb-camera SERIAL WIDTHxHEIGHT FPS FRAME COMMANDS
// FRAME is a file of raw pixels; COMMANDS a pipe (mkfifo), of which each line is one of kCommands. Linux's USB/IP
// protocol is in Documentation/usb/usbip_protocol.rst of its sources.
#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace {

constexpr const char* kCommands =
    "unplug | plug | err N (an error bit in N frames) | short N | drop N | stall 0|1 | hang (nothing until the stream "
    "is "
    "started anew) | fail N (N transfers fail, as by a bad cable; the kernel queues none of them again)";

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& bytes, std::uint32_t value, int size) {  // USB is little endian
  for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

void append(Bytes& bytes, const Bytes& more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

void set16(Bytes& bytes, std::size_t at, std::size_t value) {
  bytes[at] = static_cast<std::uint8_t>(value);
  bytes[at + 1] = static_cast<std::uint8_t>(value >> 8);
}

// A message of USB/IP; all big endian. What the last words mean depends on the command.
struct Message {
  std::uint32_t command, number, device, direction, endpoint;
  std::array<std::uint32_t, 5> words;
  std::array<std::uint8_t, 8> setup;
};
static_assert(sizeof(Message) == 48);
constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinked = 4;

struct Format {
  int width, height, fps;
  std::uint32_t bytes() const { return static_cast<std::uint32_t>(width * height); }
  std::uint32_t interval_100ns() const { return static_cast<std::uint32_t>(10'000'000 / fps); }
};

constexpr std::uint32_t kPayload = 16384;
constexpr std::uint8_t kCameraTerminal = 1, kProcessingUnit = 2, kOutputTerminal = 3, kBulkIn = 0x81;

// The chapters of USB Video Class 1.1 behind each line: 3.7.2 (control), 3.9.2 (streaming), 3.1 of "uncompressed".
Bytes describe(const Format& format) {
  Bytes control{13, 0x24, 1, 0x10, 1, 0, 0, 0x00, 0x6c, 0xdc, 2, 1, 1};
  append(control, {18, 0x24, 2, kCameraTerminal, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0x0a, 0, 0});  // its exposure
  append(control, {12, 0x24, 5, kProcessingUnit, kCameraTerminal, 0, 0, 2, 0x00, 0x02, 0, 0});   // its gain
  append(control, {9, 0x24, 3, kOutputTerminal, 1, 1, 0, kProcessingUnit, 0});
  set16(control, 5, control.size());

  Bytes streaming{15, 0x24, 1, 1, 0, 0, kBulkIn, 0, kOutputTerminal, 0, 0, 0, 1, 0, 0};
  append(streaming, {27, 0x24, 4,    1, 1,    'Y',  '8',  '0', '0', 0, 0, 0x10, 0, 0x80,
                     0,  0,    0xaa, 0, 0x38, 0x9b, 0x71, 8,   1,   0, 0, 0,    0});
  append(streaming, {30, 0x24, 5, 1, 0});
  append(streaming, static_cast<std::uint32_t>(format.width), 2);
  append(streaming, static_cast<std::uint32_t>(format.height), 2);
  append(streaming, format.bytes() * 8, 4);
  append(streaming, format.bytes() * 8 * static_cast<std::uint32_t>(format.fps), 4);
  append(streaming, format.bytes(), 4);
  append(streaming, format.interval_100ns(), 4);
  streaming.push_back(1);
  append(streaming, format.interval_100ns(), 4);
  append(streaming, {6, 0x24, 0x0d, 1, 1, 4});
  set16(streaming, 4, streaming.size());

  Bytes all{9, 2, 0, 0, 2, 1, 0, 0x80, 250, 8, 11, 0, 2, 0x0e, 3, 0, 0, 9, 4, 0, 0, 0, 0x0e, 1, 0, 0};
  append(all, control);
  append(all, {9, 4, 1, 0, 1, 0x0e, 2, 0, 0});
  append(all, streaming);
  append(all, {7, 5, kBulkIn, 2, 0, 2, 0});
  set16(all, 2, all.size());
  return all;
}

Bytes describe(const std::string& text) {
  Bytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char letter : text) append(bytes, static_cast<std::uint8_t>(letter), 2);
  return bytes;
}

// What a host may set: in steps of the device.
struct Control {
  int unit, selector, size;
  std::int32_t value, least, most, resolution;
};

class Camera {
 public:
  Camera(std::string serial, Format format, std::string frame)
      : serial_(std::move(serial)), format_(format), frame_path_(std::move(frame)), description_(describe(format)) {
    plug();
  }

  int socket() const { return socket_; }

  void obey(const std::string& line) {
    std::istringstream words(line);
    std::string name;
    int number = 1;
    words >> name >> number;
    if (name == "plug") plug();
    if (name == "unplug") unplug();
    if (name == "err") wrong_ += number;
    if (name == "short") short_ += number;
    if (name == "drop") dropped_ += number;
    if (name == "fail") failing_ += number;
    if (name == "stall") stalled_ = number != 0;
    if (name == "hang") hung_ = true;
    std::cout << line << std::endl;
  }

  void tick() {
    due_ = true;
    send_frame();
  }

  void receive() {
    Message message{};
    if (!read_all(&message, sizeof message)) return lose_host();
    const std::uint32_t length = ntohl(message.words[1]);
    if (ntohl(message.command) == kUnlink) return unlink(message);
    Bytes data(ntohl(message.direction) == 0 ? length : 0);
    if (!read_all(data.data(), data.size())) return lose_host();
    if (ntohl(message.endpoint) == 0) {
      answer(message, data);
    } else {
      waiting_.push_back({ntohl(message.number), length});
      send_frame();
    }
  }

 private:
  struct Transfer {
    std::uint32_t number, length;
  };

  static constexpr const char* kHost = "/sys/devices/platform/vhci_hcd.0/";

  static void write_line(const std::string& file, const std::string& text) {
    std::ofstream out(kHost + file);
    if (!(out << text << std::flush)) std::cerr << kHost << file << ": " << std::strerror(errno) << std::endl;
  }

  void plug() {
    std::array<int, 2> ends{};
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) std::abort();
    constexpr int kBuffer = 4 << 20;
    for (const int end : ends) setsockopt(end, SOL_SOCKET, SO_SNDBUF, &kBuffer, sizeof kBuffer);
    write_line("attach", "0 " + std::to_string(ends[1]) + " 65538 3");  // port, socket, device, high speed
    close(ends[1]);
    socket_ = ends[0];
  }

  void unplug() {
    write_line("detach", "0");
    lose_host();
  }

  void lose_host() {
    if (socket_ >= 0) close(socket_);
    socket_ = -1;
    waiting_.clear();
    sent_ = 0;
  }

  bool read_all(void* data, std::size_t size) const {
    return size == 0 || recv(socket_, data, size, MSG_WAITALL) == static_cast<ssize_t>(size);
  }

  void reply(std::uint32_t command, std::uint32_t number, int status, const Bytes& data, std::size_t actual) const {
    Message message{};
    message.command = htonl(command);
    message.number = htonl(number);
    message.words = {htonl(static_cast<std::uint32_t>(status)), htonl(static_cast<std::uint32_t>(actual)), 0,
                     0xffffffff, 0};
    Bytes bytes(sizeof message);
    std::memcpy(bytes.data(), &message, sizeof message);
    append(bytes, data);
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t sent = send(socket_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
      if (sent <= 0) return;  // unplugged
      done += static_cast<std::size_t>(sent);
    }
  }

  void unlink(const Message& message) {
    const std::uint32_t number = ntohl(message.words[0]);
    const auto found = std::erase_if(waiting_, [&](const Transfer& transfer) { return transfer.number == number; });
    reply(kUnlinked, ntohl(message.number), found != 0 ? -ECONNRESET : 0, {}, 0);
    if (waiting_.empty()) sent_ = 0;
  }

  void answer(const Message& message, const Bytes& data) {
    const auto& setup = message.setup;
    Bytes bytes;
    const bool known = setup[0] == 0x80            ? answer_standard(setup, bytes)
                       : (setup[0] & 0x7f) == 0x21 ? answer_video(setup, data, bytes)
                                                   : true;  // a configuration or an interface that is chosen
    const std::size_t asked = setup[6] | setup[7] << 8;
    if ((setup[0] & 0x80) != 0) bytes.resize(std::min(bytes.size(), asked));
    reply(kSubmitted, ntohl(message.number), known ? 0 : -EPIPE, bytes, data.empty() ? bytes.size() : data.size());
  }

  bool answer_standard(const std::array<std::uint8_t, 8>& setup, Bytes& bytes) const {
    if (setup[1] == 0) bytes = {0, 0};
    if (setup[1] == 8) bytes = {1};
    if (setup[1] != 6) return setup[1] == 0 || setup[1] == 8;
    switch (setup[3]) {
      case 1:
        bytes = {18, 1, 0, 2, 0xef, 2, 1, 64, 0x6b, 0x1d, 2, 1, 0, 1, 1, 2, 3, 1};
        return true;
      case 2:
        bytes = description_;
        return true;
      case 3:
        bytes = setup[2] == 0   ? Bytes{4, 3, 9, 4}
                : setup[2] == 1 ? describe(std::string("slsd"))
                : setup[2] == 2 ? describe(std::string("Test Camera"))
                                : describe(serial_);
        return true;
      case 6:
        bytes = {10, 6, 0, 2, 0xef, 2, 1, 64, 1, 0};
        return true;
      default:
        return false;
    }
  }

  bool answer_video(const std::array<std::uint8_t, 8>& setup, const Bytes& data, Bytes& bytes) {
    const int request = setup[1], selector = setup[3], unit = setup[5];
    if (setup[4] == 1) {  // the streaming interface: probe, and commit, which starts it
      if (request == 1 && selector == 2) hung_ = due_ = false, sent_ = 0;
      bytes = request == 0x85 ? Bytes{34, 0} : request == 0x86 ? Bytes{3} : request == 1 ? Bytes{} : probe();
      return true;
    }
    for (Control& control : controls_) {
      if (control.unit != unit || control.selector != selector) continue;
      if (request == 1 && data.size() >= static_cast<std::size_t>(control.size)) {
        control.value = 0;
        std::memcpy(&control.value, data.data(), static_cast<std::size_t>(control.size));
        std::cout << "control " << unit << "." << selector << " = " << control.value << std::endl;
      }
      const std::int32_t value = request == 0x82   ? control.least
                                 : request == 0x83 ? control.most
                                 : request == 0x84 ? control.resolution
                                                   : control.value;
      if (request == 0x85)
        bytes = {static_cast<std::uint8_t>(control.size), 0};
      else if (request == 0x86)
        bytes = {3};
      else if (request != 1)
        append(bytes, static_cast<std::uint32_t>(value), control.size);
      return true;
    }
    return false;
  }

  Bytes probe() const {
    Bytes bytes{1, 0, 1, 1};
    append(bytes, format_.interval_100ns(), 4);
    bytes.resize(18);
    append(bytes, format_.bytes(), 4);
    append(bytes, kPayload, 4);
    append(bytes, 48'000'000, 4);
    append(bytes, {3, 1, 1, 1});
    return bytes;
  }

  bool begin_frame() {
    if (dropped_ > 0) return --dropped_, false;
    std::ifstream file(frame_path_, std::ios::binary);
    frame_.assign(std::istreambuf_iterator<char>(file), {});
    frame_.resize(format_.bytes());
    frame_is_wrong_ = wrong_ > 0 && wrong_-- > 0;
    if (short_ > 0 && short_-- > 0) frame_.resize(frame_.size() / 2);
    return true;
  }

  // Answers the transfers that wait, as far as a frame is due.
  void send_frame() {
    for (; failing_ > 0 && !waiting_.empty(); --failing_, waiting_.pop_front(), sent_ = 0)
      reply(kSubmitted, waiting_.front().number, -EPROTO, {}, 0);
    while (due_ && !stalled_ && !hung_ && !waiting_.empty()) {
      if (sent_ == 0 && !begin_frame()) {
        due_ = false;
        return;
      }
      const std::size_t size = std::min(kPayload, waiting_.front().length) - 2;
      const std::size_t part = std::min(size, frame_.size() - sent_);
      const bool last = sent_ + part == frame_.size();
      Bytes payload{2, static_cast<std::uint8_t>(0x80 | toggle_ | (last ? 2 : 0) | (frame_is_wrong_ ? 0x40 : 0))};
      const auto begin = frame_.begin() + static_cast<std::ptrdiff_t>(sent_);
      payload.insert(payload.end(), begin, begin + static_cast<std::ptrdiff_t>(part));
      sent_ += part;
      if (last) sent_ = 0, toggle_ ^= 1, due_ = false;
      reply(kSubmitted, waiting_.front().number, 0, payload, payload.size());
      waiting_.pop_front();
    }
  }

  std::string serial_;
  Format format_;
  std::string frame_path_;
  Bytes description_;
  std::array<Control, 3> controls_{{{kCameraTerminal, 2, 1, 8, 1, 8, 9},        // automatic exposure: a set of modes
                                    {kCameraTerminal, 4, 4, 100, 1, 10000, 1},  // exposure, in 100 us
                                    {kProcessingUnit, 4, 2, 64, 0, 255, 1}}};   // gain
  int socket_ = -1;
  std::deque<Transfer> waiting_;
  Bytes frame_;
  std::size_t sent_ = 0;  // of the frame
  int toggle_ = 0;
  bool frame_is_wrong_ = false, due_ = false;
  int wrong_ = 0, short_ = 0, dropped_ = 0, failing_ = 0;
  bool stalled_ = false, hung_ = false;
};

[[noreturn]] void run(Camera& camera, int commands, int fps) {
  const int timer = timerfd_create(CLOCK_MONOTONIC, 0);
  const timespec period{fps == 1 ? 1 : 0, fps == 1 ? 0 : 1'000'000'000L / fps};
  const itimerspec every{period, period};
  timerfd_settime(timer, 0, &every, nullptr);
  std::string text;
  for (;;) {
    std::array<pollfd, 3> events{{{timer, POLLIN, 0}, {commands, POLLIN, 0}, {camera.socket(), POLLIN, 0}}};
    poll(events.data(), events.size(), -1);
    std::uint64_t periods = 0;
    if (events[0].revents != 0 && read(timer, &periods, sizeof periods) > 0) camera.tick();
    if ((events[1].revents & POLLIN) != 0) {
      std::array<char, 256> part{};
      const ssize_t size = read(commands, part.data(), part.size());
      if (size > 0) text.append(part.data(), static_cast<std::size_t>(size));
      for (std::size_t end = 0; (end = text.find('\n')) != std::string::npos; text.erase(0, end + 1))
        camera.obey(text.substr(0, end));
      continue;  // the socket may be another by now
    }
    if (camera.socket() >= 0 && events[2].revents != 0) camera.receive();
  }
}

}  // namespace

int main(int count, char** words) {
  Format format{};
  if (count != 6 || std::sscanf(words[2], "%dx%d", &format.width, &format.height) != 2 ||
      (format.fps = std::atoi(words[3])) < 1) {
    std::cerr << "usage: usb-camera SERIAL WIDTHxHEIGHT FPS FRAME COMMANDS\ncommands: " << kCommands << "\n";
    return 2;
  }
  const int commands = open(words[5], O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (commands < 0) {
    std::cerr << words[5] << ": " << std::strerror(errno) << "\n";
    return 1;
  }
  Camera camera(words[1], format, words[4]);
  run(camera, commands, format.fps);
}
