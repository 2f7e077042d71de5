#include "server/build/carried_triangle.h"

#include <cmath>

namespace fanstream {
namespace {

int next(int corner) { return corner == 2 ? 0 : corner + 1; }
int before(int corner) { return corner == 0 ? 2 : corner - 1; }

glm::vec3 between(const glm::vec3& a, const glm::vec3& b, float share) { return a + share * (b - a); }

// Keeps the point inside where it is when crossings are about to move.
void fix_centre(CarriedTriangle& triangle) {
  if (triangle.form == CarriedTriangle::kCentre) return;
  const int odd = static_cast<int>(triangle.form);
  const float leaving = triangle.crossing_share(odd);
  const float leading = triangle.crossing_share(before(odd));
  const float share = triangle.centre[0];
  float weights[3];
  weights[odd] = (1.0F - share) * (1.0F - leaving) + share * leading;
  weights[next(odd)] = (1.0F - share) * leaving;
  weights[before(odd)] = share * (1.0F - leading);
  triangle.form = CarriedTriangle::kCentre;
  triangle.centre[0] = weights[1];
  triangle.centre[1] = weights[2];
}

// To what CarriedTriangle::crossings can say; shares of both directions along an edge can be said alike.
std::uint16_t share_code(float share) {
  return static_cast<std::uint16_t>(std::clamp(share * 0x1p16F + 0.5F, 1.0F, 65535.0F));
}
float rounded(float share) { return static_cast<float>(share_code(share)) * 0x1p-16F; }

// Where a line crosses from one face to another, by the squared distances of its two ends from both: as if both
// were in the line's plane, ends beside a face as far as their distance from it exceeds that from their own.
float crossing_share(float from_own, float from_other, float to_own, float to_other) {
  const float a = std::sqrt(std::max(0.0F, from_other - from_own));
  const float b = std::sqrt(std::max(0.0F, to_other - to_own));
  return rounded(a + b > 0.0F ? a / (a + b) : 0.5F);
}

// The same for distances that change linearly.
float linear_share(float from_own, float from_other, float to_own, float to_other) {
  const float a = std::max(0.0F, std::sqrt(from_other) - std::sqrt(from_own));
  const float b = std::max(0.0F, std::sqrt(to_other) - std::sqrt(to_own));
  return rounded(a + b > 0.0F ? a / (a + b) : 0.5F);
}

float largest3(Float4 v) { return std::max({v[0], v[1], v[2]}); }
float largest4(Float4 v) { return std::max({v[0], v[1], v[2], v[3]}); }
Float4 larger(Float4 a, Float4 b) { return a < b ? b : a; }

FourPoints four(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d) {
  return {Float4{a.x, b.x, c.x, d.x}, Float4{a.y, b.y, c.y, d.y}, Float4{a.z, b.z, c.z, d.z}};
}

}  // namespace

glm::vec3 crossing_of(const CarriedTriangle& triangle, const TriangleInStar& at, int edge) {
  return between(at.points[edge], at.points[next(edge)], triangle.crossing_share(edge));
}

glm::vec3 centre_of(const CarriedTriangle& triangle, const TriangleInStar& at) {
  if (triangle.form == CarriedTriangle::kCentre) {
    return at.points[0] + triangle.centre[0] * (at.points[1] - at.points[0]) +
           triangle.centre[1] * (at.points[2] - at.points[0]);
  }
  const int odd = static_cast<int>(triangle.form);
  return between(crossing_of(triangle, at, odd), crossing_of(triangle, at, before(odd)), triangle.centre[0]);
}

// A little more than the corners themselves need does no harm, nor does what is well below the largest.
bool TriangleCarrier::is_enough(float squared, float own) const {
  return squared <= std::max(1.002F * own, 0.5F * lower_);
}

float TriangleCarrier::carry(CarriedTriangle& triangle, TriangleInStar& at) const {
  const int inside = int{at.inside[0]} + int{at.inside[1]} + int{at.inside[2]};
  if (inside == 3) return carry_all(triangle, at);
  if (inside == 2) return carry_two(triangle, at, !at.inside[0] ? 0 : !at.inside[1] ? 1 : 2);
  return carry_one(triangle, at, at.inside[0] ? 0 : at.inside[1] ? 1 : 2);
}

float TriangleCarrier::carry_all(CarriedTriangle& triangle, TriangleInStar& at) const {
  const float own = std::max({at.squared[0], at.squared[1], at.squared[2]});
  if (at.all_on_one()) return own;
  const FourPoints corners = four(at.points[0], at.points[1], at.points[2], at.points[0]);
  float best = std::numeric_limits<float>::infinity();
  std::uint32_t whole = 0;
  const std::uint32_t candidates[] = {at.before, at.faces[0], at.faces[1], at.faces[2]};
  for (int i = 0; i < 4; ++i) {
    const std::uint32_t face = candidates[i];
    if (face == TriangleInStar::kNoFace || std::find(candidates, candidates + i, face) != candidates + i) continue;
    const float squared = largest3(star_->squared(corners, face));
    if (squared >= best) continue;
    best = squared;
    whole = face;
    if (i == 0 && is_enough(best, own)) break;
  }
  if (!is_enough(best, own)) {
    CarriedTriangle cut = triangle;
    float squared = 0.0F;
    if (at.faces[1] == at.faces[2]) {
      squared = cut_off(cut, at, 0, own);
    } else if (at.faces[2] == at.faces[0]) {
      squared = cut_off(cut, at, 1, own);
    } else if (at.faces[0] == at.faces[1]) {
      squared = cut_off(cut, at, 2, own);
    } else {
      squared = cut_in_three(cut, at, own);
    }
    if (squared < best) {
      triangle = cut;
      return squared;
    }
  }
  at.faces = {whole, whole, whole};
  return best;
}

// One corner on a face, the other two on another: a strip.
float TriangleCarrier::cut_off(CarriedTriangle& triangle, const TriangleInStar& at, int odd, float own) const {
  const int i = next(odd);
  const int j = before(odd);
  const std::uint32_t own_face = at.faces[odd];
  const std::uint32_t other = at.faces[i];
  const Float4 to_own = star_->squared(four(at.points[0], at.points[1], at.points[2], at.points[0]), own_face);
  const float odd_to_other =
      star_->squared(four(at.points[odd], at.points[odd], at.points[odd], at.points[odd]), other)[0];
  const float leaving[] = {crossing_share(at.squared[odd], odd_to_other, at.squared[i], to_own[i]),
                           linear_share(at.squared[odd], odd_to_other, at.squared[i], to_own[i])};
  const float leading[] = {crossing_share(at.squared[odd], odd_to_other, at.squared[j], to_own[j]),
                           linear_share(at.squared[odd], odd_to_other, at.squared[j], to_own[j])};
  const FourPoints tries =
      four(between(at.points[odd], at.points[i], leaving[0]), between(at.points[odd], at.points[j], leading[0]),
           between(at.points[odd], at.points[i], leaving[1]), between(at.points[odd], at.points[j], leading[1]));
  const Float4 both = larger(star_->squared(tries, own_face), star_->squared(tries, other));
  float share_leaving = both[2] < both[0] ? leaving[1] : leaving[0];
  float share_leading = both[3] < both[1] ? leading[1] : leading[0];
  const float first =
      improve_crossing(at.points[odd], at.points[i], own_face, other, share_leaving, std::min(both[0], both[2]));
  const float second =
      improve_crossing(at.points[odd], at.points[j], own_face, other, share_leading, std::min(both[1], both[3]));
  triangle.form = static_cast<std::uint8_t>(odd);
  triangle.centre[0] = 0.5F;
  triangle.crossings[odd] = share_code(share_leaving);
  triangle.crossings[j] = share_code(1.0F - share_leading);
  return std::max({own, first, second});
}

// Moves a crossing as long as it would raise the largest distance. Returns the squared distance there.
float TriangleCarrier::improve_crossing(const glm::vec3& from, const glm::vec3& to, std::uint32_t face_from,
                                        std::uint32_t face_to, float& share, float value) const {
  float reach = 0.4F;
  for (int round = 0; round < 5 && value > upper_; ++round, reach *= 0.4F) {
    float shares[4];
    const float steps[] = {-1.0F, -0.4F, 0.4F, 1.0F};
    for (int i = 0; i < 4; ++i) shares[i] = rounded(share + steps[i] * reach);
    const FourPoints tries = four(between(from, to, shares[0]), between(from, to, shares[1]),
                                  between(from, to, shares[2]), between(from, to, shares[3]));
    const Float4 both = larger(star_->squared(tries, face_from), star_->squared(tries, face_to));
    for (int i = 0; i < 4; ++i) {
      if (both[i] >= value) continue;
      value = both[i];
      share = shares[i];
    }
  }
  return value;
}

float TriangleCarrier::cut_in_three(CarriedTriangle& triangle, const TriangleInStar& at, float own) const {
  const FourPoints corners = four(at.points[0], at.points[1], at.points[2], at.points[0]);
  Float4 to[3];
  for (int i = 0; i < 3; ++i) to[i] = star_->squared(corners, at.faces[i]);
  float shares[3];
  glm::vec3 points[3];
  for (int e = 0; e < 3; ++e) {
    const int n = next(e);
    shares[e] = crossing_share(at.squared[e], to[n][e], at.squared[n], to[e][n]);
    points[e] = between(at.points[e], at.points[n], shares[e]);
  }
  triangle.form = CarriedTriangle::kCentre;
  triangle.centre[0] = triangle.centre[1] = 1.0F / 3.0F;
  const glm::vec3 middle = centre_of(triangle, at);
  const FourPoints tries = four(points[0], points[1], points[2], middle);
  for (int i = 0; i < 3; ++i) to[i] = star_->squared(tries, at.faces[i]);
  float worst = own;
  for (int e = 0; e < 3; ++e) {
    const int n = next(e);
    worst = std::max(worst, improve_crossing(at.points[e], at.points[n], at.faces[e], at.faces[n], shares[e],
                                             std::max(to[e][e], to[n][e])));
    triangle.crossings[e] = share_code(shares[e]);
  }
  // The point inside: the best of some.
  float inside = std::max({to[0][3], to[1][3], to[2][3]});
  float reach = 0.25F;
  for (int round = 0; round < 6 && inside > std::max(upper_, worst); ++round, reach *= 0.6F) {
    const float u = triangle.centre[0];
    const float v = triangle.centre[1];
    const float us[] = {u + reach, u - reach, u, u};
    const float vs[] = {v, v, v + reach, v - reach};
    glm::vec3 places[4];
    for (int i = 0; i < 4; ++i) {
      places[i] = at.points[0] + us[i] * (at.points[1] - at.points[0]) + vs[i] * (at.points[2] - at.points[0]);
    }
    const FourPoints around = four(places[0], places[1], places[2], places[3]);
    const Float4 all = larger(star_->squared(around, at.faces[0]),
                              larger(star_->squared(around, at.faces[1]), star_->squared(around, at.faces[2])));
    for (int i = 0; i < 4; ++i) {
      if (all[i] >= inside || us[i] < 0.0F || vs[i] < 0.0F || us[i] + vs[i] > 1.0F) continue;
      inside = all[i];
      triangle.centre[0] = us[i];
      triangle.centre[1] = vs[i];
    }
  }
  return std::max(worst, inside);
}

float TriangleCarrier::carry_two(CarriedTriangle& triangle, TriangleInStar& at, int outside) const {
  const int a = next(outside);
  const int b = before(outside);
  const bool strip = triangle.form == static_cast<std::uint8_t>(outside);
  if (!strip) fix_centre(triangle);
  const float own = std::max(at.squared[a], at.squared[b]);
  const FourPoints points =
      four(at.points[a], at.points[b], crossing_of(triangle, at, outside), crossing_of(triangle, at, b));
  const glm::vec3 centre = strip ? at.points[a] : centre_of(triangle, at);
  const auto together = [&](std::uint32_t face) {
    const float squared = largest4(star_->squared(points, face));
    return strip ? squared : std::max(squared, star_->squared(four(centre, centre, centre, centre), face)[0]);
  };
  std::uint32_t whole = at.faces[a];
  float best = together(whole);
  if (at.faces[b] != at.faces[a]) {
    const float other = together(at.faces[b]);
    if (other < best) {
      best = other;
      whole = at.faces[b];
    }
  }
  if (!is_enough(best, own) && at.faces[a] != at.faces[b]) {
    CarriedTriangle cut = triangle;
    const float squared = part_two(cut, at, outside, own);
    if (squared < best && (squared <= upper_ || best > upper_)) {
      triangle = cut;
      return squared;
    }
  }
  for (std::uint32_t face = 0; face < star_->count() && best > upper_; ++face) {
    const float squared = together(face);
    if (squared >= best) continue;
    best = squared;
    whole = face;
  }
  at.faces[a] = at.faces[b] = whole;
  return best;
}

// The two corners that are inside, on different faces; the crossings of the other two edges stay.
float TriangleCarrier::part_two(CarriedTriangle& triangle, const TriangleInStar& at, int outside, float own) const {
  const int a = next(outside);
  const int b = before(outside);
  const std::uint32_t face_a = at.faces[a];
  const std::uint32_t face_b = at.faces[b];
  const glm::vec3 on_a = crossing_of(triangle, at, outside);
  const glm::vec3 on_b = crossing_of(triangle, at, b);
  const FourPoints ends = four(at.points[a], at.points[b], on_a, on_b);
  const Float4 ends_to_a = star_->squared(ends, face_a);
  const Float4 ends_to_b = star_->squared(ends, face_b);
  float share_edge = crossing_share(at.squared[a], ends_to_b[0], at.squared[b], ends_to_a[1]);
  glm::vec3 centre(0.0F);
  float share = 0.0F;
  const bool strip = triangle.form == static_cast<std::uint8_t>(outside);
  if (strip) {
    share = crossing_share(ends_to_a[2], ends_to_b[2], ends_to_b[3], ends_to_a[3]);
    centre = between(on_a, on_b, share);
  } else {
    centre = centre_of(triangle, at);
  }
  const glm::vec3 on_edge = between(at.points[a], at.points[b], share_edge);
  const FourPoints middle = four(on_edge, centre, on_edge, centre);
  const Float4 both = larger(star_->squared(middle, face_a), star_->squared(middle, face_b));
  const float crossed = improve_crossing(at.points[a], at.points[b], face_a, face_b, share_edge, both[0]);
  triangle.crossings[a] = share_code(share_edge);
  float inside = both[1];
  if (strip) {
    inside = improve_crossing(on_a, on_b, face_a, face_b, share, inside);
    triangle.centre[0] = share;  // from the crossing of the edge that leaves the corner outside
  }
  return std::max({own, ends_to_a[2], ends_to_b[3], crossed, inside});
}

float TriangleCarrier::carry_one(const CarriedTriangle& triangle, TriangleInStar& at, int corner) const {
  const glm::vec3 leaving = crossing_of(triangle, at, corner);
  const bool strip = triangle.form == static_cast<std::uint8_t>(corner);
  const FourPoints points = four(at.points[corner], leaving, crossing_of(triangle, at, before(corner)),
                                 strip ? leaving : centre_of(triangle, at));
  std::uint32_t& face = at.faces[corner];
  float best = largest4(star_->squared(points, face));
  for (std::uint32_t other = 0; other < star_->count() && best > upper_; ++other) {
    const float squared = largest4(star_->squared(points, other));
    if (squared >= best) continue;
    best = squared;
    face = other;
  }
  return best;
}

}  // namespace fanstream
