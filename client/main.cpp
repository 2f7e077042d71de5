// fanstream-client: lists, fetches, draws and reduces models of a Fanstream server or of an asset file.
#include <array>
#include <new>

#include "client/commands/commands.h"
#include "client/commands/model_options.h"
#include "client/commands/output.h"
#include "client/commands/session_command.h"
#include "client/session/live_session.h"

int main(int argc, char** argv) {
  using namespace fanstream;
  CLI::App app("Receives models as progressive fan meshes, rebuilds and draws them.", "fanstream-client");
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  fanstream-client list localhost:7370\n"
      "  fanstream-client render localhost:7370/bunny -o bunny.png --vertices 5000\n\n"
      "fanstream-client COMMAND --help tells more.\n"
      "Exit codes: 0 done, 2 usage, 3 not found, 4 reading or writing, 5 bad input,\n"
      "6 unsupported, 7 limit, 8 network, 130 interrupted.");
  const std::array<Command, 8> commands{add_list_command(app),
                                        add_fetch_command(app),
                                        add_render_command(app),
                                        add_snapshots_command(app),
                                        add_session_command(app, open_live_session),
                                        add_reduce_command(app),
                                        add_collide_command(app),
                                        add_subdivide_command(app)};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : exit_code(ErrorKind::usage);
  }
  catch_stop_signals();
  try {
    for (const Command& command : commands) {
      if (command.app->parsed()) return command.run();
    }
  } catch (const std::bad_alloc&) {
    return report_error({ErrorKind::limit, "not enough memory"});
  }
  return exit_code(ErrorKind::usage);
}
