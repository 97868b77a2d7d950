// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/doubles/x11/x_server.hpp"

#include <cctype>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace slsd::test {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto kTimeout = 30s;
constexpr int kFirstDisplay = 1000;  // servers that look for a number themselves take the lowest that is free
constexpr int kDisplays = 50000;
constexpr int kDisplaysOfAProcess = 16;
constexpr int kTrials = 3;
constexpr const char* kXorg = "/usr/lib/xorg/Xorg";  // the program itself: the one in PATH may insist on a console

constexpr const char* kDummyConfiguration = R"(
Section "ServerFlags"
  Option "AutoAddDevices" "false"
  Option "AutoAddGPU" "false"
EndSection
Section "Device"
  Identifier "dummy"
  Driver "dummy"
  VideoRam 131072
EndSection
Section "Monitor"
  Identifier "monitor"
  HorizSync 5.0 - 1000.0
  VertRefresh 5.0 - 200.0
  Modeline "1024x768" 65.00 1024 1048 1184 1344 768 771 777 806
  Modeline "640x360" 18.00 640 664 720 800 360 363 368 374
  Modeline "1280x800" 83.50 1280 1352 1480 1680 800 803 809 831
  Modeline "1920x1080" 173.00 1920 2048 2248 2576 1080 1083 1088 1120
EndSection
Section "Screen"
  Identifier "screen"
  Device "dummy"
  Monitor "monitor"
  DefaultDepth 24
  SubSection "Display"
    Depth 24
    Modes "1024x768" "640x360" "1280x800" "1920x1080"
  EndSubSection
EndSection
)";

std::string make_folder() {
  std::string name = (std::filesystem::temp_directory_path() / "slsd-x11-XXXXXX").string();
  return ::mkdtemp(name.data()) != nullptr ? name : std::string();
}

// One that no other server takes while this one is about to be started again.
std::string own_display() {
  static int taken = 0;
  return ":" + std::to_string(kFirstDisplay + (kDisplaysOfAProcess * ::getpid() + taken++) % kDisplays);
}

[[noreturn]] void become(const std::vector<std::string>& command) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int nowhere = ::open("/dev/null", O_WRONLY);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  ::execvp(arguments.front(), arguments.data());
  ::_exit(127);
}

// The number that the server writes when it is ready; empty where it ends or takes too long.
std::string read_number(int descriptor) {
  const auto deadline = steady_clock::now() + kTimeout;
  std::string number;
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - steady_clock::now());
    pollfd readable{descriptor, POLLIN, 0};
    if (left <= 0ms || ::poll(&readable, 1, static_cast<int>(left.count())) <= 0) return {};
    char letter = 0;
    if (::read(descriptor, &letter, 1) != 1) return {};
    if (letter == '\n') return number;
    number += letter;
  }
}

}  // namespace

std::unique_ptr<XServer> XServer::start_virtual(int width_px, int height_px) {
  const std::string screen = std::to_string(width_px) + "x" + std::to_string(height_px) + "x24";
  return started(
      std::unique_ptr<XServer>(new XServer({"Xvfb", "-screen", "0", screen, "-nolisten", "tcp", "-noreset"})));
}

std::unique_ptr<XServer> XServer::start_dummy() {
  const std::string folder = make_folder();
  std::ofstream(folder + "/xorg.conf") << kDummyConfiguration;
  std::unique_ptr<XServer> server(new XServer({kXorg, "-config", folder + "/xorg.conf", "-configdir", folder + "/none",
                                               "-logfile", folder + "/log", "-nolisten", "tcp", "-noreset"}));
  server->folder_ = folder;
  return started(std::move(server));
}

std::unique_ptr<XServer> XServer::started(std::unique_ptr<XServer> server) {
  for (int i = 0; i < kTrials; ++i) {
    if (!server->start(own_display())) continue;
    ::setenv("DISPLAY", server->display_.c_str(), 1);
    return server;
  }
  return nullptr;
}

XServer::~XServer() {
  if (process_ > 0) ::kill(process_, SIGTERM);
  thaw();
  if (process_ > 0) ::waitpid(process_, nullptr, 0);
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

bool XServer::start(const std::string& display) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return false;
  std::vector<std::string> command = command_;
  command.insert(command.begin() + 1, display);
  const int outlet = ::fcntl(ends[1], F_DUPFD, 3);  // without close-on-exec
  command.insert(command.end(), {"-displayfd", std::to_string(outlet)});
  process_ = ::fork();
  if (process_ == 0) become(command);
  ::close(outlet);
  ::close(ends[1]);
  const std::string number = read_number(ends[0]);
  ::close(ends[0]);
  if (number.empty()) kill();
  display_ = ":" + number;
  return !number.empty();
}

void XServer::kill() {
  if (process_ <= 0) return;
  ::kill(process_, SIGKILL);
  ::waitpid(process_, nullptr, 0);
  process_ = -1;
}

void XServer::freeze() {
  if (process_ > 0) ::kill(process_, SIGSTOP);
}

void XServer::thaw() {
  if (process_ > 0) ::kill(process_, SIGCONT);
}

bool XServer::restart() {
  return start(std::string(display_));
}

}  // namespace slsd::test
