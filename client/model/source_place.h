// SOURCE as given on command lines: the path of an asset file, or HOST:PORT/MODEL.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "client/net/server_address.h"

namespace fanstream {

struct SourcePlace {
  std::optional<ServerAddress> server;  // with a model; otherwise
  std::filesystem::path file;           // exists
};

// A file that exists is meant before a server of that name. Errors: not_found, usage (no model, not an address).
Result<SourcePlace> locate_source(const std::string& text);

}  // namespace fanstream
