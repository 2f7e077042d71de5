// fanstream-server: builds, inspects, verifies and serves Fanstream assets.
#include <array>
#include <new>

#include "server/commands/commands.h"
#include "server/commands/output.h"

int main(int argc, char** argv) {
  using namespace fanstream;
  CLI::App app("Builds progressive fan meshes and streams them over TCP.", "fanstream-server");
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  fanstream-server build bunny.ply -o bunny.fan\n"
      "  fanstream-server serve models/ --port 7370 --store store/\n\n"
      "fanstream-server COMMAND --help tells more.\n"
      "Exit codes: 0 done, 2 usage, 3 not found, 4 reading or writing, 5 bad input,\n"
      "6 unsupported, 7 limit, 8 network, 130 interrupted.");
  const std::array<Command, 4> commands{add_build_command(app), add_inspect_command(app), add_verify_command(app),
                                        add_serve_command(app)};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : exit_code(ErrorKind::usage);
  }
  try {
    for (const Command& command : commands) {
      if (command.app->parsed()) return command.run();
    }
  } catch (const std::bad_alloc&) {
    return report_error({ErrorKind::limit, "not enough memory"});
  }
  return exit_code(ErrorKind::usage);
}
