// A walk, played: through the camera and from above, what is hidden fading as it is culled.
//
// The element that it is given holds everything; it needs nothing else of its page but, if it has
// them, the colours --text, --quiet, --surface, --raised, --line, --edge, --accent, --focus.

import { along, cameraAt, cross, dot, readWalk, unit } from "./walk_file.js";
import { Picture } from "./picture.js";

const [ABSENT, SEEN, CULLED, MISSED, WRONG, LOST] = [0, 1, 2, 3, 4, 5];
const SECONDS_A_FRAME = 0.6;
const FADE = 0.35; // seconds
const NARROW = 700; // pixels; below, the views stand above each other
const ELEVATION = (52 / 180) * Math.PI;
const STEP = Math.PI / 18;
const FIELD = 40; // degrees, of the view from above
const SPEEDS = [0.5, 1, 2, 4];
const STILL = 300; // milliseconds without a change after which it is told

const COLOURS = {
  [ABSENT]: [201, 204, 204],
  [SEEN]: [110, 178, 122],
  [CULLED]: [46, 104, 190],
  [MISSED]: [242, 150, 22],
  [WRONG]: [200, 0, 40],
  [LOST]: [200, 0, 40],
};
const GHOST = 0.2; // how solid what is culled stays, seen from above
const THROUGH = 0.07; // through walls many stand behind each other
const OCCLUDER = [255, 208, 0];
const OVERLAY = 0.3;
const WALLS = [[176, 190, 205], [205, 197, 176], [170, 192, 178], [196, 186, 202], [214, 203, 190]];
const SKY = [0.86, 0.91, 0.96, 1];

const LEGEND = [
  ["Visible", SEEN], ["Hidden and found: not drawn", CULLED],
  ["Hidden but missed: drawn needlessly", MISSED], ["Visible but culled: wrong", WRONG],
  ["Out of view", ABSENT],
];

const STYLE = `
.walk { display: flex; flex-direction: column; gap: 10px; color: var(--text, #17202b); }
.walk-stage { position: relative; border: 1px solid var(--line, #d3d9e1); border-radius: 4px;
  overflow: hidden; background: var(--raised, #eef1f5); }
.walk-stage canvas { display: block; width: 100%; touch-action: pan-y; }
.walk-stage canvas:focus-visible { outline: 2px solid var(--focus, #0b5cad); outline-offset: -2px; }
.walk-name { position: absolute; padding: 2px 8px; background: #26303b; color: #fff;
  font-size: 12px; border-radius: 0 0 4px 0; pointer-events: none; }
.walk-controls, .walk-switches, .walk-legend { display: flex; flex-wrap: wrap; gap: 6px 14px;
  align-items: center; margin: 0; padding: 0; list-style: none; }
.walk-controls button { font: inherit; min-height: 36px; padding: 4px 12px; cursor: pointer;
  color: var(--text, #17202b); background: var(--raised, #eef1f5);
  border: 1px solid var(--edge, #7b8796); border-radius: 4px; }
.walk-controls .walk-play { min-width: 84px; font-weight: 600; color: var(--on-accent, #fff);
  background: var(--accent, #0b5cad); border-color: var(--accent, #0b5cad); }
.walk-controls select { font: inherit; min-height: 36px; color: inherit;
  background: var(--surface, #fff); border: 1px solid var(--edge, #7b8796); border-radius: 4px; }
.walk-scrubber { flex: 1 1 200px; min-width: 140px; accent-color: var(--accent, #0b5cad); height: 32px; }
.walk-switches label { display: flex; gap: 6px; align-items: center; min-height: 28px; }
.walk-switches input { width: 18px; height: 18px; accent-color: var(--accent, #0b5cad); }
.walk-figures { display: flex; flex-wrap: wrap; gap: 4px 22px; margin: 0; }
.walk-figures dt { color: var(--quiet, #4d5a6a); font-size: 12px; }
.walk-figures dd { margin: 0; font-size: 18px; font-variant-numeric: tabular-nums; min-width: 3.2em; }
.walk-bar { display: flex; height: 12px; border-radius: 3px; overflow: hidden;
  background: var(--raised, #eef1f5); border: 1px solid var(--line, #d3d9e1); }
.walk-legend { font-size: 13px; }
.walk-legend li { display: flex; gap: 6px; align-items: center; }
.walk-swatch { width: 13px; height: 13px; border: 1px solid var(--edge, #7b8796); border-radius: 2px; }
.walk-note { margin: 0; color: var(--quiet, #4d5a6a); font-size: 13px; }
`;

