#include <fmt/format.h>

#include "client/commands/commands.h"
#include "client/commands/model_options.h"
#include "client/commands/output.h"
#include "client/export/mesh_export.h"
#include "common/mesh/mesh_hash.h"

namespace fanstream {
namespace {

int run_fetch(const SourceArguments& arguments, const LevelArguments& level) {
  if (const auto format = mesh_file_format(arguments.output); !format) return report_error(format.error());
  if (const auto writable = check_output_path(arguments.output, ""); !writable) return report_error(writable.error());
  const Result<LoadedModel> loaded = load_model(arguments.source, level);
  if (!loaded) return report_error(loaded.error());
  const TriangleMesh mesh = loaded->fetch->mesh().triangle_mesh();
  if (const auto going = go_on(); !going && !loaded->broken) return report_error(going.error());
  if (const auto written = export_mesh(arguments.output, mesh.positions, mesh.triangles); !written) {
    return report_error(written.error());
  }
  const FetchReport report = loaded->fetch->report();
  int printed = 0;
  if (arguments.json) {
    Json json = json_of(report);
    json["mesh_hash"] = mesh_hash(mesh);
    json["level"] = level_json(level.goal, report);
    json["output"] = arguments.output;
    printed = print_json(json);
  } else {
    fmt::print("{}{}written     {}\n", summary_of(report), level_text(level.goal, report), arguments.output);
    printed = flush_output();
  }
  return loaded->broken ? report_error(*loaded->broken) : printed;
}

}  // namespace

Command add_fetch_command(CLI::App& app) {
  struct Arguments {
    SourceArguments source;
    LevelArguments level;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("fetch", "Receive a model and write it as a mesh file");
  add_source_arguments(*command, arguments->source, "File to write: .ply, .obj or .glb");
  add_level_arguments(*command, arguments->level);
  command->footer(
      "Levels are a segment apart: about fifty vertices of one part of the model.\n"
      "Example:\n  fanstream-client fetch localhost:7370/bunny -o bunny.ply --vertices 5000");
  return {command, [arguments] { return run_fetch(arguments->source, arguments->level); }};
}

}  // namespace fanstream
