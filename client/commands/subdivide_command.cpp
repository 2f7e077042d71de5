#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "client/commands/commands.h"
#include "client/commands/model_options.h"
#include "client/commands/output.h"
#include "client/export/polygon_export.h"
#include "client/render/offscreen_renderer.h"
#include "client/subdivide/view_subdivision.h"
#include "common/fans/fan_shape.h"
#include "common/import/mesh_cleaner.h"
#include "common/import/mesh_import.h"
#include "common/mesh/polygon_cleaner.h"
#include "common/support/progress_bar.h"

namespace fanstream {
namespace {

struct Arguments {
  std::string input;
  std::string output;
  bool json = false;
  std::optional<unsigned> depth;
  bool view = false;
  CameraArguments camera;
  ViewSubdivisionOptions options;
  std::string boundary = "corners";
  std::string picture_eye;
  bool flat = false;
};

struct Input {
  PolygonMesh mesh;
  std::vector<std::string> warnings;
  std::vector<std::pair<std::string, std::uint64_t>> repairs;
  bool inward = false;  // closed, and its faces wind clockwise from outside
};

struct Output {
  AdaptiveMesh refined;
  Camera camera;
  std::optional<Camera> drawn_from;
  std::size_t front_faces = 0;
  std::size_t silhouette_faces = 0;
};

// Meshes of plain triangles are mended by what mends them elsewhere, which knows more about edges of many faces.
Input mend(ImportedMesh imported) {
  Input input{std::move(imported.polygons), std::move(imported.warnings), {}};
  const bool polygons = input.mesh.corners.size() != 3 * input.mesh.face_count();
  const bool weights =
      std::any_of(input.mesh.points.begin(), input.mesh.points.end(), [](const glm::dvec4& p) { return p.w != 1.0; });
  if (polygons || weights) {
    input.repairs = named_counts(clean_polygons(input.mesh));
  } else {
    const CleanedMesh cleaned = clean_mesh(std::move(imported.mesh));
    input.mesh = polygon_mesh(cleaned.mesh);
    input.repairs = named_counts(cleaned.report);
  }
  return input;
}

// Six times the volume that a closed mesh encloses: negative where its faces wind inwards.
double signed_volume(const PolygonMesh& mesh) {
  double sum = 0.0;
  const glm::dvec3 origin = position(mesh.points[0]);
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    const glm::dvec3 a = position(mesh.points[face[0]]) - origin;
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      sum +=
          glm::dot(a, glm::cross(position(mesh.points[face[i]]) - origin, position(mesh.points[face[i + 1]]) - origin));
    }
  }
  return sum;
}

bool is_closed(const PolygonMesh& mesh) { return uniform_face_count(mesh, 1) == mesh.corners.size() / 2; }

void turn_inside_out(PolygonMesh& mesh) {
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    std::reverse(mesh.corners.begin() + mesh.face_begins[f], mesh.corners.begin() + mesh.face_begins[f + 1]);
  }
}

Result<Input> read_input(const Arguments& arguments, ProgressBar& bar) {
  bar.update("reading", 0.0);
  ImportOptions options;
  options.keep_polygons = true;
  Result<ImportedMesh> imported = import_mesh(arguments.input, options);
  if (!imported) return tl::unexpected(imported.error());
  bar.update("cleaning", 0.3);
  Input input = mend(std::move(*imported));
  if (input.mesh.face_count() == 0) {
    return fail(ErrorKind::bad_input,
                arguments.input + ": has no face with an area: all corners lie at the same place");
  }
  input.inward = is_closed(input.mesh) && signed_volume(input.mesh) < 0;
  if (input.inward && !arguments.depth) {
    input.warnings.emplace_back("The faces wind inwards: what faces the eye was chosen as if they wound outwards.");
  }
  return input;
}

Result<Output> refine(const Arguments& arguments, Input& input, ProgressBar& bar) {
  Output output;
  const Result<Camera> camera = arguments.camera.camera(positions(input.mesh.points));
  if (!camera) return tl::unexpected(camera.error());
  output.camera = *camera;
  if (arguments.depth) {
    bar.update("refining", 0.5);
    Result<PolygonMesh> mesh = subdivide(input.mesh, *arguments.depth, arguments.options.subdivision);
    if (!mesh) return tl::unexpected(with_context(mesh.error(), arguments.input));
    output.refined.mesh = std::move(*mesh);
    return output;
  }
  View view;
  view.camera = *camera;
  view.width_px = arguments.camera.width;
  view.height_px = arguments.camera.height;
  ViewSubdivisionOptions options = arguments.options;
  const unsigned steps = std::max({options.front_depth, options.silhouette_depth, 1U});
  options.stop = [&](unsigned step) {
    bar.update("refining", 0.4 + 0.5 * step / steps);
    return stop_flag().load();
  };
  if (input.inward) turn_inside_out(input.mesh);
  Result<ViewSubdivision> result = subdivide_for_view(input.mesh, view, options);
  if (!result) {
    if (const auto going = go_on(); !going) return tl::unexpected(going.error());
    return tl::unexpected(with_context(result.error(), arguments.input));
  }
  if (input.inward) turn_inside_out(result->refined.mesh);
  output.refined = std::move(result->refined);
  output.front_faces = result->front_faces;
  output.silhouette_faces = result->silhouette_faces;
  return output;
}

