#include "client/session/camera_path_file.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <span>
#include <system_error>

#include "client/session/located_json.h"

namespace fanstream {
namespace {

using Kind = JsonValue::Kind;

constexpr std::array<std::string_view, 3> kPathKeys{"fps", "size_px", "keyframes"};
constexpr std::array<std::string_view, 8> kFrameKeys{"time_s",  "eye",          "target", "up",
                                                     "fov_deg", "tolerance_px", "focus",  "cut"};

class PathReader {
 public:
  explicit PathReader(const std::string& name) : name_(name) {}

  Result<CameraPath> read(const JsonValue& root) {
    if (root.kind != Kind::object) return tl::unexpected(error(root.line, "", "expected an object with keyframes"));
    if (auto known = check_keys(root, "", kPathKeys); !known) return tl::unexpected(known.error());
    CameraPath path;
    path.name = name_;
    if (auto read = read_picture(root, path); !read) return tl::unexpected(read.error());
    const JsonValue* frames = root.find("keyframes");
    if (frames == nullptr) return tl::unexpected(error(root.line, "keyframes", "is missing"));
    if (frames->kind != Kind::array) return tl::unexpected(error(frames->line, "keyframes", "expected an array"));
    if (frames->items.size() > kMostKeyframes) {
      return tl::unexpected(error(frames->line, "keyframes",
                                  fmt::format("{} of them, {} are the most", frames->items.size(), kMostKeyframes),
                                  ErrorKind::limit));
    }
    CameraKeyframe key;  // what a keyframe does not say is as in the one before
    for (std::size_t i = 0; i < frames->items.size(); ++i) {
      if (auto read = read_keyframe(frames->items[i], fmt::format("keyframes[{}]", i), i == 0, key); !read) {
        return tl::unexpected(read.error());
      }
      path.keyframes.push_back(key);
    }
    if (auto checked = check_path(path); !checked) {
      const std::string what = checked.error().message.substr(name_.size() + 2);
      const ErrorKind kind = checked.error().kind == ErrorKind::limit ? ErrorKind::limit : ErrorKind::bad_input;
      const auto [line, where] = fault_of(root, *frames, path);
      return tl::unexpected(error(line, where, what, kind));
    }
    return path;
  }

 private:
  // What check_path does not like of a path of which each keyframe is good by itself, and the line of that.
  static std::pair<std::size_t, std::string> fault_of(const JsonValue& root, const JsonValue& frames,
                                                      const CameraPath& path) {
    const auto at = [](const JsonValue& object, const char* key, const std::string& where) {
      const JsonValue* found = object.find(key);
      return std::pair{found != nullptr ? found->line : object.line, where + key};
    };
    CameraPath only_rate;
    only_rate.fps = path.fps;
    if (!check_picture(only_rate)) return at(root, "fps", "");
    if (!check_picture(path)) return at(root, "size_px", "");
    if (path.keyframes.empty()) return {frames.line, "keyframes"};
    std::size_t late = 0;  // the last one decides how many frames there are
    while (late + 1 < path.keyframes.size() && path.keyframes[late].time_s <= kLatestTimeS) ++late;
    return at(frames.items[late], "time_s", fmt::format("keyframes[{}].", late));
  }

  Error error(std::size_t line, const std::string& key, const std::string& what,
              ErrorKind kind = ErrorKind::bad_input) const {
    return {kind, fmt::format("{}: line {}: {}{}{}", name_, line, key, key.empty() ? "" : ": ", what)};
  }

  Result<void> check_keys(const JsonValue& object, const std::string& where,
                          std::span<const std::string_view> known) const {
    for (std::size_t i = 0; i < object.keys.size(); ++i) {
      if (std::find(known.begin(), known.end(), object.keys[i]) != known.end()) continue;
      return tl::unexpected(
          error(object.key_lines[i], where,
                fmt::format("unknown key {}; there are {}", quoted_text(object.keys[i]), fmt::join(known, ", "))));
    }
    return {};
  }

  Result<void> read_number(const JsonValue& object, const char* key, const std::string& where, double& value) const {
    const JsonValue* found = object.find(key);
    if (found == nullptr) return {};
    if (found->kind != Kind::number) return tl::unexpected(error(found->line, where + key, "expected a number"));
    value = found->number;
    return {};
  }

  // As many numbers as `values` has, if the key is there.
  Result<bool> read_numbers(const JsonValue& object, const char* key, const std::string& where,
                            std::span<double> values) const {
    const JsonValue* found = object.find(key);
    if (found == nullptr) return false;
    bool numbers = found->kind == Kind::array && found->items.size() == values.size();
    for (std::size_t i = 0; numbers && i < values.size(); ++i) {
      numbers = found->items[i].kind == Kind::number;
      values[i] = found->items[i].number;
    }
    if (!numbers) {
      return tl::unexpected(
          error(found->line, where + key, fmt::format("expected an array of {} numbers", values.size())));
    }
    return true;
  }

