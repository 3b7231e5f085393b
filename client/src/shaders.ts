// How surfaces reflect light: a key light with shadows, an environment of sky, ground and soft boxes, and the light that
// the height of all bodies lets through from the sky. One short program, which software can draw too.

/** What all programs share: the environment, and how colors become those of a screen. */
const LIGHT = /* glsl */ `
uniform vec3 up, sun, back, skyColor, groundColor, sunColor;
uniform float reach;

// The light of all directions about a normal.
vec3 around(vec3 n) { return mix(groundColor, skyColor, .5 + .5 * dot(n, up)); }

// The light from one direction; rough from 0 to 1 blurs it.
vec3 environment(vec3 d, float rough) {
  float u = dot(d, up), w = .06 + .84 * rough, wide = .015 + .235 * rough, strong = 2.4 - 2.05 * rough;
  vec3 c = mix(groundColor, skyColor * (.82 + .25 * max(u, 0.)), clamp(.5 + .5 * u / w, 0., 1.));
  c += sunColor * (strong * clamp(.5 + .5 * (dot(d, sun) - .93) / wide, 0., 1.));
  return c + skyColor * (.7 * strong * clamp(.5 + .5 * (dot(d, back) - .8) / wide, 0., 1.));
}

vec3 shown(vec3 c) {
  c = c * (1. + c * .12) / (1. + c * .45);
  return sqrt(clamp(c, 0., 1.));
}
`;

/** The share of the key light at a point, and how much of a body it passes on its way there [m]. */
const SHADOW = /* glsl */ `
#ifdef SHADOWS
uniform highp sampler2D shadowMap;
uniform mat4 shadowMatrix;
vec2 shadow(vec3 p) {
  vec4 s = shadowMatrix * vec4(p, 1.);
  if (any(greaterThan(abs(s.xyz - .5), vec3(.499)))) return vec2(1., 0.);
  vec2 cell = s.xy * CELLS - .5, f = fract(cell), base = floor(cell) + .5;
  float lit = 0., sum = 0., thick = 0.;
  for (int i = -TAPS; i <= TAPS + 1; i++)
    for (int j = -TAPS; j <= TAPS + 1; j++) {
      float w = (i == -TAPS ? 1. - f.x : i == TAPS + 1 ? f.x : 1.) * (j == -TAPS ? 1. - f.y : j == TAPS + 1 ? f.y : 1.);
      float through = s.z - texture(shadowMap, (base + vec2(i, j)) / CELLS).r;
      lit += w * step(through, .0015);
      thick += w * max(through, 0.);
      sum += w;
    }
  return vec2(lit, thick * 2. * reach) / sum;
}
#else
vec2 shadow(vec3 p) { return vec2(1., .3 * reach); }
#endif
`;

/** The share of the sky that bodies around a point leave free: the map has the greatest height at each place. */
const SKY = /* glsl */ `
#ifdef SHADOWS
uniform sampler2D heightMap;
uniform mat4 heightMatrix;
const vec2 AROUND[8] = vec2[](vec2(.96, .3), vec2(.47, .88), vec2(-.3, .96), vec2(-.88, .47), vec2(-.96, -.3),
  vec2(-.47, -.88), vec2(.3, -.96), vec2(.88, -.47));
float openSky(vec3 p) {
  vec4 s = heightMatrix * vec4(p, 1.);
  float free = 0.;
  for (int i = 0; i < 8; i++) {
    float d = (i & 1) == 0 ? .03 : .09, h = max(textureLod(heightMap, s.xy + d * AROUND[i], LOD + float(i & 1)).r - s.z, 0.);
    free += d * d / (h * h + d * d);
  }
  return free / 8.;
}
#else
float openSky(vec3 p) { return .8; }
#endif
`;

export const VERTEX = /* glsl */ `
${SKY}
in float value;
in vec3 rest;
out vec3 at, facing, own, corner;
out float amount, sky;
void main() {
  vec4 p = modelMatrix * vec4(position, 1.);
  at = p.xyz;
  own = rest;
  amount = value;
  facing = mat3(modelMatrix) * normal;
  sky = mix(.3, 1., openSky(at));
#ifdef FACETS
  int k = gl_VertexID % 3;
  corner = vec3(k == 0, k == 1, k == 2);
#endif
  gl_Position = projectionMatrix * viewMatrix * p;
}
`;

