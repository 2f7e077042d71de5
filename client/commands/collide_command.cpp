#include <fmt/format.h>

#include <cmath>

#include "client/collision/mesh_contacts.h"
#include "client/collision/plane_contacts.h"
#include "client/collision/restoration_fetch.h"
#include "client/commands/commands.h"
#include "client/commands/model_options.h"
#include "client/commands/number_list.h"
#include "client/commands/output.h"
#include "common/asset/asset_file.h"
#include "common/import/mesh_import.h"
#include "common/support/progress_bar.h"

namespace fanstream {
namespace {

struct Arguments {
  std::string source;
  std::vector<std::string> planes;
  std::string with, focus, direction;
  std::optional<double> angle_deg, coarseness;
  std::uint64_t most_listed = 1000;
  bool json = false;
};

Result<std::vector<double>> numbers(const std::string& option, const std::string& text, std::size_t count,
                                    const char* form) {
  const auto list = parse_numbers<double>(text, ',');
  if (list && list->size() == count) return *list;
  return fail(ErrorKind::usage, fmt::format("{} {}: expected {}", option, text, form));
}

// All that the command line says, checked before anything is opened.
struct Request {
  std::vector<Plane> planes;
  std::optional<MeshObstacle> obstacle;
  Focus focus;
  bool whole_contacts = false;  // nobody said what is in focus: what the obstacles may touch is
};

Result<void> read_planes(const Arguments& arguments, Request& request) {
  for (const std::string& text : arguments.planes) {
    const auto n = numbers("--plane", text, 4, "a,b,c,d of the plane ax + by + cz + d = 0, for example 0,1,0,-0.2");
    if (!n) return tl::unexpected(n.error());
    const Result<Plane> plane = make_plane((*n)[0], (*n)[1], (*n)[2], (*n)[3]);
    if (!plane) return tl::unexpected(with_context(plane.error(), "--plane " + text));
    request.planes.push_back(*plane);
  }
  return {};
}

Result<void> read_focus(const Arguments& arguments, Request& request) {
  if (!arguments.focus.empty()) {
    const auto n = numbers("--focus", arguments.focus, 4, "x,y,z,r: a point and a radius, for example 0.1,0,2.5,0.4");
    if (!n) return tl::unexpected(n.error());
    request.focus.sphere = FocusSphere{{(*n)[0], (*n)[1], (*n)[2]}, (*n)[3]};
  }
  if (!arguments.direction.empty()) {
    const auto n = numbers("--direction", arguments.direction, 3, "x,y,z, for example 0,0,1");
    if (!n) return tl::unexpected(n.error());
    request.focus.facing = FocusFacing{{(*n)[0], (*n)[1], (*n)[2]}, arguments.angle_deg.value_or(60.0)};
  } else if (arguments.angle_deg) {
    return fail(ErrorKind::usage, "--angle: is the angle around --direction, which is missing");
  }
  const Result<void> checked = check_focus(request.focus);
  if (checked) return {};
  const std::string option = arguments.focus.empty()       ? "--direction " + arguments.direction
                             : arguments.direction.empty() ? "--focus " + arguments.focus
                                                           : "--focus, --direction";
  return tl::unexpected(with_context(checked.error(), option));
}

Result<Request> read_request(const Arguments& arguments) {
  if (arguments.planes.empty() && arguments.with.empty()) {
    return fail(ErrorKind::usage, "collide: say what to collide with, --plane a,b,c,d or --with FILE");
  }
  Request request;
  if (auto read = read_planes(arguments, request); !read) return tl::unexpected(read.error());
  if (auto read = read_focus(arguments, request); !read) return tl::unexpected(read.error());
  if (arguments.coarseness && !(*arguments.coarseness >= 0.0)) {
    return fail(ErrorKind::usage, "--coarseness: is a distance in the model's units, 0 or more");
  }
  if (!arguments.with.empty()) {
    const Result<ImportedMesh> mesh = import_mesh(arguments.with);
    if (!mesh) return tl::unexpected(mesh.error());
    Result<MeshObstacle> obstacle = MeshObstacle::create(mesh->mesh);
    if (!obstacle) return tl::unexpected(with_context(obstacle.error(), arguments.with));
    request.obstacle = std::move(*obstacle);
  }
  request.whole_contacts = !request.focus.sphere && !request.focus.facing;
  if (request.whole_contacts) {
    request.focus.region = [planes = region_of(request.planes),
                            mesh = request.obstacle ? region_of(*request.obstacle) : [](const Bounds&) {
                              return false;
                            }](const Bounds& box) { return planes(box) || mesh(box); };
  }
  return request;
}

// --- What was found ---

struct Findings {
  RestorationMove move;
  std::uint64_t triangles = 0, original_triangles = 0;
  std::vector<PlaneContacts> planes;
  std::optional<MeshContacts> mesh;
  std::optional<Separation> distance;  // to the mesh, where nothing touches it
  std::vector<std::string> notes;
};

void write_notes(const Request& request, const LocalRestoration& model, Findings& findings) {
  const bool complete = findings.original_triangles == model.mesh().head().triangle_count;
  if (!request.whole_contacts && findings.move.focus_cells == 0) {
    findings.notes.emplace_back("the focus touches no part of the model: nothing is restored for it");
  }
  if (request.whole_contacts || complete) return;
  findings.notes.push_back(
      fmt::format("outside the focus the mesh is simplified: the full model is at most {:.6g} off it there",
                  model.largest_error()));
}

Findings find(const Request& request, const Arguments& arguments, const RestorationMove& move,
              const LocalRestoration& model) {
  Findings findings;
  findings.move = move;
  const LiveSurface& surface = model.surface();
  findings.triangles = surface.triangle_count();
  surface.visit([](const Bounds&) { return true; },
                [&](const LiveTriangle& t) { findings.original_triangles += t.original ? 1 : 0; });
  for (const Plane& plane : request.planes) {
    find_contacts(surface, plane, findings.planes.emplace_back(), {.most_listed = arguments.most_listed});
  }
  if (request.obstacle) {
    findings.mesh = find_contacts(surface, *request.obstacle, arguments.most_listed);
    if (findings.mesh->touching_pairs == 0 && findings.triangles > 0) {
      findings.distance = distance_between(surface, *request.obstacle);
    }
  }
  write_notes(request, model, findings);
  return findings;
}

using fanstream::json_of;
Json json_of(const std::array<glm::dvec3, 3>& corners) {
  return Json::array({json_of(corners[0]), json_of(corners[1]), json_of(corners[2])});
}

Json json_of(const Plane& plane, const PlaneContacts& found) {
  Json json{{"plane", {plane.normal.x, plane.normal.y, plane.normal.z, plane.offset}},
            {"touching", found.touching},
            {"touching_original", found.touching_original},
            {"behind", found.behind},
            {"least_distance", found.least_distance},
            {"least_at", json_of(found.least_at)},
            {"tested_triangles", found.tested_triangles},
            {"listed", found.contacts.size()},
            {"contacts", Json::array()}};
  for (const PlaneContact& c : found.contacts) {
    json["contacts"].push_back(
        {{"corners", json_of(c.corners)}, {"distances", c.distances}, {"depth", c.depth()}, {"original", c.original}});
  }
  return json;
}

Json json_of(const Arguments& arguments, const Request& request, const Findings& findings) {
  const MeshContacts& found = *findings.mesh;
  Json json{{"file", arguments.with},
            {"triangles", request.obstacle->triangle_count()},
            {"touching_pairs", found.touching_pairs},
            {"original_pairs", found.original_pairs},
            {"all_found", found.all_found},
            {"tested_triangles", found.tested_triangles},
            {"distance", nullptr},
            {"listed", found.contacts.size()},
            {"contacts", Json::array()}};
  if (findings.distance) {
    json["distance"] = {{"least", findings.distance->distance},
                        {"on_model", json_of(findings.distance->on_model)},
                        {"on_file", json_of(findings.distance->on_obstacle)}};
  }
  for (const MeshContact& c : found.contacts) {
    json["contacts"].push_back({{"corners", json_of(c.corners)},
                                {"triangle_of_file", c.obstacle_triangle},
                                {"position", json_of(c.position)},
                                {"normal", json_of(c.normal)},
                                {"depth", c.depth},
                                {"original", c.original}});
  }
  return json;
}

int print_as_json(const Arguments& arguments, const Request& request, RestorationFetch& fetch,
                  const Findings& findings) {
  Json json{{"source", fetch.name()},
            {"model", fetch.model_name()},
            {"digest", text_of(fetch.digest())},
            {"bytes", {{"received", fetch.received_bytes()}, {"model", fetch.model_bytes()}}},
            {"triangles", findings.triangles},
            {"original_triangles", findings.original_triangles},
            {"full_triangles", fetch.model().mesh().head().triangle_count},
            {"focus_cells", findings.move.focus_cells},
            {"contacts_of_full_model", request.whole_contacts},
            {"simplified_at_most_off", fetch.model().largest_error()},
            {"planes", Json::array()},
            {"mesh", nullptr},
            {"notes", findings.notes}};
  for (std::size_t i = 0; i < request.planes.size(); ++i) {
    json["planes"].push_back(json_of(request.planes[i], findings.planes[i]));
  }
  if (findings.mesh) json["mesh"] = json_of(arguments, request, findings);
  return print_json(json);
}

std::string point_text(const glm::dvec3& p) { return fmt::format("{:.6g}, {:.6g}, {:.6g}", p.x, p.y, p.z); }

std::string plane_text(const std::string& plane, const PlaneContacts& found) {
  std::string text = fmt::format("plane       {}\n", plane);
  if (!found.collides()) {
    return text + fmt::format("            no contact; {:.6g} away, from {}\n", found.least_distance,
                              point_text(found.least_at));
  }
  text += fmt::format("            {} triangles touch it, {} of them original; {} are behind it\n",
                      grouped(found.touching), grouped(found.touching_original), grouped(found.behind));
  return text + fmt::format("            deepest by {:.6g}, at {}\n", std::max(0.0, -found.least_distance),
                            point_text(found.least_at));
}

std::string mesh_text(const Arguments& arguments, const Findings& findings) {
  std::string text = fmt::format("mesh        {}\n", arguments.with);
  const MeshContacts& found = *findings.mesh;
  if (found.touching_pairs > 0) {
    return text + fmt::format("            {}{} pairs of triangles touch, {} with original ones\n",
                              found.all_found ? "" : "more than ", grouped(found.touching_pairs),
                              grouped(found.original_pairs));
  }
  text += "            no contact";
  if (findings.distance) {
    text += fmt::format("; {:.6g} away, from {}", findings.distance->distance, point_text(findings.distance->on_model));
  }
  return text + "\n";
}

int print_as_text(const Arguments& arguments, RestorationFetch& fetch, const Findings& findings) {
  fmt::print("model       {}, digest {}\n", fetch.model_name(), text_of(fetch.digest()));
  fmt::print("mesh        {} triangles, {} of them original,\n            of {} of the full model\n",
             grouped(findings.triangles), grouped(findings.original_triangles),
             grouped(fetch.model().mesh().head().triangle_count));
  fmt::print("received    {} bytes of {}\n", grouped(fetch.received_bytes()), grouped(fetch.model_bytes()));
  for (std::size_t i = 0; i < findings.planes.size(); ++i) {
    fmt::print("{}", plane_text(arguments.planes[i], findings.planes[i]));
  }
  if (findings.mesh) fmt::print("{}", mesh_text(arguments, findings));
  for (const std::string& note : findings.notes) fmt::print("note        {}\n", note);
  return flush_output();
}

int run_collide(const Arguments& arguments) {
  const Result<Request> request = read_request(arguments);
  if (!request) return report_error(request.error());
  ProgressBar bar(arguments.source);
  RestorationFetchOptions options;
  options.stream.network.client.stop = &stop_flag();
  options.stream.on_building = [&bar](double done) { bar.update("server builds", done); };
  options.on_progress = [&bar](std::uint64_t received, std::uint64_t all) {
    bar.update("receiving", std::min(1.0, static_cast<double>(received) / static_cast<double>(all)));
  };
  Result<std::unique_ptr<RestorationFetch>> fetch = RestorationFetch::open(arguments.source, options);
  if (!fetch) return bar.finish(), report_error(fetch.error());
  if (arguments.coarseness) (*fetch)->model().set_coarseness(*arguments.coarseness);
  const Result<RestorationMove> move = (*fetch)->move(request->focus);
  bar.finish();
  if (!move) return report_error(move.error());
  const Findings findings = find(*request, arguments, *move, (*fetch)->model());
  if (const auto going = go_on(); !going) return report_error(going.error());
  return arguments.json ? print_as_json(arguments, *request, **fetch, findings)
                        : print_as_text(arguments, **fetch, findings);
}

}  // namespace

Command add_collide_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("collide", "Find where a model meets planes or a mesh");
  command->add_option("source", arguments->source, "HOST:PORT/MODEL, or an asset file")->required();
  command->add_option("--plane", arguments->planes, "a,b,c,d: solid where ax+by+cz+d < 0; repeatable")
      ->take_all()
      ->expected(1);
  command->add_option("--with", arguments->with, "A mesh file: PLY, STL, OBJ, OFF, glTF, GLB");
  command->add_option("--focus", arguments->focus, "x,y,z,r: original within r of the point");
  command->add_option("--direction", arguments->direction, "x,y,z: original where normals look there");
  command->add_option("--angle", arguments->angle_deg, "Degrees around --direction [60]");
  command->add_option("--coarseness", arguments->coarseness, "How far off elsewhere, 0: original [as FM0]");
  command->add_option("--list", arguments->most_listed, "Contacts to list at most (--json)")->capture_default_str();
  command->add_flag("--json", arguments->json, "Print contacts and report as JSON");
  command->footer(
      "Receives what is in focus in full, and all else coarsely. Both --focus and\n"
      "--direction: what both ask for. Neither: what the planes or the mesh may\n"
      "touch is in focus, so that contacts are those of the full model.\n"
      "Example:\n  fanstream-client collide localhost:7370/bunny --plane 0,1,0,-0.05 \\\n"
      "      --focus 0,0.05,0,0.03");
  return {command, [arguments] { return run_collide(*arguments); }};
}

}  // namespace fanstream
