// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/usage/usage.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <iostream>
#include <memory>
#include <sstream>

#include <fmt/format.h>

#include "core/nearest_name.hpp"
#include "core/printable.hpp"

namespace slsd {
namespace {

constexpr int kWrongUsage = 2;

/// Lists options as "--density {symbols,pixels}" or "--poses N (3..99)". Leaves out which options need or exclude
/// others: errors explain that.
class PlainHelp : public CLI::Formatter {
 public:
  PlainHelp() {
    label("Positionals", "Arguments");
    label("SUBCOMMAND", "COMMAND");
    column_width(32);
  }
  [[nodiscard]] std::string make_option(const CLI::Option* option, bool is_positional) const override {
    std::string opts = make_option_opts(option);
    if (is_positional && !opts.starts_with(" {")) opts.clear();  // its name explains it
    std::stringstream out;
    CLI::detail::format_help(out, make_option_name(option, is_positional) + opts, make_option_desc(option),
                             column_width_);
    return out.str();
  }
  [[nodiscard]] std::string make_option_opts(const CLI::Option* option) const override {
    if (option->get_type_size() == 0) return {};  // a flag
    std::string type = option->get_type_name();
    const std::size_t limits = type.find(':');
    if (limits != std::string::npos && type.compare(limits, 2, ":{") == 0) {
      type.erase(0, limits + 1);
    } else if (limits != std::string::npos && type.find("..", limits) != std::string::npos) {
      type.replace(limits, 1, " (") += ")";
    }
    return " " + type + (option->get_expected_max() == CLI::detail::expected_max_vector_size ? " ..." : "");
  }
};

// A closed standard stream would pass its number on to the next file or socket, and text meant for the stream would go
// there. Opened the wrong way round, its use still fails.
void hold_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(stream, F_GETFD) < 0 && errno == EBADF)
      (void)::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

void refuse_options_as_values(CLI::App& app) {
  const auto lacks_value = [&app](const std::string& value) {
    if (value.empty()) return std::string("an empty value: is a variable unset? Leave the option out for its default");
    for (const CLI::App* at = &app; at != nullptr; at = at->get_parent())
      if (at->get_option_no_throw(value) != nullptr) return "a value is missing before " + value;
    return std::string();
  };
  for (CLI::Option* option : app.get_options())
    if (option->get_items_expected_min() > 0) option->check(lacks_value);
  for (CLI::App* command : app.get_subcommands(nullptr)) refuse_options_as_values(*command);
}

/// The given command, or the program itself.
const CLI::App& chosen_command(const CLI::App& app) {
  const auto given = app.get_subcommands();
  return given.empty() ? app : *given.back();
}

std::string full_name(const CLI::App& command) {
  return command.get_parent() == nullptr ? command.get_name()
                                         : command.get_parent()->get_name() + " " + command.get_name();
}

bool looks_like_option(const std::string& word) {
  return word.size() > 1 && word.front() == '-';
}

/// The first argument that nothing accepts. Options come before others, because a misspelt one leaves its value behind.
std::optional<std::string> unknown_argument(const CLI::App& app) {
  auto words = app.remaining(/*recurse=*/true);
  std::erase(words, "--");
  const auto option = std::ranges::find_if(words, looks_like_option);
  if (option != words.end()) return *option;
  return words.empty() ? std::nullopt : std::optional(words.front());
}

std::string unknown_option(const CLI::App& app, const CLI::App& chosen, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  const std::string bare = name.substr(name.find_first_not_of('-') == 1 ? 1 : std::min<std::size_t>(2, name.size()));
  std::vector<std::string> names;
  for (const CLI::App* at = &chosen; at != nullptr; at = at->get_parent())
    for (const CLI::Option* option : at->get_options())
      names.insert(names.end(), option->get_lnames().begin(), option->get_lnames().end());
  std::string problem = "there is no option " + quoted(name);
  if (const auto nearest = nearest_name(bare, names)) return problem + "; did you mean --" + *nearest + "?";
  for (const CLI::App* command : app.get_subcommands(nullptr))
    if (command->get_option_no_throw(name) != nullptr) return problem + " here: it belongs to " + full_name(*command);
  return problem;
}

std::string unknown_word(const CLI::App& app, const CLI::App& chosen, const std::string& word) {
  const auto commands = app.get_subcommands(nullptr);
  if (&chosen != &app || commands.empty()) return "unexpected argument " + quoted(word);
  std::vector<std::string> names;
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  return "there is no command " + quoted(word) + nearest_hint(word, names);
}

/// Describes the first missing argument: "FILE, the PNG to write".
std::string missing_argument(const CLI::App& chosen, const CLI::ParseError& error) {
  for (const CLI::Option* option : chosen.get_options())
    if (option->get_required() && option->count() == 0)
      return option->get_name(/*positional=*/option->get_positional()) + " is missing: " + option->get_description();
  return error.what();
}

/// Rewords CLI11's other errors plainly.
std::string other_error(const CLI::App& chosen, const CLI::ParseError& error) {
  const std::string text = error.what();
  const std::string option = text.substr(0, text.find_first_of(": "));
  const auto contains = [&](const char* words) { return text.find(words) != std::string::npos; };
  switch (static_cast<CLI::ExitCodes>(error.get_exit_code())) {
    case CLI::ExitCodes::RequiredError:
      return missing_argument(chosen, error);
    case CLI::ExitCodes::ArgumentMismatch:
      return contains("missing") ? option + " needs a value" : contains("At Most") ? option + " is given twice" : text;
    case CLI::ExitCodes::ConversionError:
      return contains(" = ")
                 ? text.substr(text.find("--"), text.find(" = ") - text.find("--")) + " takes a whole number"
                 : text;
    case CLI::ExitCodes::ExcludesError:
      return text.substr(0, text.find(' ')) + " and " + text.substr(text.rfind(' ') + 1) + " do not go together";
    case CLI::ExitCodes::RequiresError:
      return text.substr(0, text.find(" requires ")) + " needs " + text.substr(text.find(" requires ") + 10);
    default:
      return printable(text, 1000);
  }
}

std::string explain(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& chosen = chosen_command(app);
  const auto unknown = unknown_argument(app);
  const auto kind = static_cast<CLI::ExitCodes>(error.get_exit_code());
  const bool lacks_command = &chosen == &app && app.get_require_subcommand_min() > 0;
  if (lacks_command && !unknown && kind == CLI::ExitCodes::RequiredError)
    return app.help() + "\n" + app.get_name() + ": choose one of these commands\n";
  std::string problem;
  if (unknown && looks_like_option(*unknown)) {  // an unknown option explains the other errors
    problem = unknown_option(app, chosen, *unknown);
  } else if (unknown && (lacks_command || kind == CLI::ExitCodes::ExtrasError)) {
    problem = unknown_word(app, chosen, *unknown);
  } else {
    problem = other_error(chosen, error);
  }
  return full_name(chosen) + ": " + problem + "\nsee \"" + full_name(chosen) + " --help\"\n";
}

}  // namespace

