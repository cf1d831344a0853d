#include "app/commands.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/jobs/run_op.hpp"

namespace vivant::app {
namespace {

struct RunOptions {
  std::string name, in, out;
  std::vector<std::string> attributes;
  bool gradients = false;
};

void add_list(CLI::App& op) {
  CLI::App* command = op.add_subcommand("list", "Name every op");
  command->footer("Example:\n  vivant op list");
  command->callback([] {
    for (const OpInfo& info : all_ops()) fmt::print("{:<28} {}\n", info.name, info.summary);
  });
}

void add_show(CLI::App& op) {
  CLI::App* command = op.add_subcommand("show", "Print an op's inputs, outputs and attributes as JSON");
  command->footer("Example:\n  vivant op show linear");
  const auto name = std::make_shared<std::string>();
  command->add_option("name", *name, "the op")->required();
  command->callback([name] { fmt::print("{}\n", describe_op(op_info(*name)).dump(2)); });
}

void run(const RunOptions& options, const DeviceOptions& device_options) {
  const OpInfo& info = op_info(options.name);
  const nlohmann::json attributes = parse_attributes(info, options.attributes);
  const TensorFile in = read_safetensors(options.in);
  Device device(device_options);
  write_safetensors(options.out, run_op(device, info, attributes, in, options.gradients));
}

void add_run(CLI::App& op, const Globals& globals) {
  CLI::App* command = op.add_subcommand("run", "Run one op on the tensors of a safetensors file");
  command->footer(
      "The input file holds one tensor per input, by name; optional inputs may be missing.\n"
      "With --grad it also holds grad_<output>, and the output file also grad_<input>.\n"
      "Examples:\n"
      "  vivant op run linear --in in.safetensors --out out.safetensors --attr activation=relu\n"
      "  vivant op run linear --in in.safetensors --out out.safetensors --grad --device-class gpu");
  const auto options = std::make_shared<RunOptions>();
  command->add_option("name", options->name, "the op")->required();
  command->add_option("--in", options->in, "tensors to read")->required()->type_name("FILE");
  command->add_option("--out", options->out, "tensors to write")->required()->type_name("FILE");
  command->add_option("--attr", options->attributes, "an attribute; may be repeated")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  command->add_flag("--grad", options->gradients, "gradients, too");
  command->callback([options, &globals] { run(*options, globals.device); });
}

}  // namespace

void add_op(CLI::App& app, const Globals& globals) {
  CLI::App* command = app.add_subcommand("op", "List, describe and run single ops");
  command->footer("Examples:\n  vivant op list\n  vivant op show linear\n  vivant op run linear --help");
  command->require_subcommand(1);
  add_list(*command);
  add_show(*command);
  add_run(*command, globals);
}

}  // namespace vivant::app
