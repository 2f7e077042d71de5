#include <cstdio>
#include <vector>

#include "common/mesh/triangle_mesh.h"

int main() {
  const std::vector<fanstream::Triangle> two_separate_triangles = {{0, 1, 2}, {3, 4, 5}};
  const std::size_t components = fanstream::count_components(6, two_separate_triangles);
  std::printf("%zu components\n", components);
  return components == 2 ? 0 : 1;
}
