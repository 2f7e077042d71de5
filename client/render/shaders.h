// The GLSL programs of OffscreenRenderer. Positions and normals are in eye coordinates: x right, y up, z towards the
// eye.
#pragma once

namespace fanstream::shaders {

inline constexpr const char* kSurfaceVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
uniform mat4 view;
uniform mat4 projection;
out vec3 eye_position;
centroid out vec3 eye_normal;
void main() {
  vec4 p = view * vec4(position, 1.0);
  eye_position = p.xyz;
  eye_normal = mat3(view) * normal;
  gl_Position = projection * p;
}
)";

// The facet's normal comes from the screen derivatives of the position, so that fans can share vertices between facets;
// it always faces the eye. An interpolated normal shorter than 1 leaves the rest to the facet: all of it at a vertex
// without a normal.
inline constexpr const char* kSurfaceFragment = R"(#version 330 core
in vec3 eye_position;
centroid in vec3 eye_normal;
uniform vec3 color;
uniform float smoothness;
out vec4 result;

vec3 shading_normal(vec3 to_eye) {
  vec3 facet = cross(dFdx(eye_position), dFdy(eye_position));
  float area = length(facet);
  facet = area > 0.0 ? facet / area : to_eye;
  vec3 n = smoothness * (gl_FrontFacing ? eye_normal : -eye_normal);
  n = normalize(n + max(0.0, 1.0 - length(n)) * facet + 1e-6 * facet);
  float away = dot(n, to_eye);
  return away < 0.0 ? normalize(n - 1.01 * away * to_eye) : n;  // seen, so it cannot point away from the eye
}

void main() {
  const vec3 key = normalize(vec3(-0.50, 0.68, 0.60));
  const vec3 fill = normalize(vec3(0.85, 0.05, 0.45));
  vec3 to_eye = normalize(-eye_position);
  vec3 n = shading_normal(to_eye);
  vec3 light = mix(vec3(0.080, 0.074, 0.070), vec3(0.200, 0.215, 0.240), 0.5 + 0.5 * n.y);
  light += vec3(0.960, 0.925, 0.870) * max(0.0, dot(n, key));
  light += vec3(0.105, 0.120, 0.145) * max(0.0, dot(n, fill));
  light += vec3(0.150) * max(0.0, dot(n, to_eye));
  vec3 surface = pow(color, vec3(2.2)) * (gl_FrontFacing ? vec3(1.0) : vec3(0.62, 0.64, 0.70));
  float shine = 0.10 * pow(max(0.0, dot(n, normalize(key + to_eye))), 48.0);
  result = vec4(pow(min(vec3(1.0), surface * light + shine), vec3(1.0 / 2.2)), 1.0);
}
)";

// One triangle over the whole picture, without vertex data.
inline constexpr const char* kBackgroundVertex = R"(#version 330 core
out float height;
void main() {
  vec2 p = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  height = 0.5 + 0.5 * p.y;
  gl_Position = vec4(p, 0.0, 1.0);
}
)";

inline constexpr const char* kBackgroundFragment = R"(#version 330 core
in float height;
uniform vec3 top;
uniform vec3 bottom;
out vec4 result;
void main() { result = vec4(mix(bottom, top, height), 1.0); }
)";

}  // namespace fanstream::shaders
