// A mesh as a file, for what starts from files.
#pragma once

#include <filesystem>
#include <fstream>

#include "common/mesh/triangle_mesh.h"

namespace fanstream::bench {

inline void write_off(const std::filesystem::path& path, const TriangleMesh& mesh) {
  std::ofstream file(path);
  file.precision(17);
  file << "OFF\n" << mesh.positions.size() << ' ' << mesh.triangles.size() << " 0\n";
  for (const glm::dvec3& p : mesh.positions) file << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (const Triangle& t : mesh.triangles) file << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
}

}  // namespace fanstream::bench
