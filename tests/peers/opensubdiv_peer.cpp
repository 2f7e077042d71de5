#include "tests/peers/opensubdiv_peer.h"

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <memory>

namespace fanstream::testing {
namespace {

namespace Osd = OpenSubdiv;

template <class Value>
struct Primvar {
  Value value;
  void Clear() { value = Value(0); }
  template <class Weight>
  void AddWithWeight(const Primvar& other, Weight weight) {
    value += other.value * static_cast<typename Value::value_type>(weight);
  }
};

std::unique_ptr<Osd::Far::TopologyRefiner> make_refiner(const PolygonMesh& mesh, BoundaryRule rule) {
  using Factory = Osd::Far::TopologyRefinerFactory<Osd::Far::TopologyDescriptor>;
  std::vector<int> sizes(mesh.face_count());
  for (FaceId f = 0; f < mesh.face_count(); ++f) sizes[f] = static_cast<int>(mesh.face(f).size());
  const std::vector<int> corners(mesh.corners.begin(), mesh.corners.end());
  Osd::Far::TopologyDescriptor descriptor;
  descriptor.numVertices = static_cast<int>(mesh.points.size());
  descriptor.numFaces = static_cast<int>(mesh.face_count());
  descriptor.numVertsPerFace = sizes.data();
  descriptor.vertIndicesPerFace = corners.data();
  Osd::Sdc::Options options;
  options.SetVtxBoundaryInterpolation(rule == BoundaryRule::smooth ? Osd::Sdc::Options::VTX_BOUNDARY_EDGE_ONLY
                                                                   : Osd::Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
  return std::unique_ptr<Osd::Far::TopologyRefiner>(
      Factory::Create(descriptor, Factory::Options(Osd::Sdc::SCHEME_CATMARK, options)));
}

template <class Real, class Value>
std::vector<Primvar<Value>> interpolated(const Osd::Far::TopologyRefiner& refiner, std::vector<Primvar<Value>> points,
                                         unsigned levels) {
  const Osd::Far::PrimvarRefinerReal<Real> primvars(refiner);
  for (unsigned level = 1; level <= levels; ++level) {
    std::vector<Primvar<Value>> next(
        static_cast<std::size_t>(refiner.GetLevel(static_cast<int>(level)).GetNumVertices()));
    primvars.Interpolate(static_cast<int>(level), points, next);
    points = std::move(next);
  }
  return points;
}

template <class Value>
std::vector<Primvar<Value>> primvars_of(const PolygonMesh& mesh) {
  std::vector<Primvar<Value>> points;
  points.reserve(mesh.points.size());
  for (const glm::dvec4& point : mesh.points) points.push_back({Value(point)});
  return points;
}

}  // namespace

PolygonMesh refine_with_opensubdiv(const PolygonMesh& mesh, unsigned levels, BoundaryRule rule) {
  const auto refiner = make_refiner(mesh, rule);
  refiner->RefineUniform(Osd::Far::TopologyRefiner::UniformOptions(static_cast<int>(levels)));
  PolygonMesh result;
  for (const auto& point : interpolated<double>(*refiner, primvars_of<glm::dvec4>(mesh), levels)) {
    result.points.push_back(point.value);
  }
  const Osd::Far::TopologyLevel& last = refiner->GetLevel(static_cast<int>(levels));
  for (int f = 0; f < last.GetNumFaces(); ++f) {
    const auto corners = last.GetFaceVertices(f);
    std::vector<VertexId> face;
    for (int i = 0; i < corners.size(); ++i) face.push_back(static_cast<VertexId>(corners[i]));
    result.add_face(face);
  }
  return result;
}

std::size_t time_opensubdiv(const PolygonMesh& mesh, unsigned levels, bool doubles) {
  const auto refiner = make_refiner(mesh, BoundaryRule::corners);
  refiner->RefineUniform(Osd::Far::TopologyRefiner::UniformOptions(static_cast<int>(levels)));
  if (doubles) {
    interpolated<double>(*refiner, primvars_of<glm::dvec4>(mesh), levels);
  } else {
    interpolated<float>(*refiner, primvars_of<glm::vec3>(mesh), levels);
  }
  return static_cast<std::size_t>(refiner->GetLevel(static_cast<int>(levels)).GetNumFaces());
}

}  // namespace fanstream::testing
