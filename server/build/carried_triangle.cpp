#include "server/build/carried_triangle.h"

namespace fanstream {
namespace {

int next(int corner) { return corner == 2 ? 0 : corner + 1; }
int before(int corner) { return corner == 0 ? 2 : corner - 1; }

glm::vec3 between(const glm::vec3& a, const glm::vec3& b, float share) { return a + share * (b - a); }

std::uint16_t share_code(float share) {
  return static_cast<std::uint16_t>(std::clamp(share * 0x1p16F + 0.5F, 0.0F, 65535.0F));
}
float share_of(std::uint16_t code) { return static_cast<float>(code) * 0x1p-16F; }

float largest4(Float4 v) { return std::max({v[0], v[1], v[2], v[3]}); }

FourPoints four(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d) {
  return {Float4{a.x, b.x, c.x, d.x}, Float4{a.y, b.y, c.y, d.y}, Float4{a.z, b.z, c.z, d.z}};
}

}  // namespace

Piece piece_of(const CarriedTriangle& triangle, const std::array<glm::vec3, 3>& corners, int piece) {
  const glm::vec3& k = corners[triangle.first];
  const glm::vec3& i = corners[next(triangle.first)];
  const glm::vec3& j = corners[before(triangle.first)];
  const auto at = [&](const glm::vec3& from, const glm::vec3& to, int n) {
    return between(from, to, share_of(triangle.shares[n]));
  };
  switch (triangle.cut) {
    case Cut::strip:
      if (piece == 0) return {{k, at(k, i, 0), at(k, j, 1)}, 3};
      return {{at(k, i, 0), i, j, at(k, j, 1)}, 4};
    case Cut::strips:
      if (piece == 0) return {{k, at(k, i, 0), at(k, j, 1)}, 3};
      if (piece == 1) return {{at(k, i, 0), at(k, i, 2), at(k, j, 3), at(k, j, 1)}, 4};
      return {{at(k, i, 2), i, j, at(k, j, 3)}, 4};
    case Cut::middle:
      if (piece == 0) return {{i, at(i, j, 2), at(k, i, 0)}, 3};
      if (piece == 1) return {{k, at(k, i, 0), at(i, j, 2), at(i, j, 3), at(k, j, 1)}, 5};
      return {{j, at(k, j, 1), at(i, j, 3)}, 3};
    case Cut::centre: {
      const glm::vec3 centre = k + share_of(triangle.shares[3]) * (i - k) + share_of(triangle.shares[4]) * (j - k);
      if (piece == 0) return {{k, at(k, i, 0), centre, at(j, k, 2)}, 4};
      if (piece == 1) return {{i, at(i, j, 1), centre, at(k, i, 0)}, 4};
      return {{j, at(j, k, 2), centre, at(i, j, 1)}, 4};
    }
    case Cut::whole: break;
  }
  return {{corners[0], corners[1], corners[2]}, 3};
}

glm::vec2 centre_above(const std::array<glm::vec3, 3>& corners) {
  const glm::vec3 u = corners[1] - corners[0];
  const glm::vec3 v = corners[2] - corners[0];
  const float uu = glm::dot(u, u);
  const float vv = glm::dot(v, v);
  const float uv = glm::dot(u, v);
  const float det = uu * vv - uv * uv;
  if (!(det > 0.0F)) return {0.0F, 0.0F};
  const float pu = -glm::dot(corners[0], u);
  const float pv = -glm::dot(corners[0], v);
  return {(vv * pu - uv * pv) / det, (uu * pv - uv * pu) / det};
}

// A little more than the corners themselves need does no harm, nor does what is well below the largest.
bool TriangleCarrier::is_enough(float squared, float own) const {
  return squared <= std::max(1.002F * own, 0.6F * std::max(lower_, usual_));
}

float TriangleCarrier::bound(const Piece& piece, std::uint32_t face) const {
  const auto& p = piece.points;
  float squared = largest4(star_->squared(four(p[0], p[1], p[2], piece.count > 3 ? p[3] : p[0]), face));
  if (piece.count > 4) squared = std::max(squared, star_->squared(four(p[4], p[4], p[4], p[4]), face)[0]);
  return squared;
}

float TriangleCarrier::carry(CarriedTriangle& triangle, TriangleInStar& at) const {
  return at.all_inside ? carry_all(triangle, at) : carry_pieces(triangle, at);
}

// The pieces stay as they are as long as one is elsewhere.
float TriangleCarrier::carry_pieces(const CarriedTriangle& triangle, TriangleInStar& at) const {
  float worst = 0.0F;
  for (int p = 0; p < triangle.piece_count(); ++p) {
    if (!at.inside[p]) continue;
    const Piece piece = piece_of(triangle, at.points, p);
    std::uint32_t chosen = 0;
    float best = std::numeric_limits<float>::infinity();
    for (int c = 0; c < 3; ++c) {
      if (triangle.piece_of_corner(c) != p) continue;
      chosen = at.nearest[c];
      best = bound(piece, chosen);
      break;
    }
    for (std::uint32_t face = 0; face < star_->count() && best > good_; ++face) {
      const float squared = bound(piece, face);
      if (squared >= best) continue;
      best = squared;
      chosen = face;
    }
    at.faces[p] = chosen;
    worst = std::max(worst, best);
  }
  return worst;
}

float TriangleCarrier::carry_all(CarriedTriangle& triangle, TriangleInStar& at) const {
  const float own = std::max({at.squared[0], at.squared[1], at.squared[2]});
  float best = std::numeric_limits<float>::infinity();
  for (std::uint32_t f = 0; f < star_->count(); ++f) {
    const float squared = std::max({at.distances[0][f], at.distances[1][f], at.distances[2][f]});
    if (squared >= best) continue;
    best = squared;
    at.faces[0] = f;
  }
  triangle.cut = Cut::whole;
  if (is_enough(best, own)) return best;
  CarriedTriangle cut = triangle;
  const auto take = [&](float squared, const std::array<std::uint32_t, 3>& faces) {
    if (squared >= best) return;
    best = squared;
    triangle = cut;
    at.faces = faces;
  };
  const auto offer = [&](const std::array<std::uint32_t, 3>& faces) {
    float squared = 0.0F;
    for (int p = 0; p < cut.piece_count() && squared < best; ++p) {
      squared = std::max(squared, bound(piece_of(cut, at.points, p), faces[p]));
    }
    take(squared, faces);
  };
  Choice beside;
  if (choose_beside(at, beside)) {
    cut_strip(cut, at, beside);
    take(strip_bound(at, beside, cut), beside.faces);
    if (best <= good_) return best;
  }
  const Choices choices = choose(at);
  if (choices.strip.expected < best) {
    cut_strip(cut, at, choices.strip);
    take(strip_bound(at, choices.strip, cut), choices.strip.faces);
  }
  if (best > good_ && choices.middle.expected < best) {
    cut_middle(cut, at, choices.middle);
    offer(choices.middle.faces);
  }
  if (best > good_ && choices.strips.expected < best) {
    cut_strips(cut, at, choices.strips);
    offer(choices.strips.faces);
  }
  const auto& n = at.nearest;
  if (best > good_ && n[0] != n[1] && n[1] != n[2] && n[2] != n[0]) {
    cut_at_centre(cut, at);
    offer(at.nearest);
  }
  return best;
}

// Whether two corners are nearest to one face and the third to one beside it.
bool TriangleCarrier::choose_beside(const TriangleInStar& at, Choice& strip) const {
  const auto& n = at.nearest;
  const int k = n[1] == n[2] ? 0 : n[2] == n[0] ? 1 : n[0] == n[1] ? 2 : 3;
  if (k == 3) return false;
  const std::uint32_t pair = n[next(k)];
  if (star_->after(n[k]) != pair && star_->before(n[k]) != pair) return false;
  strip = {std::max({at.squared[0], at.squared[1], at.squared[2]}), k, {n[k], pair, pair}};
  return true;
}

// The corners' distances are known: what is left is where the cut meets the edges.
float TriangleCarrier::strip_bound(const TriangleInStar& at, const Choice& choice, const CarriedTriangle& cut) const {
  const glm::vec3& k = at.points[choice.first];
  const glm::vec3 to_i = between(k, at.points[next(choice.first)], share_of(cut.shares[0]));
  const glm::vec3 to_j = between(k, at.points[before(choice.first)], share_of(cut.shares[1]));
  return std::max(choice.expected,
                  largest4(star_->squared(four(to_i, to_j, to_i, to_j), choice.faces[0], choice.faces[1])));
}

// Which corners might lie on which faces that follow each other.
TriangleCarrier::Choices TriangleCarrier::choose(const TriangleInStar& at) const {
  Choices choices;
  const auto offer = [](Choice& choice, float expected, int first, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (expected < choice.expected) choice = {expected, first, {a, b, c}};
  };
  for (std::uint32_t f = 0; f < star_->count(); ++f) {
    const std::uint32_t g = star_->after(f);
    if (g == StarDistance::kNoFace) continue;
    const std::uint32_t h = star_->after(g);
    const bool three = h != StarDistance::kNoFace && h != f;
    for (int k = 0; k < 3; ++k) {
      const float* to_k = at.distances[k];
      const float* to_i = at.distances[next(k)];
      const float* to_j = at.distances[before(k)];
      const float pair_g = std::max(to_i[g], to_j[g]);
      const float pair_f = std::max(to_i[f], to_j[f]);
      offer(choices.strip, std::max(to_k[f], pair_g), k, f, g, g);
      offer(choices.strip, std::max(to_k[g], pair_f), k, g, f, f);
      if (!three) continue;
      offer(choices.strips, std::max({to_k[f], to_i[h], to_j[h]}), k, f, g, h);
      offer(choices.strips, std::max(to_k[h], pair_f), k, h, g, f);
      offer(choices.middle, std::max({to_i[f], to_k[g], to_j[h]}), k, f, g, h);
      offer(choices.middle, std::max({to_i[h], to_k[g], to_j[f]}), k, h, g, f);
    }
  }
  return choices;
}

// Where a line from one face to one beside it passes between them.
float TriangleCarrier::share_between(const glm::vec3& from, const glm::vec3& to, std::uint32_t face_from,
                                     std::uint32_t face_to) const {
  const bool forwards = star_->after(face_from) == face_to;
  const std::uint32_t face = forwards ? face_from : face_to;
  float a = star_->side(from, face);
  float b = star_->side(to, face);
  if (forwards) {
    a = -a;
    b = -b;
  }
  if (!(a > 0.0F)) return 0.0F;
  if (!(b < 0.0F)) return 1.0F;
  return a / (a - b);
}

void TriangleCarrier::cut_strip(CarriedTriangle& cut, const TriangleInStar& at, const Choice& choice) const {
  const glm::vec3& k = at.points[choice.first];
  cut.cut = Cut::strip;
  cut.first = static_cast<std::uint8_t>(choice.first);
  cut.shares[0] = share_code(share_between(k, at.points[next(choice.first)], choice.faces[0], choice.faces[1]));
  cut.shares[1] = share_code(share_between(k, at.points[before(choice.first)], choice.faces[0], choice.faces[1]));
}

void TriangleCarrier::cut_strips(CarriedTriangle& cut, const TriangleInStar& at, const Choice& choice) const {
  cut_strip(cut, at, choice);
  const glm::vec3& k = at.points[choice.first];
  cut.cut = Cut::strips;
  const float to_i = share_between(k, at.points[next(choice.first)], choice.faces[1], choice.faces[2]);
  const float to_j = share_between(k, at.points[before(choice.first)], choice.faces[1], choice.faces[2]);
  cut.shares[2] = std::max(cut.shares[0], share_code(to_i));
  cut.shares[3] = std::max(cut.shares[1], share_code(to_j));
}

void TriangleCarrier::cut_middle(CarriedTriangle& cut, const TriangleInStar& at, const Choice& choice) const {
  const glm::vec3& k = at.points[choice.first];
  const glm::vec3& i = at.points[next(choice.first)];
  const glm::vec3& j = at.points[before(choice.first)];
  cut.cut = Cut::middle;
  cut.first = static_cast<std::uint8_t>(choice.first);
  cut.shares[0] = share_code(share_between(k, i, choice.faces[1], choice.faces[0]));
  cut.shares[1] = share_code(share_between(k, j, choice.faces[1], choice.faces[2]));
  cut.shares[2] = share_code(share_between(i, j, choice.faces[0], choice.faces[1]));
  cut.shares[3] = std::max(cut.shares[2], share_code(share_between(i, j, choice.faces[1], choice.faces[2])));
}

// The three corners on faces of their own around the star's centre.
void TriangleCarrier::cut_at_centre(CarriedTriangle& cut, const TriangleInStar& at) const {
  cut.cut = Cut::centre;
  cut.first = 0;
  for (int c = 0; c < 3; ++c) {
    const std::uint32_t from = at.nearest[c];
    const std::uint32_t to = at.nearest[next(c)];
    const bool beside = star_->after(from) == to || star_->before(from) == to;
    cut.shares[c] = share_code(beside ? share_between(at.points[c], at.points[next(c)], from, to) : 0.5F);
  }
  glm::vec2 inside = glm::max(centre_above(at.points), glm::vec2(0.0F));
  const float sum = inside.x + inside.y;
  if (sum > 1.0F) inside = inside / sum;
  cut.shares[3] = share_code(inside.x);
  // Rounding must not lead out of the triangle.
  cut.shares[4] = std::min(share_code(inside.y), static_cast<std::uint16_t>(65535 - cut.shares[3]));
}

}  // namespace fanstream
