// The command line. Exit codes: 0 done, 1 failed, 2 used wrongly, 130 stopped by Ctrl-C.
#include <fmt/format.h>

#include <cstdlib>
#include <new>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "app/commands.hpp"
#include "vivant/jobs/interrupt.hpp"

namespace {

int complain(const char* message, int exit_code) {
  fmt::print(stderr, "vivant: {}\n", message);
  return exit_code;
}

/// One line for wrong usage: what is wrong, and which help to read.
int complain_of_usage(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* command = &app;
  std::string path = app.get_name(), what = error.what();
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().back();
    path += " " + command->get_name();
  }
  const std::vector<std::string> unknown = app.remaining(true);
  if (error.get_name() == "RequiredError" && command->get_require_subcommand_min() > 0 && !unknown.empty())
    what = fmt::format("there is no command '{}'", unknown.front());
  return complain(fmt::format("{} (see `{} --help`)", what, path).c_str(), 2);
}

void add_global_options(CLI::App& app, vivant::app::Globals& globals) {
  app.add_option(
         "--device", globals.device.device,
         "OpenCL device: a number or part of a name from `vivant devices`; else $VIVANT_DEVICE, else the "
         "first GPU, else the first CPU")
      ->type_name("NUMBER|NAME");
  app.add_option("--device-class", globals.device.device_class, "force this form of the kernels")
      ->check(CLI::IsMember({"cpu", "gpu"}))
      ->type_name("cpu|gpu");
  app.add_option("--math", globals.device.math,
                 "arithmetic of matrix products: fp32, bf16x3 (as exact, faster on AMX) or bf16; else "
                 "$VIVANT_MATH, else bf16x3 where the processor has AMX, else fp32")
      ->check(CLI::IsMember({"fp32", "bf16x3", "bf16"}))
      ->type_name("fp32|bf16x3|bf16");
  app.add_option_function<std::string>(
         "--progress",
         [&globals](const std::string& name) { globals.progress = vivant::progress_mode_from(name); },
         "how long work shows its progress; auto: a bar on a terminal, else none")
      ->type_name("auto|bar|json|none");
  app.add_flag("--profile", globals.device.profile, "time every kernel and print the totals at the end");
  app.add_flag("--verbose", globals.verbose, "say more, such as which kernels are compiled")
      ->each([](const std::string&) { setenv("VIVANT_VERBOSE", "1", 1); });
}

int run(int argc, char** argv) {
#ifdef __GLIBC__
  // Large buffers go back to the system when they are freed, and leave no gaps that make a long run grow.
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
#endif
  CLI::App app("From a monocular video of a moving person and any painting to a stylised 4D video.",
               "vivant");
  app.footer(
      "`vivant COMMAND --help` explains a command and shows examples. The options above may stand behind any "
      "command.");
  app.set_help_all_flag("--help-all", "the help of every command");
  app.require_subcommand(1);
  app.fallthrough();  // global options may stand behind the command, too
  vivant::app::Globals globals;
  add_global_options(app, globals);
  vivant::app::add_synth(app, globals);
  vivant::app::add_pretrain_stylizer(app, globals);
  vivant::app::add_devices(app, globals);
  vivant::app::add_op(app, globals);
  vivant::app::add_bench(app, globals);
  vivant::app::add_tune(app, globals);
  vivant::app::add_train(app, globals);
  vivant::app::add_render(app, globals);
  vivant::app::add_batch(app, globals);
  vivant::app::add_eval(app, globals);
  vivant::app::add_stylise(app, globals);
  vivant::app::add_reproduce(app, globals);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return complain_of_usage(app, error);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) try { return run(argc, argv); } catch (const vivant::UsageError& error) {
  return complain(error.what(), 2);
} catch (const vivant::Interrupted& stopped) {
  return complain(stopped.what(), 130);
} catch (const std::bad_alloc&) {
  return complain("out of memory: use smaller images, fewer rays or a smaller preset", 1);
} catch (const std::exception& error) {
  return complain(error.what(), 1);
}
