// A camera that sees a given share of a surface, and what the rest of the surface would have cost it.
#pragma once

#include <cstdint>
#include <memory>

#include "client/view/criteria.h"
#include "common/mesh/triangle_mesh.h"
#include "tests/bench/open_asset.h"

namespace fanstream::bench {

enum class Counted : std::uint8_t { all, facing };
// Of the surface by area: triangles, all or those that face the eye, of which the centre lies inside the picture and
// beyond the near plane, whether something hides them or not.
double share_in_picture(const TriangleMesh& mesh, const View& view, Counted counted = Counted::all);

// Shares are of the whole surface.
struct CloseView {
  View view;
  double share = 0.0;         // inside the picture
  double facing_share = 0.0;  // inside the picture and facing the eye
  double distance = 0.0;      // from the eye to the vertex that it looks at
};

// From the eye of whole_view() towards the surface in the middle of its picture (the nearest vertex within 2 % of the
// diagonal of the line of sight), as close as shows `share` of the surface, found by bisection of the distance down to
// a thousandth of what it was. Where all is counted, more than `share` may be left there, of what lies behind; where
// that alone is counted that faces the eye, it may be less from the start, and then the eye stays where it was.
// Precondition: 0 < share < 1, and the mesh has triangles.
CloseView close_view(const TriangleMesh& mesh, double share, Counted counted);

struct CloseUp {
  Counted counted = Counted::all;
  CloseView view;
  double tolerance_px = 0.0;
  std::uint64_t in_picture_bytes = 0;  // until the stated error is at most the tolerance, with plain_criteria()
  // The same camera and tolerance, each cell wanted by the error that it has at its own distance, in the picture or
  // not, until nothing more is wanted: what faces the eye or may, and all of it.
  std::uint64_t facing_bytes = 0;
  std::uint64_t everything_bytes = 0;
  // Segments whose cells' bounds, all of them as far away as what the camera looks at, are more than the tolerance:
  // the whole surface refined evenly.
  std::uint64_t even_bytes = 0;

  double share_of(std::uint64_t bytes) const {
    return static_cast<double>(in_picture_bytes) / static_cast<double>(bytes);
  }
};

// Bytes are of segments. `full` is the asset's full model.
Result<CloseUp> measure_close_up(const std::shared_ptr<const OpenAsset>& asset, const TriangleMesh& full, double share,
                                 Counted counted, double tolerance_px);

}  // namespace fanstream::bench
