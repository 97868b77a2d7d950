// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/model/model_program.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include "drivers/system/own_program.hpp"

namespace slsd::web {
namespace {

constexpr const char* kModelProgram = "slsd-model";
constexpr std::size_t kLineBytesMax = 1 << 20;
constexpr std::size_t kLastWordsBytes = 2000;

struct Pipe {
  FileDescriptor read, write;
};

Result<Pipe> make_pipe() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return fail(ErrorCode::kIo, "no pipe: " + std::generic_category().message(errno));
  return Pipe{FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

/// Takes the whole lines from a text.
void take_lines(std::string& text, const ModelProgram::OnLine& on_line) {
  std::size_t at = 0;
  for (std::size_t end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
    const nlohmann::json line = nlohmann::json::parse(text.substr(at, end - at), nullptr, /*allow_exceptions=*/false);
    if (line.is_object()) on_line(line);
  }
  text.erase(0, at);
  if (text.size() > kLineBytesMax) text.clear();
}

}  // namespace

bool ModelProgram::is_installed() {
  std::error_code ignored;
  return std::filesystem::exists(find_own_program(kModelProgram), ignored);
}

Result<std::unique_ptr<ModelProgram>> ModelProgram::start(const std::vector<std::string>& arguments, OnLine on_line,
                                                          OnEnd on_end) {
  auto input = make_pipe(), output = make_pipe(), errors = make_pipe();
  for (auto* const pipe : {&input, &output, &errors})
    if (!*pipe) return tl::unexpected(pipe->error());
  auto process = start_own_program(find_own_program(kModelProgram), arguments,
                                   {input->read.number(), output->write.number(), errors->write.number()});
  if (!process) {
    if (process.error().code == ErrorCode::kNotFound)
      process.error().message = "is not installed: install the package slsd-model (sudo apt install slsd-model)";
    return tl::unexpected(std::move(process.error()));
  }
  std::unique_ptr<ModelProgram> program(
      new ModelProgram(*process, std::move(input->write), std::move(on_line), std::move(on_end)));
  program->thread_ = std::jthread([self = program.get(), read = std::move(output->read),
                                   words = std::move(errors->read)] { self->follow(read, words); });
  return program;
}

ModelProgram::~ModelProgram() {
  signal(SIGKILL);
}

void ModelProgram::press_enter() {
  // The pipe is empty: the program reads each line at once, or has ended.
  if (::write(input_.number(), "\n", 1) < 0) return;
}

void ModelProgram::interrupt() {
  signal(SIGINT);
}

void ModelProgram::signal(int number) {
  const std::lock_guard lock(mutex_);
  if (process_ > 0) ::kill(process_, number);
}

void ModelProgram::follow(const FileDescriptor& output, const FileDescriptor& errors) {
  End end;
  read_to_end(output.number(), errors.number(), end.last_words);
  siginfo_t ended{};
  while (::waitid(P_PID, static_cast<id_t>(process_), &ended, WEXITED | WNOWAIT) < 0 && errno == EINTR) continue;
  {
    const std::lock_guard lock(mutex_);
    // From here on the number may be that of another process.
    while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) continue;
    process_ = 0;
  }
  const bool exited = ended.si_code == CLD_EXITED;
  end.status = exited ? ended.si_status : -1;
  end.signal = exited ? 0 : ended.si_status;
  on_end_(end);
}

/// Passes on what the program prints until it closes both ends.
void ModelProgram::read_to_end(int output, int errors, std::string& last_words) {
  std::string text;
  std::array<char, 65536> chunk{};
  std::array<pollfd, 2> waited{{{output, POLLIN, 0}, {errors, POLLIN, 0}}};
  while (waited[0].fd >= 0 || waited[1].fd >= 0) {
    if (::poll(waited.data(), waited.size(), -1) < 0) continue;
    for (pollfd& each : waited) {
      if (each.fd < 0 || each.revents == 0) continue;
      const ssize_t count = ::read(each.fd, chunk.data(), chunk.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) {
        each.fd = -1;
        continue;
      }
      const std::string_view read(chunk.data(), static_cast<std::size_t>(count));
      if (each.fd == output) {
        take_lines(text.append(read), on_line_);
        continue;
      }
      std::fwrite(read.data(), 1, read.size(), stderr);
      last_words.append(read);
      if (last_words.size() > kLastWordsBytes) last_words.erase(0, last_words.size() - kLastWordsBytes);
    }
  }
}

}  // namespace slsd::web
