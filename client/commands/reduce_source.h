// What the reduce command starts from: a model of a server, an asset file, or a mesh file of any format.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/model/model_fetch.h"
#include "common/mesh/vertex_attributes.h"

namespace fanstream {

class ProgressBar;

struct ReduceMesh {
  TriangleMesh mesh;  // an oriented manifold
  CornerAttributes attributes;
  std::vector<std::string> notes;  // what import and cleaning had to say, a sentence each
};

// Not thread safe.
class ReduceSource {
 public:
  // Finds out what it is: of a model its head is received, of a mesh file the bytes are read once. Errors as
  // ModelFetch::open and import_mesh.
  static Result<ReduceSource> open(const std::string& source, ProgressBar& bar);

  // Changes whenever the mesh does.
  const std::string& hash() const { return hash_; }
  // For file names: the model's, or the file's without extension; of letters, digits, dots, dashes and underscores.
  const std::string& name() const { return name_; }
  // Receives or reads all of it.
  Result<ReduceMesh> load(ProgressBar& bar);

 private:
  std::string source_, hash_, name_;
  std::unique_ptr<ModelFetch> fetch_;  // of a model, or
  std::filesystem::path file_;
  std::unique_ptr<ReduceMesh> read_;  // of a file that names others, which cannot be told by its bytes
};

}  // namespace fanstream