std::string quoted(const std::string& word) {
  return "\"" + printable(word, 200) + "\"";
}

CLI::Validator one_of(std::vector<std::string> words) {
  const std::string list = fmt::format("{}", fmt::join(words, ","));
  return {[words = std::move(words)](const std::string& value) {
            if (std::ranges::find(words, value) != words.end()) return std::string();
            return fmt::format("{} is not one of {}", quoted(value), fmt::join(words, ", ")) +
                   nearest_hint(value, words);
          },
          "{" + list + "}"};
}

CLI::Validator between(double least, double most) {
  return {[=](const std::string& value) {
            double number = 0;
            if (CLI::detail::lexical_cast(value, number) && number >= least && number <= most) return std::string();
            return fmt::format("{} is not a number from {} to {}", quoted(value), least, most);
          },
          fmt::format("{}..{}", least, most)};
}

std::optional<int> parse_usage(CLI::App& app, int argc, const char* const* argv, const std::function<void()>& check) {
  hold_standard_streams();
  refuse_options_as_values(app);
  const auto help = std::make_shared<PlainHelp>();
  app.formatter(help);
  for (CLI::App* command : app.get_subcommands(nullptr)) command->formatter(help);
  try {
    app.parse(argc, argv);
    if (check) check();
  } catch (const CLI::ParseError& error) {
    const auto unknown = unknown_argument(app);
    const bool helps = error.get_exit_code() == 0 && (!unknown || &chosen_command(app) != &app);
    if (helps) return app.exit(error);
    std::cerr << explain(app, error) << std::flush;
    return kWrongUsage;
  }
  return std::nullopt;
}

}  // namespace slsd
