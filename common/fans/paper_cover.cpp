#include "common/fans/paper_cover.h"

#include <algorithm>

namespace fanstream {
namespace {

class PaperCover {
 public:
  explicit PaperCover(const VertexStars& stars)
      : stars_(stars),
        owners_(stars.face_count(), kNone),
        role_(stars.vertex_count(), Role::candidate),
        size_(stars.vertex_count(), 0) {}

  FaceOwners run() {
    for (VertexId vertex = 0; vertex < stars_.vertex_count(); ++vertex) {
      if (role_[vertex] == Role::candidate) add_center(vertex);
    }
    return std::move(owners_);
  }

 private:
  enum class Role : std::uint8_t { candidate, center, wing };

  void add_center(VertexId center) {
    role_[center] = Role::center;
    rivals_.clear();
    for (const CornerId corner : stars_.star(center)) {
      for (const VertexId neighbour : {stars_.vertex(next_corner(corner)), stars_.vertex(previous_corner(corner))}) {
        const bool known = std::find(rivals_.begin(), rivals_.end(), neighbour) != rivals_.end();
        if (role_[neighbour] == Role::center && !known) rivals_.push_back(neighbour);
      }
      const FaceId face = face_of(corner);
      if (owners_[face] == kNone) give(face, center);
    }
    for (const VertexId rival : rivals_) {
      const bool takes = size_[center] <= size_[rival];
      for (const CornerId corner : stars_.star(center)) {
        const VertexId next = stars_.vertex(next_corner(corner));
        const VertexId previous = stars_.vertex(previous_corner(corner));
        if (next != rival && previous != rival) continue;
        if (takes) give(face_of(corner), center);
        const VertexId wing = next == rival ? previous : next;
        if (role_[wing] == Role::candidate) role_[wing] = Role::wing;
      }
    }
  }

  void give(FaceId face, VertexId center) {
    if (owners_[face] != kNone) --size_[owners_[face]];
    owners_[face] = center;
    ++size_[center];
  }

  const VertexStars& stars_;
  FaceOwners owners_;
  std::vector<Role> role_;
  std::vector<std::uint32_t> size_;  // faces owned
  std::vector<VertexId> rivals_;
};

}  // namespace

FaceOwners paper_owners(const VertexStars& stars) { return PaperCover(stars).run(); }

}  // namespace fanstream
