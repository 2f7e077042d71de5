// Distances from points to the faces around a vertex, four at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

#include "common/support/vector4.h"

namespace fanstream {

// Four points, one a lane.
struct FourPoints {
  Float4 x{}, y{}, z{};
  void set(int lane, const glm::vec3& p) {
    x[lane] = p.x;
    y[lane] = p.y;
    z[lane] = p.z;
  }
};

// The faces {0, b, c} of a star whose centre is the origin, in order around it. Distances are those to points that lie
// in the face but for the rounding of a few operations: never less than the truth by more than 1e-6 of the largest
// coordinate, however thin the face; they are more than the truth where a face is so thin that its edges are as good.
class StarDistance {
 public:
  static constexpr float kMargin = 2e-6F;  // of the largest coordinate: to be added to a distance to make it a bound

  struct Nearest {
    float squared = std::numeric_limits<float>::infinity();
    std::uint32_t face = 0;
  };

  static constexpr std::uint32_t kNoFace = 0xFFFFFFFFU;

  void clear() {
    blocks_.clear();
    rows_.clear();
    sides_.clear();
    normals_.clear();
    count_ = 0;
    closed_ = false;
  }
  std::uint32_t count() const { return count_; }

  // The face that follows counter-clockwise, if any.
  std::uint32_t after(std::uint32_t face) const {
    if (face + 1 < count_) return face + 1;
    return closed_ ? 0 : kNoFace;
  }
  std::uint32_t before(std::uint32_t face) const {
    if (face > 0) return face - 1;
    return closed_ ? count_ - 1 : kNoFace;
  }
  // Positive on the side of after(face), negative on that of the face: the plane halfway between the two through their
  // common edge. Precondition: there is a face after it.
  float side(const glm::vec3& p, std::uint32_t face) const { return glm::dot(p, sides_[face]); }

  void add(const glm::vec3& b, const glm::vec3& c) {
    if (count_ % 4 == 0) blocks_.emplace_back();
    const glm::vec3 e = c - b;
    const float bb = glm::dot(b, b);
    const float cc = glm::dot(c, c);
    const float bc = glm::dot(b, c);
    const float det = glm::dot(glm::cross(b, c), glm::cross(b, c));
    const float values[kValues] = {b.x,
                                   b.y,
                                   b.z,
                                   c.x,
                                   c.y,
                                   c.z,
                                   e.x,
                                   e.y,
                                   e.z,
                                   inverse(bb),
                                   inverse(cc),
                                   inverse(glm::dot(e, e)),
                                   bb * inverse(det),
                                   cc * inverse(det),
                                   bc * inverse(det)};
    // Unused lanes of the last block repeat this face; nearest() then finds its first.
    for (int i = 0; i < kValues; ++i) {
      for (std::uint32_t lane = count_ % 4; lane < 4; ++lane) blocks_.back().values[i][lane] = values[i];
    }
    rows_.emplace_back();
    std::copy_n(values, kValues, rows_.back().values);
    ++count_;
    const glm::vec3 normal = glm::cross(b, c);
    const float length = glm::length(normal);
    normals_.push_back(length > 0.0F ? normal / length : glm::vec3(0.0F));
    sides_.push_back(c);
  }

  // Call when all faces are there. `closed`: the first follows the last.
  void finish(bool closed) {
    closed_ = closed;
    for (std::uint32_t f = 0; f < count_; ++f) {
      const std::uint32_t next = after(f);
      if (next == kNoFace) continue;
      sides_[f] = glm::cross(normals_[f] + normals_[next], sides_[f]);
    }
  }

  // How many floats nearest() stores.
  std::uint32_t stored() const { return static_cast<std::uint32_t>(4 * blocks_.size()); }

