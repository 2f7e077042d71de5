#include "client/commands/smooth_options.h"

#include <fmt/format.h>

#include "client/commands/model_options.h"

namespace fanstream {

SmoothOptions SmoothArguments::options() const {
  SmoothOptions options;
  options.crease_angle_deg = crease_angle_deg;
  options.stop = [] { return stop_flag().load(); };
  return options;
}

void add_smooth_arguments(CLI::App& command, SmoothArguments& arguments) {
  CLI::Option* smooth =
      command.add_flag("--smooth-silhouette", arguments.smooth, "Subdivide what is at its finest level");
  command.add_option("--crease-angle", arguments.crease_angle_deg, "Degrees: edges that bend by more stay sharp")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 180.0))
      ->needs(smooth);
}

Json json_of(const SmoothReport& report) {
  Json json = {{"faces_before", report.faces_before},
               {"finest_faces", report.finest_faces},
               {"eligible_faces", report.eligible_faces},
               {"faces_after", report.faces_after},
               {"triangles_after", report.triangles_after},
               {"depth", report.depth},
               {"front_depth", report.front_depth},
               {"silhouette_depth", report.silhouette_depth},
               {"seconds", report.seconds}};
  if (!report.limitation.empty()) json["limitation"] = report.limitation;
  return json;
}

std::string text_of(const SmoothReport& report) {
  std::string text = fmt::format("smoothed    {} of {} faces could be, gives {} faces, depth {}, in {:.2f} s\n",
                                 grouped(report.eligible_faces), grouped(report.faces_before),
                                 grouped(report.faces_after), report.depth, report.seconds);
  if (!report.limitation.empty()) text += fmt::format("            less than asked for: {}\n", report.limitation);
  return text;
}

}  // namespace fanstream
