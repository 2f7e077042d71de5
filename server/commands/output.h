// What several commands print alike.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/asset/asset_file.h"
#include "common/support/result.h"
#include "server/build/asset_builder.h"

namespace fanstream {

using Json = nlohmann::ordered_json;  // members in the order in which they are added

// Prints "fanstream-server: <message>" to standard error; returns the exit code.
int report_error(const Error& error);
// Prints to standard output and flushes; returns 0, or the exit code if that fails (a full disk, a closed pipe).
int print_json(const Json& json);
int flush_output();

// What an asset says of itself, under the names of `build --json`.
BuildReport report_of(const AssetFile& asset);
Json json_of(const BuildReport& report);

// "1,234,567"
std::string grouped(std::uint64_t number);
// Greatest memory this process has had, all its threads together.
std::uint64_t peak_memory_bytes();
// The lines of a summary that build and inspect share, each ended by a new line, within 80 columns.
std::string summary_of(const BuildReport& report, const Digest& digest);

}  // namespace fanstream
