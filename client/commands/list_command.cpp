#include <fmt/format.h>

#include <algorithm>

#include "client/commands/commands.h"
#include "client/commands/model_options.h"
#include "client/commands/output.h"
#include "common/asset/asset_file.h"

namespace fanstream {
namespace {

Json json_of(const CatalogueEntry& entry) {
  Json json = {{"name", entry.name}};
  switch (entry.state) {
    case ModelState::ready:
      json.update({{"state", "ready"},
                   {"vertices", entry.vertex_count},
                   {"triangles", entry.triangle_count},
                   {"bytes", entry.size_bytes},
                   {"digest", text_of(entry.digest)}});
      break;
    case ModelState::building: json.update({{"state", "building"}, {"fraction", entry.permille / 1000.0}}); break;
    case ModelState::failed: json.update({{"state", "failed"}, {"reason", entry.reason}}); break;
  }
  return json;
}

std::string state_text(const CatalogueEntry& entry) {
  switch (entry.state) {
    case ModelState::ready:
      return fmt::format("{:>12} {:>12} {:>10}", grouped(entry.vertex_count), grouped(entry.triangle_count),
                         size_text(entry.size_bytes));
    case ModelState::building: return fmt::format("building, {} %", entry.permille / 10);
    case ModelState::failed: return "failed: " + entry.reason;
  }
  return {};
}

int run_list(const std::string& server, bool json) {
  const Result<ServerAddress> address = parse_server_address(server);
  if (!address) return report_error(address.error());
  if (!address->model.empty()) {
    return report_error({ErrorKind::usage, "'" + server + "': names a model; list takes HOST:PORT"});
  }
  StreamClientOptions options;
  options.stop = &stop_flag();
  Result<StreamClient> client = StreamClient::connect(*address, options);
  if (!client) return report_error(client.error());
  const Result<std::vector<CatalogueEntry>> catalogue = client->list();
  if (!catalogue) return report_error(catalogue.error());
  if (json) {
    Json models = Json::array();
    for (const CatalogueEntry& entry : *catalogue) models.push_back(json_of(entry));
    return print_json({{"server", address->text()}, {"models", models}});
  }
  if (catalogue->empty()) {
    fmt::print("{} has no models\n", address->text());
    return flush_output();
  }
  std::size_t width = 24;
  for (const CatalogueEntry& entry : *catalogue) width = std::max(width, entry.name.size());
  fmt::print("{:<{}} {:>12} {:>12} {:>10}\n", "model", width, "vertices", "triangles", "size");
  for (const CatalogueEntry& entry : *catalogue) fmt::print("{:<{}} {}\n", entry.name, width, state_text(entry));
  return flush_output();
}

}  // namespace

Command add_list_command(CLI::App& app) {
  struct Arguments {
    std::string server;
    bool json = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("list", "Show the models of a server");
  command->add_option("server", arguments->server, "HOST:PORT")->required();
  command->add_flag("--json", arguments->json, "Print the list as JSON");
  command->footer("Example:\n  fanstream-client list localhost:7370");
  return {command, [arguments] { return run_list(arguments->server, arguments->json); }};
}

}  // namespace fanstream
