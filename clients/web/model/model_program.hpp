// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <sys/types.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/result.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd::web {

/// slsd-model as a child of this process, which ends with it: its input is a pipe, and so is its output.
/// @thread thread-safe; the callbacks come from a thread of its own
class ModelProgram {
 public:
  /// The program's end.
  struct End {
    int status = 0;          ///< the exit status; -1 if a signal ended it
    int signal = 0;          ///< 0: none
    std::string last_words;  ///< end of its standard error
  };
  using OnLine = std::function<void(const nlohmann::json&)>;
  using OnEnd = std::function<void(const End&)>;

  /// Tells whether the program is installed.
  [[nodiscard]] static bool is_installed();

  /// @param on_line  takes each object of JSON that the program prints
  /// @param on_end   is called once, after the last line
  /// @errors kNotFound: it is not installed, with the remedy; kIo
  [[nodiscard]] static Result<std::unique_ptr<ModelProgram>> start(const std::vector<std::string>& arguments,
                                                                   OnLine on_line, OnEnd on_end);
  /// Kills the program if it still runs, and waits for its end.
  ~ModelProgram();
  ModelProgram(const ModelProgram&) = delete;
  ModelProgram& operator=(const ModelProgram&) = delete;

  /// Writes an empty line to its input, as the key Enter does.
  void press_enter();
  /// Asks it to end as Ctrl-C does: with the model of the clouds so far.
  void interrupt();

 private:
  ModelProgram(pid_t process, FileDescriptor input, OnLine on_line, OnEnd on_end)
      : process_(process), input_(std::move(input)), on_line_(std::move(on_line)), on_end_(std::move(on_end)) {}

  void follow(const FileDescriptor& output, const FileDescriptor& errors);
  void read_to_end(int output, int errors, std::string& last_words);
  void signal(int number);

  std::mutex mutex_;  ///< guards the next
  pid_t process_;     ///< 0 once it ended
  FileDescriptor input_;
  OnLine on_line_;
  OnEnd on_end_;
  std::jthread thread_;
};

}  // namespace slsd::web