export class WalkPlayer {
  // `kept` is what `changed` was told earlier, by which the walk is shown as it was then: texts by
  // the names frame, speed, shows and above.
  constructor(host, { kept = {}, changed = () => {} } = {}) {
    this.host = host;
    this.kept = kept;
    this.changed = changed;
    this.time = 0;
    this.playing = false;
    this.speed = 1;
    this.around = 0;
    this.zoom = 1;
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    this.options = { occluders: false, through: false, cut: false };
  }

  // Read it and show its first frame.  Raises what cannot be read or shown.
  async open(stream) {
    this.walk = await readWalk(stream);
    this.options.cut = this.walk.path === "inside";
    this.recall();
    this.lift = [0, 0, 0];
    this.lift[this.walk.up] = this.walk.upward;
    this.count = this.walk.parts + this.walk.occluders;
    // Each item's fate fades into the next: [from, to] and how far along.
    this.colours = new Float32Array(4 * this.count);
    this.eyes = new Float32Array(this.count);
    this.reach = reachOf(this.walk);
    this.build();
    this.picture = new Picture(this.canvas, this.walk);
    this.watcher = new ResizeObserver(() => this.invalidate());
    this.watcher.observe(this.stage);
    this.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.picture = new Picture(this.canvas, this.walk);
      this.invalidate();
    });
    this.settle(1);
    this.tell();
    this.invalidate();
    this.change();
  }

  // Anybody may have written what is kept: what it cannot be is left as it begins.
  recall() {
    const { frame, speed, shows, above } = this.kept;
    if (Number(frame) >= 1) this.time = Math.min(Math.round(Number(frame)), this.walk.frames) - 1;
    if (SPEEDS.includes(Number(speed))) this.speed = Number(speed);
    const shown = shows?.split(",") ?? [];
    for (const name of Object.keys(this.options)) {
      if (shown.includes(name)) this.options[name] = true;
      if (shown.includes(`no ${name}`)) this.options[name] = false;
    }
    const [around, zoom] = above?.split(",").map(Number) ?? [];
    if (Number.isFinite(around) && zoom > 0) [this.around, this.zoom] = [around, zoom];
  }

  // Tell what is shown, once nothing has changed for a moment.
  change() {
    clearTimeout(this.telling);
    this.telling = setTimeout(() => {
      if (this.playing) return;
      const usual = { occluders: false, through: false, cut: this.walk.path === "inside" };
      const shows = Object.keys(usual).filter((name) => this.options[name] !== usual[name])
        .map((name) => (this.options[name] ? name : `no ${name}`));
      const above = [this.around, this.zoom].map((one) => Number(one.toFixed(3))).join(",");
      this.changed({
        frame: `${this.frame + 1}`, speed: this.speed === 1 ? "" : `${this.speed}`,
        shows: shows.join(","), above: above === "0,1" ? "" : above,
      });
    }, STILL);
  }

  get frame() {
    return Math.min(Math.round(this.time), this.walk.frames - 1);
  }

  build() {
    const { walk, host } = this;
    if (!document.getElementById("walk-style"))
      document.head.append(make("style", { id: "walk-style", textContent: STYLE }));
    this.canvas = make("canvas", { tabIndex: 0 });
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label",
      `The walk through ${walk.scene}, through the camera and from above. Arrow keys turn the view `
      + "from above, plus and minus zoom it; Space plays and pauses.");
    this.names = ["Through the camera", "From above"].map((text) =>
      make("span", { className: "walk-name", textContent: text }));
    this.stage = make("div", { className: "walk-stage" }, this.canvas, ...this.names);
    this.play = make("button", { type: "button", className: "walk-play", textContent: "Play" });
    this.play.addEventListener("click", () => this.toggle());
    this.scrubber = make("input", {
      type: "range", className: "walk-scrubber", min: 0, max: walk.frames - 1, step: 1, value: 0,
    });
    this.scrubber.setAttribute("aria-label", "Frame of the walk");
    this.scrubber.addEventListener("input", () => this.go(Number(this.scrubber.value)));
    this.worst = make("button", { type: "button", textContent: "Weakest frame" });
    this.worst.addEventListener("click", () => this.go(worstFrame(walk)));
    const speed = make("select", {}, ...SPEEDS.map((one) =>
      make("option", { value: one, textContent: `${one} ×`, selected: one === this.speed })));
    speed.setAttribute("aria-label", "Speed");
    speed.addEventListener("change", () => {
      this.speed = Number(speed.value);
      this.change();
    });
    const switches = [
      ["occluders", "Occluders, in yellow"], ["through", "Found objects through walls"],
      ["cut", "Cut away what is above the camera"],
    ].map(([name, words]) => {
      const box = make("input", { type: "checkbox", checked: this.options[name] });
      box.addEventListener("change", () => {
        this.options[name] = box.checked;
        this.invalidate();
        this.change();
      });
      return make("label", {}, box, words);
    });
    this.values = {};
    const figures = [
      ["frame", "Frame"], ["visible", "Visible"], ["hidden", "Hidden"], ["found", "Found"],
      ["wrong", "Wrong"], ["triangles", "Occluder triangles"],
    ].map(([name, words]) => {
      this.values[name] = make("dd", {});
      return make("div", {}, make("dt", { textContent: words }), this.values[name]);
    });
    this.shares = [SEEN, CULLED, MISSED, WRONG].map((fate) => {
      const share = make("span", {});
      share.style.background = css(fate);
      return share;
    });
    const bar = make("div", { className: "walk-bar" }, ...this.shares);
    bar.setAttribute("aria-hidden", "true");
    const legend = LEGEND.map(([words, fate]) => {
      const swatch = make("span", { className: "walk-swatch" });
      swatch.style.background = css(fate);
      return make("li", {}, swatch, words);
    });
    const cut = walk.frames < walk.frames_of_path
      ? ` The first ${walk.frames.toLocaleString("en")} of ${walk.frames_of_path.toLocaleString("en")} frames are shown.`
      : "";
    host.replaceChildren(make("div", { className: "walk" },
      this.stage,
      make("div", { className: "walk-controls" }, this.play, this.scrubber, speed, this.worst),
      make("dl", { className: "walk-figures" }, ...figures), bar,
      make("div", { className: "walk-switches" }, ...switches),
      make("ul", { className: "walk-legend" }, ...legend),
      make("p", { className: "walk-note", textContent:
        "The figures count the objects of the frame. Large objects are coloured part by part."
        + " Drag the view from above to turn it, or use the arrow keys, plus and minus." + cut }),
    ));
    host.addEventListener("keydown", (event) => this.press(event));
    this.listen();
  }

  listen() {
    let from = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      from = event.clientX;
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (from === null) return;
      this.around -= (event.clientX - from) * 0.008;
      from = event.clientX;
      this.invalidate();
      this.change();
    });
    for (const name of ["pointerup", "pointercancel"])
      this.canvas.addEventListener(name, () => (from = null));
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const onCanvas = event.target === this.canvas;
    const turns = { ArrowLeft: STEP, ArrowRight: -STEP };
    if (event.key === " " && (onCanvas || event.target === this.scrubber)) this.toggle();
    else if (onCanvas && event.key in turns) this.around += turns[event.key];
    else if (onCanvas && (event.key === "+" || event.key === "=")) this.zoom /= 1.2;
    else if (onCanvas && event.key === "-") this.zoom *= 1.2;
    else return;
    event.preventDefault();
    this.invalidate();
    this.change();
  }

  toggle() {
    this.playing = !this.playing;
    if (this.playing && this.time >= this.walk.frames - 1) this.time = 0;
    this.play.textContent = this.playing ? "Pause" : "Play";
    this.before = null;
    this.invalidate();
    this.change();
  }

  go(frame) {
    if (this.playing) this.toggle();
    this.time = frame;
    if (this.still.matches) this.settle(1);
    this.tell();
    this.invalidate();
    this.change();
  }

  invalidate() {
    this.asked ??= requestAnimationFrame((now) => this.turn(now));
  }

  turn(now) {
    this.asked = null;
    const passed = this.before ? Math.min((now - this.before) / 1000, 0.1) : 1 / 60;
    this.before = now;
    if (this.playing) {
      const last = this.walk.frames - 1;
      this.time = Math.min(this.time + (passed * this.speed) / SECONDS_A_FRAME, last);
      if (this.time >= last) this.toggle();
      this.tell();
    }
    const moving = this.settle(this.still.matches ? 1 : 1 - Math.exp((-3 * passed) / FADE));
    this.draw();
    if (this.playing || moving) this.invalidate();
    else this.before = null;
  }

  // Bring each item nearer to what it is in this frame; whether any is still on its way.
  settle(share) {
    const { parts, occluders } = this.walk;
    const [fates, drawn] = [this.walk.fates[this.frame], this.walk.drawn[this.frame]];
    let moving = false;
    const mix = (values, at, to) => {
      const off = to - values[at];
      if (Math.abs(off) < 1.5 / 255) values[at] = to;
      else {
        values[at] += off * share;
        moving ||= share < 1;
      }
    };
    for (let part = 0; part < parts; part += 1) {
      const fate = fates[part];
      const colour = COLOURS[fate];
      for (let at = 0; at < 3; at += 1) mix(this.colours, 4 * part + at, colour[at] / 255);
      mix(this.colours, 4 * part + 3, fate === CULLED ? GHOST : 1);
      mix(this.eyes, part, fate === CULLED || fate === WRONG ? 0 : 1);
    }
    for (let at = 0; at < occluders; at += 1) mix(this.eyes, parts + at, drawn[at]);
    return moving;
  }

  tell() {
    const { walk, frame } = this;
    const of = (name) => walk.figures[name][frame];
    const visible = of("in_view") - of("hidden");
    const words = {
      frame: `${frame + 1} of ${walk.frames.toLocaleString("en")}`,
      visible: visible.toLocaleString("en"), hidden: of("hidden").toLocaleString("en"),
      found: found(of("culled"), of("hidden")), wrong: of("wrong").toLocaleString("en"),
      triangles: of("occluder_triangles").toLocaleString("en"),
    };
    for (const [name, value] of Object.entries(words))
      if (this.values[name].textContent !== value) this.values[name].textContent = value;
    const parts = [visible - of("wrong"), of("culled"), of("hidden") - of("culled"), of("wrong")];
    this.shares.forEach((share, at) => (share.style.flex = `${parts[at]} 0 0`));
    if (Number(this.scrubber.value) !== frame) this.scrubber.value = frame;
    this.scrubber.setAttribute("aria-valuetext",
      `Frame ${words.frame}: ${words.hidden} objects hidden, ${words.found} found, ${words.wrong} wrong`);
  }

  draw() {
    const { canvas, picture, walk } = this;
    const wide = this.stage.clientWidth;
    if (!wide || picture.gl.isContextLost()) return;
    const beside = wide >= NARROW;
    const across = beside ? Math.floor(wide / 2) : wide;
    const high = Math.round(across / Math.max(walk.aspect, 1.2));
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const size = [Math.round(wide * ratio), Math.round((beside ? high : 2 * high) * ratio)];
    if (canvas.width !== size[0] || canvas.height !== size[1]) {
      [canvas.width, canvas.height] = size;
      canvas.style.height = `${beside ? high : 2 * high}px`;
      Object.assign(this.names[0].style, { left: 0, top: 0 });
      Object.assign(this.names[1].style, beside ? { left: `${across}px`, top: 0 } : { left: 0, top: `${high}px` });
    }
    const [w, h] = [Math.round(across * ratio), Math.round(high * ratio)];
    const camera = cameraAt(walk, this.time);
    this.drawThrough(camera, [0, size[1] - h, w, h], w / h);
    this.drawAbove(camera, beside ? [w, 0, size[0] - w, h] : [0, 0, w, h], w / h);
    canvas.dataset.frame = this.frame;
    canvas.dataset.pictures = Number(canvas.dataset.pictures ?? 0) + 1;
  }

  drawThrough(camera, place, aspect) {
    const { picture, walk, options, eyes } = this;
    const { bytes } = picture;
    for (let part = 0; part < walk.parts; part += 1) {
      const wrong = this.walk.fates[this.frame][part] === WRONG;
      const hidden = 1 - eyes[part];
      const wall = wrong ? COLOURS[WRONG] : WALLS[part % WALLS.length];
      const blue = COLOURS[CULLED];
      for (let at = 0; at < 3; at += 1)
        bytes[4 * part + at] = wrong ? wall[at] : wall[at] * eyes[part] + blue[at] * hidden;
      const least = options.through && !wrong ? THROUGH : 0;
      bytes[4 * part + 3] = wrong ? 255 : 255 * Math.max(eyes[part], least);
    }
    this.paintOccluders();
    picture.begin(place, SKY);
    const view = perspective(camera, camera.fov, aspect, Math.max(camera.near, this.reach.size * 1e-5), 4 * this.reach.size);
    picture.draw(this.lit(camera, view, [0, 0, 0, 1]), options.through);
  }

  drawAbove(camera, place, aspect) {
    const { picture, walk, colours, options } = this;
    const { bytes } = picture;
    for (let at = 0; at < 4 * walk.parts; at += 1) bytes[at] = 255 * colours[at];
    this.paintOccluders();
    const above = this.above(camera);
    const view = perspective(above, FIELD, aspect, 0.02 * above.distance, above.distance + 4 * this.reach.size);
    const height = dot(camera.position, this.lift);
    const cut = options.cut ? [...this.lift, height + 1e-3 * this.reach.size] : [0, 0, 0, 1];
    picture.begin(place, [0, 0, 0, 0]);
    const drawn = this.lit(above, view, cut);
    picture.draw(drawn, false);
    this.markPath(drawn, camera, above);
  }

  paintOccluders() {
    const { bytes } = this.picture;
    for (let at = this.walk.parts; at < this.count; at += 1) {
      for (let one = 0; one < 3; one += 1) bytes[4 * at + one] = OCCLUDER[one];
      bytes[4 * at + 3] = this.options.occluders ? 255 * OVERLAY * this.eyes[at] : 0;
    }
  }

  // The path, the wedge that the camera has in view, and where it is.
  markPath(drawn, camera, above) {
    const { picture, walk } = this;
    const path = [];
    for (let at = 0; at < walk.frames; at += 1) path.push(...walk.cameras.subarray(14 * at, 14 * at + 3));
    picture.mark(drawn, path, "LINE_STRIP", [0.35, 0.05, 0.35, 0.8]);
    const slope = Math.tan((camera.fov / 360) * Math.PI) * walk.aspect;
    const ahead = unit(level(camera.forward, this.lift));
    const right = cross(ahead, this.lift);
    const far = 1.6 * above.distance;
    const ends = [-slope, slope].map((side) => along(along(camera.position, ahead, far), right, side * far));
    picture.mark(drawn, [...camera.position, ...ends[0], ...ends[1]], "TRIANGLES", [0.84, 0, 0.42, 0.1]);
    picture.mark(drawn, [...ends[0], ...camera.position, ...ends[1]], "LINE_STRIP", [0.84, 0, 0.42, 1]);
    const size = 0.022 * above.distance;
    const tip = along(camera.position, ahead, 1.6 * size);
    const back = along(camera.position, ahead, -size);
    picture.mark(drawn, [...tip, ...along(back, right, size), ...along(back, right, -size)], "TRIANGLES", [0.84, 0, 0.42, 1]);
  }

  // Looks down at what is ahead of the camera, from a side that does not turn with it.
  above(camera) {
    const distance = this.reach.away * this.zoom;
    const first = unit(level(cameraAt(this.walk, 0).forward, this.lift));
    const side = cross(first, this.lift);
    const ahead = along(first.map((one) => one * Math.cos(this.around)), side, Math.sin(this.around));
    const forward = unit(along(ahead.map((one) => one * Math.cos(ELEVATION)), this.lift, -Math.sin(ELEVATION)));
    const right = unit(cross(forward, this.lift));
    const target = along(camera.position, unit(level(camera.forward, this.lift)), 0.3 * distance);
    return { position: along(target, forward, -distance), right, up: cross(right, forward), forward, distance };
  }

  lit(camera, view, cut) {
    const light = unit(along(along(this.lift, camera.right, -0.55), camera.forward, -0.35));
    return { eye: camera.position, view, light, cut };
  }

  dispose() {
    if (this.asked) cancelAnimationFrame(this.asked);
    this.asked = 0; // nothing is asked for any more
    clearTimeout(this.telling);
    this.watcher?.disconnect();
    this.picture?.dispose();
  }
}

