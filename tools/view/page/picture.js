// Draws the body with WebGL 2. A first pass sums the modes for every point and writes the positions into a texture;
// lines and triangles read the positions of their ends from it.
import { multiply, rigid } from "./camera.js";
import { NO_LOAD, rotation } from "./motion.js";

const HEAD = "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2DArray;\n" +
  "precision highp usampler2D;\n";

const SUM_VERTEX = HEAD + `
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;
const SUM_FRAGMENT = HEAD + `
uniform sampler2D rest, amplitudes;
uniform sampler2DArray shapes;
uniform int modes;
uniform float factor;
out vec4 position;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 V = vec3(0.0);
  for (int l = 0; l < modes; ++l)
    V += texelFetch(amplitudes, ivec2(l, 0), 0).x * texelFetch(shapes, ivec3(at, l), 0).xyz;
  position = vec4(texelFetch(rest, at, 0).xyz + factor * V, 1.0);
}`;

// blue for compression, grey for zero, red for tension; dark grey where the load is unknown
const COLOUR = `
vec3 colour_of(uint link) {
  if (!is_coloured) return plain;
  float value = texelFetch(figures, ivec2(int(link) % figures_width, int(link) / figures_width), 0).x;
  if (!(abs(value) < 3e38)) return plain * 0.6;
  float ratio = clamp(value, -1.0, 1.0);
  vec3 end = ratio < 0.0 ? vec3(0.25, 0.55, 1.0) : vec3(1.0, 0.35, 0.25);
  return mix(vec3(0.75), end, sqrt(abs(ratio)));
}`;
const POSITIONS = `
uniform sampler2D positions, figures;
uniform usampler2D items;
uniform int positions_width, items_width, figures_width;
uniform bool is_coloured;
uniform vec3 plain;
uniform mat4 camera;
vec3 position_of(uint point) {
  return texelFetch(positions, ivec2(int(point) % positions_width, int(point) / positions_width), 0).xyz;
}
uvec4 item_of(int k) { return texelFetch(items, ivec2(k % items_width, k / items_width), 0); }
` + COLOUR;
const LINE_VERTEX = HEAD + POSITIONS + `
out vec3 colour;
void main() {
  uvec4 line = item_of(gl_VertexID >> 1);
  colour = colour_of(line.z);
  gl_Position = camera * vec4(position_of((gl_VertexID & 1) == 0 ? line.x : line.y), 1.0);
}`;
const TRIANGLE_VERTEX = HEAD + POSITIONS + `
uniform vec3 light;
out vec3 colour;
void main() {
  uvec4 corners = item_of(gl_VertexID / 3);
  vec3 a = position_of(corners.x), b = position_of(corners.y), c = position_of(corners.z);
  vec3 normal = normalize(cross(b - a, c - a));
  colour = colour_of(corners.w) * (0.35 + 0.65 * abs(dot(normal, light)));
  int k = gl_VertexID % 3;
  gl_Position = camera * vec4(k == 0 ? a : k == 1 ? b : c, 1.0);
}`;
const POINT_VERTEX = HEAD + POSITIONS + `
uniform float pixels;
out vec3 colour;
void main() {
  colour = plain;
  gl_PointSize = pixels;
  gl_Position = camera * vec4(position_of(uint(gl_VertexID)), 1.0);
}`;
const PLAIN_VERTEX = HEAD + `
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 tint;
uniform mat4 camera;
out vec3 colour;
void main() { colour = tint; gl_Position = camera * vec4(position, 1.0); }`;
const FRAGMENT = HEAD + `
in vec3 colour;
uniform float opacity;
out vec4 result;
void main() { result = vec4(colour, opacity); }`;

/** If a body has more points than this, they are not drawn as dots. */
const MOST_DOTS = 20000;

export class Picture {
  /** Throws if the browser has no WebGL 2, or if WebGL cannot write floats. */
  constructor(canvas, body) {
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL 2; use another browser");
    if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("this browser's WebGL cannot write floats; use another browser");
    this.gl = gl;
    this.canvas = canvas;
    this.body = body;
    this.modes = Math.min(body.modes, gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS));
    this.width = Math.ceil(Math.sqrt(body.points));
    this.height = Math.ceil(body.points / this.width);
    this.programs = {
      sum: this.program(SUM_VERTEX, SUM_FRAGMENT), lines: this.program(LINE_VERTEX, FRAGMENT),
      triangles: this.program(TRIANGLE_VERTEX, FRAGMENT), dots: this.program(POINT_VERTEX, FRAGMENT),
      plain: this.program(PLAIN_VERTEX, FRAGMENT),
    };
    this.empty = gl.createVertexArray();
    this.plainBuffer = gl.createBuffer();
    this.plainArray = gl.createVertexArray();
    gl.bindVertexArray(this.plainArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.plainBuffer);
    for (const [location, offset] of [[0, 0], [1, 12]]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 24, offset);
    }
    this.upload();
  }

  program(vertex, fragment) {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const locations = {};
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++k) {
      const { name } = gl.getActiveUniform(program, k);
      locations[name] = gl.getUniformLocation(program, name);
    }
    return { program, locations };
  }

  texture(format, width, height, external, type, data) {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, external, type, data);
    this.nearest(gl.TEXTURE_2D);
    return texture;
  }
  nearest(target) {
    const { gl } = this;
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, filter, gl.NEAREST);
  }

  upload() {
    const { gl, body, width, height } = this;
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    const padded = new Float32Array(3 * width * height);
    padded.set(body.rest);
    this.rest = this.texture(gl.RGB32F, width, height, gl.RGB, gl.FLOAT, padded);
    this.shapes = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.shapes);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGB32F, width, height, Math.max(1, this.modes));
    for (let l = 0; l < this.modes; ++l) {
      padded.set(body.shapes.subarray(3 * body.points * l, 3 * body.points * (l + 1)));
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, l, width, height, 1, gl.RGB, gl.FLOAT, padded);
    }
    this.nearest(gl.TEXTURE_2D_ARRAY);
    this.amplitudes = this.texture(gl.R32F, Math.max(1, this.modes), 1, gl.RED, gl.FLOAT,
      new Float32Array(Math.max(1, this.modes)));
    this.positions = this.texture(gl.RGBA32F, width, height, gl.RGBA, gl.FLOAT, null);
    this.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.positions, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);

    const items = (ends, links, of) => {
      const count = links.length, wide = Math.max(1, Math.ceil(Math.sqrt(count)));
      const data = new Uint32Array(4 * wide * Math.max(1, Math.ceil(count / wide)));
      for (let k = 0; k < count; ++k) {
        for (let end = 0; end < of; ++end) data[4 * k + end] = ends[of * k + end];
        data[4 * k + of] = links[k];
      }
      return { count, width: wide,
        texture: this.texture(gl.RGBA32UI, wide, data.length / 4 / wide, gl.RGBA_INTEGER, gl.UNSIGNED_INT, data) };
    };
    this.lines = items(body.lines, body.lineLinks, 2);
    this.triangles = items(body.triangles, body.triangleLinks, 3);

    const links = 1 + Math.max(-1, ...[body.lineLinks, body.triangleLinks].map((all) =>
      all.reduce((most, link) => Math.max(most, link), -1)));
    this.figuresWidth = Math.max(1, Math.ceil(Math.sqrt(links)));
    this.figures = new Float32Array(this.figuresWidth * Math.max(1, Math.ceil(links / this.figuresWidth)));
    this.figuresTexture = this.texture(gl.R32F, this.figuresWidth, this.figures.length / this.figuresWidth, gl.RED,
      gl.FLOAT, this.figures);
    this.isColoured = false;
    /** Largest load so far for each unit, so that colours are comparable over time. */
    this.loadScales = new Map();
  }

  /** Sets the loads of the published links, in the order of the links; null: no colours. Each unit has its own scale. */
  setLoads(values) {
    const { gl, body } = this;
    this.isColoured = !!values;
    this.figures.fill(Infinity);
    if (values) {
      body.loadUnits.forEach((unit, k) =>
        this.loadScales.set(unit, Math.max(this.loadScales.get(unit) ?? 0, Number.isFinite(values[k]) ? Math.abs(values[k]) : 0)));
      body.publishedLinks.forEach((link, k) => {
        this.figures[link] = values[k] / Math.max(this.loadScales.get(body.loadUnits[k]), NO_LOAD * body.mass);
      });
    }
    gl.bindTexture(gl.TEXTURE_2D, this.figuresTexture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, this.figuresWidth, this.figures.length / this.figuresWidth, gl.RED,
      gl.FLOAT, this.figures);
  }

  bind(unit, target, texture, location) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(target, texture);
    gl.uniform1i(location, unit);
  }

  sum(q, factor) {
    const { gl } = this, { program, locations } = this.programs.sum;
    gl.bindTexture(gl.TEXTURE_2D, this.amplitudes);
    if (this.modes > 0)
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, this.modes, 1, gl.RED, gl.FLOAT, Float32Array.from(q).subarray(0, this.modes));
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.viewport(0, 0, this.width, this.height);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.useProgram(program);
    this.bind(0, gl.TEXTURE_2D, this.rest, locations.rest);
    this.bind(1, gl.TEXTURE_2D, this.amplitudes, locations.amplitudes);
    this.bind(2, gl.TEXTURE_2D_ARRAY, this.shapes, locations.shapes);
    gl.uniform1i(locations.modes, this.modes);
    gl.uniform1f(locations.factor, factor);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  items(name, texture, item, mode, count, camera, plain, opacity, isColoured, more = (_) => {}) {
    const { gl } = this, { program, locations } = this.programs[name];
    if (count === 0) return;
    gl.useProgram(program);
    this.bind(0, gl.TEXTURE_2D, texture, locations.positions);
    if (item) this.bind(1, gl.TEXTURE_2D, item.texture, locations.items);
    this.bind(2, gl.TEXTURE_2D, this.figuresTexture, locations.figures);
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(locations.positions_width, this.width);
    if (item) gl.uniform1i(locations.items_width, item.width);
    gl.uniform1i(locations.figures_width, this.figuresWidth);
    gl.uniform1i(locations.is_coloured, isColoured && this.isColoured ? 1 : 0);
    gl.uniform3fv(locations.plain, plain);
    gl.uniformMatrix4fv(locations.camera, false, Float32Array.from(camera));
    gl.uniform1f(locations.opacity, opacity);
    more(locations);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(mode, 0, count);
  }

  /** Draws coloured line segments; positions are in world axes, relative to the target: [x, y, z, r, g, b, ...]. */
  plain(vertices, camera, mode, opacity = 1) {
    const { gl } = this, { program, locations } = this.programs.plain;
    gl.useProgram(program);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.plainBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, Float32Array.from(vertices), gl.DYNAMIC_DRAW);
    gl.uniformMatrix4fv(locations.camera, false, Float32Array.from(camera));
    gl.uniform1f(locations.opacity, opacity);
    gl.bindVertexArray(this.plainArray);
    gl.drawArrays(mode, 0, vertices.length / 6);
  }

  /**
   * Draws one frame. `target`: the position in the world that the camera looks at. `extras`: additional lines, passed to
   * plain(). Returns the matrix from world axes, with the target at the origin, to clip coordinates.
   */
  draw(frame, { camera, factor, target, ghost, extras = [], trail = [] }) {
    const { gl, canvas } = this;
    this.sum(frame.q, factor);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0.07, 0.08, 0.1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    const world = camera.matrix(canvas.width, canvas.height);
    const R = rotation(frame.attitude);
    const about = frame.position.map((x, axis) => x - target[axis]);
    const whole = multiply(world, rigid(R, about));
    // direction of the light, which comes from the eye, in body axes
    const { back } = camera.axes();
    const light = [0, 1, 2].map((k) => R[0][k] * back[0] + R[1][k] * back[1] + R[2][k] * back[2]);
    this.items("triangles", this.positions, this.triangles, gl.TRIANGLES, 3 * this.triangles.count, whole,
      [0.55, 0.65, 0.75], 1, true, (locations) => gl.uniform3fv(locations.light, light));
    this.items("lines", this.positions, this.lines, gl.LINES, 2 * this.lines.count, whole, [0.85, 0.87, 0.9], 1, true);
    if (this.body.points <= MOST_DOTS)
      this.items("dots", this.positions, null, gl.POINTS, this.body.points, whole, [1, 0.8, 0.35], 1, false,
        (locations) => gl.uniform1f(locations.pixels, this.body.points > 2000 ? 2 : 5));
    if (ghost)
      this.items("lines", this.rest, this.lines, gl.LINES, 2 * this.lines.count, whole, [0.6, 0.6, 0.7], 0.3, false);
    if (trail.length > 6) this.plain(trail, world, gl.LINE_STRIP, 0.8);
    if (extras.length > 0) this.plain(extras, world, gl.LINES);
    return world;
  }
}
