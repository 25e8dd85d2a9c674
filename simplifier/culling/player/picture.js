// WebGL: all parts and occluders of a walk, each in a colour and as solid as it is told.

const VERTEX = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
layout(location = 0) in vec3 place;
layout(location = 1) in uint item;
uniform sampler2D boxes;
uniform sampler2D states;
uniform vec3 eye;
uniform mat4 view;
uniform vec2 solid;
out vec3 toEye;
out vec4 colour;
void main() {
  int at = int(item);
  int wide = textureSize(states, 0).x;
  colour = texelFetch(states, ivec2(at % wide, at / wide), 0);
  vec3 low = texelFetch(boxes, ivec2(at % wide, 2 * (at / wide)), 0).xyz;
  vec3 size = texelFetch(boxes, ivec2(at % wide, 2 * (at / wide) + 1), 0).xyz;
  toEye = low + size * place - eye;
  gl_Position = colour.a > solid.x && colour.a <= solid.y ? view * vec4(toEye, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec3 toEye;
in vec4 colour;
uniform vec3 eye;
uniform vec3 light;
uniform vec4 cut;
out vec4 painted;
void main() {
  if (dot(toEye + eye, cut.xyz) > cut.w) discard;
  vec3 normal = normalize(cross(dFdx(toEye), dFdy(toEye)));
  if (dot(normal, toEye) > 0.0) normal = -normal;
  float shade = 0.62 + 0.28 * dot(normal, light) + 0.14 * abs(dot(normal, normalize(toEye)));
  painted = vec4(colour.rgb * shade, colour.a);
}`;

const LINE_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 place;
uniform vec3 eye;
uniform mat4 view;
void main() { gl_Position = view * vec4(place - eye, 1.0); }`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 ink;
out vec4 painted;
void main() { painted = ink; }`;

const WIDE = 1024; // of the textures: what one cannot be wider than is 2048 at least

export class Picture {
  constructor(canvas, walk) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("this browser draws no 3D: WebGL 2 is switched off or missing");
    this.gl = gl;
    this.items = walk.counts.length / 2;
    this.high = Math.ceil(this.items / WIDE);
    this.program = link(gl, VERTEX, FRAGMENT);
    this.lines = link(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.load(walk);
    this.ink = gl.createBuffer();
    this.inkArray = gl.createVertexArray();
    gl.bindVertexArray(this.inkArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.ink);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.SCISSOR_TEST);
  }

  load({ counts, positions, indices, boxes }) {
    const { gl } = this;
    const vertices = positions.length / 3;
    const item = new Uint32Array(vertices);
    const corners = Uint32Array.from(indices);
    let [vertex, corner] = [0, 0];
    for (let at = 0; at < this.items; at += 1) {
      item.fill(at, vertex, vertex + counts[2 * at]);
      const end = corner + 3 * counts[2 * at + 1];
      for (; corner < end; corner += 1) corners[corner] += vertex;
      vertex += counts[2 * at];
    }
    this.corners = corner;
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, positions, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, true, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, item, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribIPointer(1, 1, gl.UNSIGNED_INT, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    const texels = new Float32Array(2 * WIDE * this.high * 4);
    for (let at = 0; at < this.items; at += 1)
      for (let half = 0; half < 2; half += 1)
        for (let axis = 0; axis < 3; axis += 1)
          texels[4 * ((2 * Math.floor(at / WIDE) + half) * WIDE + (at % WIDE)) + axis] =
            boxes[6 * at + 3 * half + axis];
    this.boxes = texture(gl);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, WIDE, 2 * this.high, 0, gl.RGBA, gl.FLOAT, texels);
    this.states = texture(gl);
    this.bytes = new Uint8Array(WIDE * this.high * 4);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, WIDE, this.high, 0, gl.RGBA, gl.UNSIGNED_BYTE, this.bytes);
  }

  // Begin a view in a rectangle of the canvas, pixels from below.
  begin([x, y, wide, high], sky) {
    const { gl } = this;
    gl.viewport(x, y, wide, high);
    gl.scissor(x, y, wide, high);
    gl.clearColor(...sky);
    gl.depthMask(true);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  // All items; this.bytes has their colours and how solid each is.  `through`: what is seen through
  // shows even behind what is solid.
  draw({ eye, view, light, cut }, through) {
    const { gl, program } = this;
    gl.useProgram(program.program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.boxes);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.states);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDE, this.high, gl.RGBA, gl.UNSIGNED_BYTE, this.bytes);
    gl.uniform1i(program.at("boxes"), 0);
    gl.uniform1i(program.at("states"), 1);
    gl.uniform3fv(program.at("eye"), eye);
    gl.uniform3fv(program.at("light"), light);
    gl.uniform4fv(program.at("cut"), cut);
    gl.uniformMatrix4fv(program.at("view"), false, view);
    gl.bindVertexArray(this.array);
    gl.uniform2f(program.at("solid"), 0.99, 1.5);
    gl.drawElements(gl.TRIANGLES, this.corners, gl.UNSIGNED_INT, 0);
    gl.depthMask(false);
    if (through) gl.disable(gl.DEPTH_TEST);
    gl.uniform2f(program.at("solid"), 0.01, 0.99);
    gl.drawElements(gl.TRIANGLES, this.corners, gl.UNSIGNED_INT, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
  }

  // Over all that is there: points (n, 3) as "LINES", "LINE_STRIP" or "TRIANGLES".
  mark({ eye, view }, points, kind, ink) {
    const { gl, lines } = this;
    gl.useProgram(lines.program);
    gl.disable(gl.DEPTH_TEST);
    gl.uniform3fv(lines.at("eye"), eye);
    gl.uniformMatrix4fv(lines.at("view"), false, view);
    gl.uniform4fv(lines.at("ink"), ink);
    gl.bindVertexArray(this.inkArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.ink);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points), gl.DYNAMIC_DRAW);
    gl.drawArrays(gl[kind], 0, points.length / 3);
  }

  dispose() {
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}

function texture(gl) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
    gl.texParameteri(gl.TEXTURE_2D, which, gl.NEAREST);
  return made;
}

function link(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost())
    throw new Error(`the graphics card refuses: ${gl.getProgramInfoLog(program)}`);
  const places = new Map();
  const at = (name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(program, name));
    return places.get(name);
  };
  return { program, at };
}