bool is_picture(const std::string& path) { return !mesh_file_format(path); }

Result<Image> draw(const Arguments& arguments, const PolygonMesh& mesh, const Camera& camera) {
  const Result<FanMesh> fans = make_fan_mesh(triangle_mesh(mesh), CoverMethod::greedy);
  if (!fans) return tl::unexpected(fans.error());
  Result<OffscreenRenderer> renderer = OffscreenRenderer::create(arguments.camera.width, arguments.camera.height);
  if (!renderer) return tl::unexpected(renderer.error());
  RenderOptions options;
  options.shading = arguments.flat ? Shading::flat : Shading::smooth;
  return renderer->render(*fans, camera, options);
}

Result<void> write_output(const Arguments& arguments, const Input& input, Output& output) {
  if (const auto going = go_on(); !going) return going;
  if (!is_picture(arguments.output)) return export_polygons(arguments.output, output.refined.mesh);
  Camera camera = output.camera;
  if (!arguments.picture_eye.empty()) {
    CameraArguments other = arguments.camera;
    other.eye = arguments.picture_eye;
    if (auto checked = other.check(); !checked) return checked;
    const Result<Camera> given = other.camera(positions(input.mesh.points));
    if (!given) return tl::unexpected(given.error());
    output.drawn_from = camera = *given;
  }
  const Result<Image> image = draw(arguments, output.refined.mesh, camera);
  if (!image) return tl::unexpected(image.error());
  if (const auto going = go_on(); !going) return going;
  return write_png(*image, arguments.output);
}

std::vector<std::size_t> faces_by_depth(const AdaptiveMesh& refined) {
  std::vector<std::size_t> counts;
  for (const std::uint8_t depth : refined.face_depths) {
    if (depth >= counts.size()) counts.resize(depth + std::size_t{1});
    ++counts[depth];
  }
  return counts;
}

int print_report(const Arguments& arguments, const Input& input, const Output& output) {
  const PolygonMesh& mesh = output.refined.mesh;
  const std::vector<std::size_t> by_depth = faces_by_depth(output.refined);
  if (arguments.json) {
    Json repairs;
    for (const auto& [key, count] : input.repairs) repairs[key] = count;
    Json json = {{"input", arguments.input},
                 {"warnings", input.warnings},
                 {"repairs", repairs},
                 {"input_vertices", input.mesh.points.size()},
                 {"input_faces", input.mesh.face_count()},
                 {"vertices", mesh.points.size()},
                 {"faces", mesh.face_count()},
                 {"corners", mesh.corners.size()},
                 {"boundary", arguments.boundary}};
    if (arguments.depth) {
      json["depth"] = *arguments.depth;
    } else {
      json["front_depth"] = arguments.options.front_depth;
      json["silhouette_depth"] = arguments.options.silhouette_depth;
      json["size_px"] = arguments.options.size_px;
      json["tolerance_px"] = arguments.options.tolerance_px;
      json["front_faces"] = output.front_faces;
      json["silhouette_faces"] = output.silhouette_faces;
      json["faces_by_depth"] = by_depth;
      json["camera"] = {{"eye", json_of(output.camera.eye)},
                        {"target", json_of(output.camera.target)},
                        {"fov_deg", output.camera.fov_deg}};
    }
    json["output"] = arguments.output;
    return print_json(json);
  }
  for (const std::string& warning : input.warnings) fmt::print("warning     {}\n", warning);
  for (const auto& [key, count] : input.repairs) {
    if (count > 0) fmt::print("repaired    {} {}\n", grouped(count), key);
  }
  fmt::print("mesh        {} vertices, {} faces\n", grouped(input.mesh.points.size()),
             grouped(input.mesh.face_count()));
  if (!arguments.depth) {
    fmt::print("view        {} faces to the front, {} at the silhouette\n", grouped(output.front_faces),
               grouped(output.silhouette_faces));
  }
  fmt::print("refined     {} vertices, {} faces\n", grouped(mesh.points.size()), grouped(mesh.face_count()));
  for (std::size_t depth = 0; depth < by_depth.size(); ++depth) {
    fmt::print("  depth {:2}  {} faces\n", depth, grouped(by_depth[depth]));
  }
  fmt::print("written     {}\n", arguments.output);
  return flush_output();
}