  Result<void> read_picture(const JsonValue& root, CameraPath& path) const {
    if (auto read = read_number(root, "fps", "", path.fps); !read) return read;
    std::array<double, 2> size{1024.0, 768.0};
    const Result<bool> read = read_numbers(root, "size_px", "", size);
    if (!read) return tl::unexpected(read.error());
    for (const double side : size) {
      if (side >= 1.0 && side <= 1e6 && side == std::floor(side)) continue;
      return tl::unexpected(
          error(root.find("size_px")->line, "size_px", fmt::format("{} is no number of pixels", side)));
    }
    path.width = static_cast<std::uint32_t>(size[0]);
    path.height = static_cast<std::uint32_t>(size[1]);
    return {};
  }

  Result<void> read_point(const JsonValue& object, const char* key, const std::string& where, bool needed,
                          glm::dvec3& point) const {
    std::array<double, 3> numbers{};
    const Result<bool> read = read_numbers(object, key, where, numbers);
    if (!read) return tl::unexpected(read.error());
    if (!*read && needed) return tl::unexpected(error(object.line, where + key, "is missing"));
    if (*read) point = {numbers[0], numbers[1], numbers[2]};
    return {};
  }

  Result<void> read_focus(const JsonValue& object, const std::string& where, std::optional<FocusBall>& focus) const {
    if (const JsonValue* found = object.find("focus"); found != nullptr && found->kind == Kind::null) {
      focus.reset();
      return {};
    }
    std::array<double, 4> numbers{};
    const Result<bool> read = read_numbers(object, "focus", where, numbers);
    if (!read) return tl::unexpected(read.error());
    if (*read) focus = FocusBall{{numbers[0], numbers[1], numbers[2]}, numbers[3]};
    return {};
  }

  Result<void> read_keyframe(const JsonValue& object, const std::string& name, bool first, CameraKeyframe& key) const {
    if (object.kind != Kind::object) return tl::unexpected(error(object.line, name, "expected an object"));
    if (auto known = check_keys(object, name, kFrameKeys); !known) return known;
    const std::string where = name + ".";
    const double before_s = first ? -1.0 : key.time_s;
    const JsonValue* time = object.find("time_s");
    if (time == nullptr) return tl::unexpected(error(object.line, where + "time_s", "is missing"));
    if (auto read = read_number(object, "time_s", where, key.time_s); !read) return read;
    if (key.time_s < 0.0 || key.time_s <= before_s) {
      const std::string rule =
          first ? "must be 0 or more" : fmt::format("must be more than {}, the time before", before_s);
      return tl::unexpected(error(time->line, where + "time_s", fmt::format("is {}, {}", key.time_s, rule)));
    }
    if (auto read = read_point(object, "eye", where, true, key.camera.eye); !read) return read;
    if (auto read = read_point(object, "target", where, true, key.camera.target); !read) return read;
    if (auto read = read_point(object, "up", where, false, key.camera.up); !read) return read;
    if (auto read = read_number(object, "fov_deg", where, key.camera.fov_deg); !read) return read;
    if (auto read = read_number(object, "tolerance_px", where, key.tolerance_px); !read) return read;
    if (auto read = read_focus(object, where, key.focus); !read) return read;
    key.cut = false;
    if (const JsonValue* cut = object.find("cut"); cut != nullptr) {
      if (cut->kind != Kind::boolean) return tl::unexpected(error(cut->line, where + "cut", "expected true or false"));
      key.cut = cut->boolean;
    }
    if (auto checked = check_keyframe(key); !checked) {
      return tl::unexpected(error(line_of(object, checked.error().message), name, checked.error().message));
    }
    return {};
  }

  // The line of the key that a message of check_keyframe is about.
  static std::size_t line_of(const JsonValue& object, const std::string& message) {
    for (const auto& [word, key] : {std::pair{"tolerance", "tolerance_px"},
                                    {"focus:", "focus"},
                                    {"field of view ", "fov_deg"},
                                    {"up must not", "up"},
                                    {"eye and", "eye"}}) {
      const JsonValue* found = object.find(key);
      if (found != nullptr && message.find(word) != std::string::npos) return found->line;
    }
    return object.line;
  }

  const std::string& name_;
};

}  // namespace

Result<CameraPath> parse_camera_path(std::string_view text, const std::string& name) {
  if (text.size() > kMostPathFileBytes) {
    return fail(ErrorKind::limit,
                fmt::format("{}: {} bytes, {} are the most for a camera path", name, text.size(), kMostPathFileBytes));
  }
  const Result<JsonValue> root = read_located_json(text, name);
  if (!root) return tl::unexpected(root.error());
  return PathReader(name).read(*root);
}

Result<CameraPath> read_camera_path(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code status;
  if (!std::filesystem::exists(file, status)) return fail(ErrorKind::not_found, name + ": there is no such file");
  if (std::filesystem::is_directory(file, status)) return fail(ErrorKind::io, name + ": is a folder; name a file");
  std::ifstream stream(file, std::ios::binary);
  // One byte more than may be: what is longer is refused without reading on, a pipe too.
  std::string text(kMostPathFileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad() || (stream.fail() && !stream.eof())) return fail(ErrorKind::io, name + ": cannot be read");
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return parse_camera_path(text, name);
}

}  // namespace fanstream
