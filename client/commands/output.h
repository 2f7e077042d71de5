// What several commands print alike.
#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "client/model/model_fetch.h"
#include "common/support/result.h"

namespace fanstream {

using Json = nlohmann::ordered_json;  // members in the order in which they are added

// Prints "fanstream-client: <message>" to standard error; returns the exit code.
int report_error(const Error& error);
// Prints to standard output and flushes; returns 0, or the exit code if that fails (a full disk, a closed pipe).
int print_json(const Json& json);
int flush_output();

// "1,234,567"
std::string grouped(std::uint64_t number);
// "812 B", "35.2 kB", "1.24 MB"
std::string size_text(std::uint64_t bytes);

Json json_of(const glm::dvec3& p);  // [x, y, z]
Json json_of(const FetchReport& report);
// The lines about a transfer that fetch and render share, each ended by a new line, within 80 columns.
std::string summary_of(const FetchReport& report);

// Fails where nothing could be written later, so that nothing is fetched in vain: no such folder, a folder of that
// name, and, for an `extension` that is not empty, a file name with another one.
Result<void> check_output_path(const std::filesystem::path& path, const std::string& extension);
// The same for a folder to write into, which may be there or not; and makes it if it is not.
Result<void> check_output_folder(const std::filesystem::path& folder);
Result<void> make_output_folder(const std::filesystem::path& folder);

}  // namespace fanstream
