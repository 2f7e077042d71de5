#include <fmt/format.h>

#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "common/refine/full_mesh.h"
#include "common/support/progress_bar.h"
#include "server/commands/commands.h"
#include "server/commands/output.h"
#include "server/verify/asset_checks.h"
#include "server/verify/polygon_checks.h"
#include "server/verify/source_comparison.h"

namespace fanstream {
namespace {

struct VerifyArguments {
  std::string file;
  std::string against;
  bool json = false;
};

Result<std::string> check_source(const AssetFile& asset, const std::string& input) {
  Result<ImportedMesh> imported = import_mesh(input);
  if (!imported) return tl::unexpected(imported.error());
  const CleanedMesh cleaned = clean_mesh(std::move(imported->mesh), std::move(imported->source_faces));
  Result<std::unique_ptr<ProgressiveMesh>> full = load_full(asset);
  if (!full) return tl::unexpected(full.error());
  Result<std::string> same =
      compare_with_source((*full)->triangle_mesh(), asset.asset_head()->grid, cleaned.mesh, asset.name(), input);
  if (!same) return same;
  const Result<std::string> polygons = compare_polygons(asset, cleaned, input);
  if (!polygons) return polygons;
  return asset.asset_head()->polygon_bytes == 0 ? same : *same + ", " + *polygons;
}

Json json_of(const VerifyArguments& arguments, const AssetFile& asset, const Json& checks, const Error* failure) {
  Json json = {
      {"file", arguments.file}, {"digest", text_of(asset.digest())}, {"valid", failure == nullptr}, {"checks", checks}};
  if (!arguments.against.empty()) json["against"] = arguments.against;
  if (failure != nullptr) json["error"] = failure->message;
  return json;
}

int run(const VerifyArguments& arguments) {
  const Result<std::shared_ptr<const AssetFile>> asset = AssetFile::open(arguments.file);
  if (!asset) return report_error(asset.error());
  std::vector<AssetCheck> checks = asset_checks(**asset);
  if (!arguments.against.empty()) {
    checks.push_back({"source", [&] { return check_source(**asset, arguments.against); }});
  }
  if (!arguments.json) fmt::print("{}: digest {}\n", arguments.file, text_of((*asset)->digest()));
  ProgressBar bar("verify");
  Json passed = Json::array();
  for (std::size_t i = 0; i < checks.size(); ++i) {
    bar.update(checks[i].name, static_cast<double>(i) / static_cast<double>(checks.size()));
    const Result<std::string> found = checks[i].run();
    bar.finish();
    if (!found) {
      if (arguments.json) print_json(json_of(arguments, **asset, passed, &found.error()));
      return report_error(found.error());
    }
    passed.push_back({{"name", checks[i].name}, {"found", *found}});
    if (!arguments.json) fmt::print("  {:<11} ok: {}\n", checks[i].name, *found);
    std::fflush(stdout);
  }
  if (arguments.json) return print_json(json_of(arguments, **asset, passed, nullptr));
  return flush_output();
}

}  // namespace

Command add_verify_command(CLI::App& app) {
  CLI::App* verify = app.add_subcommand("verify", "Checks an asset; compares it with its input");
  auto arguments = std::make_shared<VerifyArguments>();
  verify->add_option("FILE", arguments->file, "An asset file")->required();
  verify->add_option("--against", arguments->against, "Its input: must be equal, cleaned and quantised");
  verify->add_flag("--json", arguments->json, "Print the outcome as JSON");
  verify->footer("Example:\n  fanstream-server verify bunny.fan --against bunny.ply");
  return {verify, [arguments] { return run(*arguments); }};
}

}  // namespace fanstream