Result<void> check_arguments(Arguments& arguments) {
  if (arguments.depth.has_value() == arguments.view && (arguments.depth || arguments.camera.eye.empty())) {
    return fail(ErrorKind::usage,
                "give either --depth N for all faces alike, or --view (or --eye) for what a view needs");
  }
  if (auto checked = arguments.camera.check(); !checked) return checked;
  if (is_picture(arguments.output) && std::filesystem::path(arguments.output).extension() != ".png") {
    return fail(ErrorKind::usage,
                arguments.output + ": cannot tell the format; end the name in .ply, .obj, .glb or .png (a picture)");
  }
  arguments.options.subdivision.boundary =
      arguments.boundary == "corners" ? BoundaryRule::corners : BoundaryRule::smooth;
  return check_output_path(arguments.output, "");
}

int run_subdivide(Arguments& arguments) {
  if (const auto checked = check_arguments(arguments); !checked) return report_error(checked.error());
  ProgressBar bar(arguments.input);
  Result<Input> input = read_input(arguments, bar);
  if (!input) return report_error(input.error());
  if (const auto going = go_on(); !going) return report_error(going.error());
  Result<Output> output = refine(arguments, *input, bar);
  if (!output) return report_error(output.error());
  bar.update("writing", 0.9);
  if (const auto written = write_output(arguments, *input, *output); !written) return report_error(written.error());
  bar.finish();
  return print_report(arguments, *input, *output);
}

}  // namespace

Command add_subdivide_command(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("subdivide", "Refine a mesh file by sqrt(2)-subdivision");
  command->add_option("input", arguments->input, "Mesh file; .obj, .ply and .off keep their polygons")->required();
  command->add_option("-o,--output", arguments->output, "Mesh to write: .ply, .obj or .glb; or its picture: .png")
      ->required();
  command->add_flag("--json", arguments->json, "Print the report as JSON");
  command->add_option("--depth", arguments->depth, "Half-steps for all faces; two are one step of Catmull-Clark");
  command->add_flag("--view", arguments->view, "Refine for one view: what faces the eye, the silhouette deeper");
  add_camera_arguments(*command, arguments->camera, "Pixels of the view: WxH");
  ViewSubdivisionOptions& options = arguments->options;
  command->add_option("--front-depth", options.front_depth, "Half-steps for faces that face the eye")
      ->capture_default_str()
      ->check(CLI::Range(0U, kMaxViewDepth));
  command->add_option("--silhouette-depth", options.silhouette_depth, "Half-steps for faces at the silhouette")
      ->capture_default_str()
      ->check(CLI::Range(0U, kMaxViewDepth));
  command->add_option("--silhouette-rings", options.silhouette_rings, "Rings of faces refined around them")
      ->capture_default_str()
      ->check(CLI::Range(0U, 16U));
  command->add_option("--face-px", options.size_px, "Faces whose edges are at most this long are fine enough")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  command
      ->add_option("--tolerance-px", options.tolerance_px, "Also those nearer than this to the limit surface; 0: off")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  command->add_option("--boundary", arguments->boundary, "Corners of an open mesh: sharp or smooth")
      ->capture_default_str()
      ->check(CLI::IsMember({"corners", "smooth"}));
  command->add_option("--max-corners", options.subdivision.max_corners, "Refuse results with more face corners")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, kMaxCorners));
  command->add_option("--picture-eye", arguments->picture_eye, "Draw the .png from here, not from --eye: x,y,z");
  command->add_flag("--flat", arguments->flat, "Draw the .png with flat faces");
  command->footer(
      "Every other half-step only cuts faces up; the mesh is Catmull-Clark's at even depths.\n"
      "Examples:\n  fanstream-client subdivide cage.obj --depth 6 -o smooth.ply\n"
      "  fanstream-client subdivide cage.obj --view --eye 0,1,5 -o front.obj\n"
      "  fanstream-client subdivide cage.obj --view --eye 0,1,5 --picture-eye 5,1,0 --flat -o oblique.png");
  return {command, [arguments] { return run_subdivide(*arguments); }};
}

}  // namespace fanstream
