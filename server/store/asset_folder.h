// The folder of built assets: one file for each model, named after it and after what it was made of.
#pragma once

#include <filesystem>
#include <string>

#include "common/support/result.h"

namespace fanstream {

// Belongs to one folder of models; other servers may read it, only one may build into it at a time. Thread safe for
// distinct models.
class AssetFolder {
 public:
  // Makes the folder if it is missing, tries whether it can be written to, and removes what a killed server left half
  // written. Fails (io, usage) naming the folder and what to do.
  static Result<AssetFolder> open(const std::filesystem::path& folder);

  const std::filesystem::path& path() const { return folder_; }
  // Where the asset of this model, made of that (source_key), belongs: "<model>-<first 16 digits>.fan".
  std::filesystem::path file_of(const std::string& model, const std::string& key) const;
  // Removes what the model was before. Call once the file for `key` is there. Failures are of no consequence.
  void remove_superseded(const std::string& model, const std::string& key) const;

 private:
  explicit AssetFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void remove_leftovers() const;

  std::filesystem::path folder_;
};

}  // namespace fanstream
