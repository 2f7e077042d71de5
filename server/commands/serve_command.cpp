#include <filesystem>

#include "common/support/descriptor_limit.h"
#include "server/commands/commands.h"
#include "server/commands/output.h"
#include "server/commands/serve_log.h"
#include "server/net/stop_signal.h"
#include "server/net/stream_server.h"
#include "server/store/model_store.h"

namespace fanstream {
namespace {

constexpr auto kStatusInterval = std::chrono::milliseconds(500);
constexpr auto kBuildGrace = std::chrono::seconds(2);  // a build that is nearly done may end, others are given up

struct ServeArguments {
  std::string models;
  std::string store;
  ServerOptions server;
  unsigned build_threads = 0;
  bool json = false;
};

// Builds cannot be interrupted. Where one still runs, the process ends without its threads being waited for: the store
// has seen to it that none of them is writing.
int end_with(int code, ModelStore& store) {
  if (!store.stop(kBuildGrace)) {
    std::fflush(stdout);
    std::_Exit(code);
  }
  return code;
}

int run(ServeArguments arguments) {
  hold_stop_signals();
  raise_descriptor_limit();
  if (arguments.store.empty())
    arguments.store = (std::filesystem::path(arguments.models) / ".fanstream-store").string();
  ServeLog log(arguments.json);
  StoreOptions options;
  options.models = arguments.models;
  options.store = arguments.store;
  options.build_threads = arguments.build_threads;
  options.on_event = [&log](const StoreEvent& event) { log.store_event(event); };
  Result<std::unique_ptr<ModelStore>> opened = ModelStore::open(options);
  if (!opened) return report_error(opened.error());
  const std::shared_ptr<ModelStore> store(std::move(*opened));
  Result<std::unique_ptr<StreamServer>> started = StreamServer::start(arguments.server, store);
  if (!started) return end_with(report_error(started.error()), *store);
  StreamServer& server = **started;
  const std::size_t models = store->catalogue().size();
  log.listening(arguments.server.host, server.port(), models, arguments.store);
  if (models == 0) {
    log.store_event(
        {.kind = StoreEvent::Kind::warning,
         .text = arguments.models +
                 " holds no model; put glTF, GLB, OBJ, PLY, STL, OFF or .fan files there and start again."});
  }
  wait_for_stop_signal(kStatusInterval, [&] { log.status(server.metrics()); });
  server.stop();
  log.stopped(server.metrics());
  return end_with(0, *store);
}

}  // namespace

Command add_serve_command(CLI::App& app) {
  CLI::App* serve = app.add_subcommand("serve", "Serves a folder of models; builds what is missing");
  auto arguments = std::make_shared<ServeArguments>();
  ServerOptions& server = arguments->server;
  serve->add_option("DIR", arguments->models, "GLB, glTF, OBJ, PLY, STL, OFF files, assets (.fan)")->required();
  serve->add_option("--host", server.host, "Address to listen on; 127.0.0.1: this machine only")->capture_default_str();
  serve->add_option("--port", server.port, "TCP port; 0 lets the system choose one")
      ->capture_default_str()
      ->check(CLI::Range(0, 65535));
  serve->add_option("--store", arguments->store, "Folder for assets (default: DIR/.fanstream-store)");
  serve->add_option("--build-threads", arguments->build_threads, "Models built at once; 0: half the cores")
      ->capture_default_str()
      ->check(CLI::Range(0U, 256U));
  serve->add_flag("--json", arguments->json, "Print events as JSON, one a line; first the port");
  serve->footer(
      "Example:\n  fanstream-server serve models/ --host 127.0.0.1 --port 7370 --store store/\n\n"
      "Ctrl-C or SIGTERM tells the clients and ends with exit code 0.");
  return {serve, [arguments] { return run(*arguments); }};
}

}  // namespace fanstream