  // The nearest face; the first of equals. Also stores the squared distances from all faces, and from the last one
  // again up to stored(). Precondition: there is a face.
  Nearest nearest(const glm::vec3& query, float* all) const {
    const FourPoints q{float4(query.x), float4(query.y), float4(query.z)};
    Float4 best = float4(std::numeric_limits<float>::infinity());
    Uint4 where = uint4(0);
    for (std::uint32_t i = 0; i < blocks_.size(); ++i) {
      const Float4 squared = distances(q, blocks_[i].values);
      store4(all + 4 * i, squared);
      const Uint4 nearer = mask_of(squared < best);
      best = chosen(nearer, squared, best);
      where = chosen(nearer, uint4(4 * i) + kLaneNumbers, where);
    }
    Nearest nearest;
    for (int lane = 0; lane < 4; ++lane) {
      if (best[lane] < nearest.squared || (best[lane] == nearest.squared && where[lane] < nearest.face)) {
        nearest = {best[lane], where[lane]};
      }
    }
    return nearest;
  }

  Float4 squared(const FourPoints& points, std::uint32_t face) const { return squared(points, face, face); }

  // The first two points from one face, the others from another.
  Float4 squared(const FourPoints& points, std::uint32_t first, std::uint32_t second) const {
    Float4 values[16];
    for (int i = 0; i < 4; ++i) {
      const Float4 a = load4(rows_[first].values + 4 * i);
      const Float4 b = load4(rows_[second].values + 4 * i);
      values[4 * i] = __builtin_shufflevector(a, b, 0, 0, 4, 4);
      values[4 * i + 1] = __builtin_shufflevector(a, b, 1, 1, 5, 5);
      values[4 * i + 2] = __builtin_shufflevector(a, b, 2, 2, 6, 6);
      values[4 * i + 3] = __builtin_shufflevector(a, b, 3, 3, 7, 7);
    }
    return distances(points, values);
  }

 private:
  static constexpr int kValues = 15;
  struct Block {  // four faces, one a lane
    Float4 values[kValues];
  };
  struct Row {  // one face
    float values[16] = {};
  };

  static float inverse(float v) {
    const float result = 1.0F / v;
    return result < std::numeric_limits<float>::max() ? result : 0.0F;
  }
  static Float4 smaller(Float4 a, Float4 b) { return a < b ? a : b; }
  static Float4 within_one(Float4 t) { return smaller(t < float4(0.0F) ? float4(0.0F) : t, float4(1.0F)); }

  static Float4 distances(const FourPoints& q, const Float4* v) {
    const Float4 qb = q.x * v[0] + q.y * v[1] + q.z * v[2];
    const Float4 qc = q.x * v[3] + q.y * v[4] + q.z * v[5];
    const Float4 along_b = within_one(qb * v[9]);
    const Float4 along_c = within_one(qc * v[10]);
    const Float4 none = float4(0.0F);
    Float4 best = smaller(squared_rest(q, v, along_b, none), squared_rest(q, v, none, along_c));
    const Float4 qe = (q.x - v[0]) * v[6] + (q.y - v[1]) * v[7] + (q.z - v[2]) * v[8];
    const Float4 along_e = within_one(qe * v[11]);
    best = smaller(best, squared_rest(q, v, float4(1.0F) - along_e, along_e));
    const Float4 weight_b = v[13] * qb - v[14] * qc;
    const Float4 weight_c = v[12] * qc - v[14] * qb;
    const Uint4 inside =
        mask_of(weight_b >= none) & mask_of(weight_c >= none) & mask_of(weight_b + weight_c <= float4(1.0F));
    return smaller(best, chosen(inside, squared_rest(q, v, weight_b, weight_c), best));
  }

  static Float4 squared_rest(const FourPoints& q, const Float4* v, Float4 weight_b, Float4 weight_c) {
    const Float4 x = q.x - (weight_b * v[0] + weight_c * v[3]);
    const Float4 y = q.y - (weight_b * v[1] + weight_c * v[4]);
    const Float4 z = q.z - (weight_b * v[2] + weight_c * v[5]);
    return x * x + y * y + z * z;
  }

  std::vector<Block> blocks_;
  std::vector<Row> rows_;
  std::vector<glm::vec3> normals_;
  std::vector<glm::vec3> sides_;  // by face: normal of the plane between it and the next; before finish() its edge
  bool closed_ = false;
  std::uint32_t count_ = 0;
};

}  // namespace fanstream