function make(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

const css = (fate) => `rgb(${COLOURS[fate].join(" ")})`;

function found(culled, hidden) {
  if (!hidden) return "none hidden";
  // Never rounded up to all.
  return `${culled.toLocaleString("en")} (${(Math.floor((1000 * culled) / hidden) / 10).toFixed(1)} %)`;
}

// Wrong is worse than missed.
function worstFrame({ figures, frames }) {
  const badness = (at) =>
    1e9 * figures.wrong_pixels[at] + (figures.hidden[at] ? 1 - figures.culled[at] / figures.hidden[at] : 0);
  let worst = 0;
  for (let at = 1; at < frames; at += 1) if (badness(at) > badness(worst)) worst = at;
  return worst;
}

function level(direction, lift) {
  return along(direction, lift, -dot(direction, lift));
}

// How large the scene is, and from how far away one sees what most frames have in view.
function reachOf({ boxes, parts, fates, cameras, frames }) {
  let [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (let part = 0; part < parts; part += 1) {
    const corner = boxes.subarray(6 * part, 6 * part + 6);
    low = low.map((one, axis) => Math.min(one, corner[axis]));
    high = high.map((one, axis) => Math.max(one, corner[axis] + corner[3 + axis]));
  }
  const size = Math.hypot(...high.map((one, axis) => one - low[axis]));
  const distances = [];
  for (let frame = 0; frame < frames; frame += Math.ceil(frames / 12))
    for (let part = 0; part < parts; part += 1) {
      if (fates[frame][part] === ABSENT) continue;
      const middle = [0, 1, 2].map((axis) => boxes[6 * part + axis] + boxes[6 * part + 3 + axis] / 2);
      distances.push(Math.hypot(...middle.map((one, axis) => one - cameras[14 * frame + axis])));
    }
  distances.sort((one, other) => one - other);
  const usual = distances[Math.floor(0.5 * distances.length)] ?? size / 4;
  return { size, away: Math.min(Math.max(1.5 * usual, size / 50), size) };
}

// Column by column, of what is relative to the eye.
function perspective({ right, up, forward }, fov, aspect, near, far) {
  const high = 1 / Math.tan((fov / 360) * Math.PI);
  const wide = high / aspect;
  const [a, b] = [(far + near) / (far - near), (-2 * far * near) / (far - near)];
  const columns = [0, 1, 2].map((axis) => [wide * right[axis], high * up[axis], a * forward[axis], forward[axis]]);
  return new Float32Array([...columns.flat(), 0, 0, b, 0]);
}
