#include <fmt/format.h>

#include "server/commands/commands.h"
#include "server/commands/output.h"

namespace fanstream {
namespace {

struct InspectArguments {
  std::string file;
  bool json = false;
};

Json json_of(const AssetFile& asset) {
  const AssetHead& head = *asset.asset_head();
  Json json = {{"file", asset.name()}, {"version", kAssetVersion}, {"digest", text_of(asset.digest())}};
  json.update(fanstream::json_of(report_of(asset)));
  json["layers"] = head.layer_ends.size();
  json["slabs"] = head.slab_ends.size();
  json["bytes"]["head"] = asset.preamble().head_bytes;
  json["bytes"]["index"] = asset.preamble().index_bytes;
  json["grid_step"] = head.grid.step();
  return json;
}

int run(const InspectArguments& arguments) {
  const Result<std::shared_ptr<const AssetFile>> asset = AssetFile::open(arguments.file);
  if (!asset) return report_error(asset.error());
  if (arguments.json) return print_json(json_of(**asset));
  fmt::print("{}: Fanstream asset, version {}\n{}", arguments.file, kAssetVersion,
             summary_of(report_of(**asset), (*asset)->digest()));
  return flush_output();
}

}  // namespace

Command add_inspect_command(CLI::App& app) {
  CLI::App* inspect = app.add_subcommand("inspect", "Tells what an asset holds");
  auto arguments = std::make_shared<InspectArguments>();
  inspect->add_option("FILE", arguments->file, "An asset file")->required();
  inspect->add_flag("--json", arguments->json, "Print it as JSON");
  inspect->footer("Example:\n  fanstream-server inspect bunny.fan");
  return {inspect, [arguments] { return run(*arguments); }};
}

}  // namespace fanstream