/** `LOOK` is a number: 0 rubber, 1 gummy, 2 foam, 3 steel, 4 what stands still, 5 glass. */
export const SURFACE = /* glsl */ `
${LIGHT}
${SHADOW}
in vec3 at, facing, own, corner;
in float amount, sky;
uniform vec3 color;
uniform float size, opacity;
uniform sampler2D scale;
out vec4 result;

float grain(vec3 p) { // pores of foam: random points of a skew lattice
  p += .37 * p.yzx + .41;
  vec3 i = floor(p), f = fract(p) - .5;
  return smoothstep(.1, .5, length(f) + .25 * fract(sin(dot(i, vec3(12.9898, 78.233, 37.719))) * 43758.5453));
}

void main() {
  vec3 v = normalize(cameraPosition - at), base = color;
#ifdef FACETS
  vec3 n = normalize(cross(dFdx(at), dFdy(at)));
#else
  vec3 n = normalize(facing);
  if (!gl_FrontFacing) n = -n;
#endif
#ifdef FIELD
  base = texture(scale, vec2(amount / 255., .5)).rgb;
  base *= base;
#endif
  float nv = max(dot(n, v), 0.), nl = dot(n, sun), edge = (1. - nv) * (1. - nv), alpha = opacity;
  edge *= edge;
#if LOOK == 5
  vec2 s = vec2(1., 0.);
#else
  vec2 s = shadow(at + .004 * reach * n);
#endif
  vec3 r = reflect(-v, n), ambient = around(n) * sky, key = sunColor * max(nl, 0.) * s.x, c;
#if defined(FIELD)
  c = base * (.75 * ambient + .75 * key) + .02 * environment(r, .5);
#elif LOOK == 1
  // Light passes: what comes through from the light, and what is seen through, where the body is thin.
  vec3 absorb = (1.06 - base) * (3.6 / size);
  vec3 through = exp(-absorb * s.y * 1.3) * (.35 + .65 * smoothstep(-1., .6, nl));
  vec3 t = refract(-v, n, .72);
  vec3 seen = environment(t, .7) * exp(-absorb * max(-dot(t, n), .15) * .55 * size) * (base + .06);
  c = base * (.25 * ambient + .3 * key) + .36 * sunColor * base * through + .36 * seen * sky;
  c += environment(r, .08) * (.035 + .5 * edge) * mix(.25, 1., sky) * mix(.45, 1., s.x);
#elif LOOK == 2
  float pore = grain(own * (15. / size)) * mix(.6, 1., grain(own * (7. / size) + 3.1));
  c = base * mix(.5, 1., pore) * (.85 * ambient + .55 * key + .065 * sunColor * max(nl + .5, 0.));
#elif LOOK == 3
  c = base * (environment(r, .12) * mix(.3, 1., sky) * mix(.6, 1., s.x) * 1.05 + .1 * ambient + .18 * key);
  c += edge * .35 * environment(r, .2);
#elif LOOK == 4
  c = base * (.8 * ambient + .6 * key);
#elif LOOK == 5
  vec3 mirrored = min(environment(r, .6), vec3(.8)) * (.015 + .55 * edge);
  alpha = clamp(.5 * opacity + .25 * edge + .5 * mirrored.g, .01, 1.);
  c = mix(.55 * base * ambient, mirrored, clamp(mirrored.g / alpha, 0., 1.)) + mirrored;
#else
  c = base * (.75 * ambient + .8 * key) + environment(r, .45) * (.03 + .22 * edge) * sky;
#endif
#ifdef FACETS
  vec3 w = corner / max(fwidth(corner), vec3(1e-6));
  c *= mix(.55, 1., smoothstep(.3, 1.3, min(min(w.x, w.y), w.z)));
#endif
  result = vec4(shown(c), alpha);
}
`;

/** A disc, or the map of the light on it: of the key in red, of the sky in green. Bodies that move change this map. */
export const GROUND_VERTEX = /* glsl */ `
uniform float reach;
in vec3 rest;
out vec3 own, at;
out vec2 spot;
void main() {
  own = rest;
  at = (modelMatrix * vec4(position, 1.)).xyz;
  spot = rest.xy / (LIT * 2. * reach) + .5;
#ifdef MAP
  gl_Position = vec4(2. * spot - 1., 0., 1.);
#else
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.);
#endif
}
`;
export const GROUND_MAP = /* glsl */ `
${LIGHT}
${SHADOW}
${SKY}
in vec3 at;
out vec4 result;
void main() { result = vec4(shadow(at + .004 * reach * up).x, openSky(at), 0., 1.); }
`;

/** The disc has lines, and fades into the background. */
export const GROUND = /* glsl */ `
${LIGHT}
in vec3 own;
in vec2 spot;
uniform vec3 color;
uniform float cell;
uniform sampler2D groundMap;
out vec4 result;
void main() {
  vec2 place = own.xy / cell, width = max(fwidth(place), vec2(1e-5)), light = vec2(1.);
  vec2 off = abs(fract(place - .5) - .5) / width;
  float line = (1. - smoothstep(.4, 1.4, min(off.x, off.y))) * .09 * min(1., .25 / max(width.x, width.y));
#ifdef SHADOWS
  light = texture(groundMap, spot).rg;
#endif
  vec3 c = color * (1. - line) * (.72 * mix(.1, 1., light.g) * skyColor + .42 * sunColor * light.r);
  result = vec4(shown(c), 1. - smoothstep(1.6, 4.6, length(own.xy) / reach));
}
`;

/** Depth alone, for the map of shadows; and the height, for that of the sky. */
export const MAP_VERTEX = /* glsl */ `
out float height;
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.);
  height = .5 - .5 * gl_Position.z;
}
`;
export const MAP = /* glsl */ `
in float height;
out vec4 result;
void main() { result = vec4(height, 0., 0., 1.); }
`;
