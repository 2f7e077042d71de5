// fanstream-bench: sizes, shapes and speeds beside other programs' in one run; what views take; costs of merges; the
// source documents' tables; training; load.
#include "common/support/result.h"
#include "tests/bench/bench_command.h"

int main(int argc, char** argv) {
  using namespace fanstream;
  using namespace fanstream::bench;
  std::string command_line = "fanstream-bench";
  for (int i = 1; i < argc; ++i) command_line += std::string(" ") + argv[i];
  CLI::App app("Measures Fanstream beside other programs, on the same models and grid, in one run.");
  app.require_subcommand(1);
  app.footer(
      "Example:\n  fanstream-bench models ../shared/data/stanford_bunny_zipper.ply --quick\n\n"
      "'fanstream-bench COMMAND --help' tells more. Exit codes: 0 measured, 2 usage, 3 no such file, 4 writing, 5 bad "
      "input or a result that is not exact, 7 limit, 8 network.");
  const BenchCommand commands[] = {add_models_command(app), add_views_command(app), add_costs_command(app),
                                   add_papers_command(app), add_train_command(app), add_load_command(app)};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : exit_code(ErrorKind::usage);
  }
  for (const BenchCommand& command : commands) {
    if (command.app->parsed()) return command.run(command_line);
  }
  return exit_code(ErrorKind::usage);
}
