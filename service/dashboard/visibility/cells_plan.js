// View cells in plan, coloured by the size of their sets; the mouse and the keyboard choose one.

import { keep, kept } from "occluder-address";
import { corners, loadSets } from "occluder-sets";

const TOWARDS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const ASIDE = 2.5; // how much dearer a step to the side is than one ahead
const MARGIN = 0.03; // of the longer side
const SHADES = 64;
const OVER = 0.7; // how much of a cell an object covers that is seen
const TILED = 0.8; // of the plan: objects that fill it, as tiles do, cover no cell
const OUTLINED = 5; // pixels from which a cell has an outline
const WHOLE = 0.4; // of the plan: larger objects, such as a ground, are drawn as outlines
const ZOOM = 1.2;
const NEAREST = 400; // times as large
const STILL = 4; // pixels that a click may be off
const QUIET = 300; // milliseconds without a movement after which the address tells what is in view

export default {
  template: `
    <figure class="cells-plan" :data-state="state">
      <div ref="host" class="cells-plan-canvas" tabindex="0" role="application" :aria-label="label"
           :aria-describedby="wordsId" @keydown="press">
        <canvas ref="canvas" @click="click" @pointerdown="hold" @pointermove="move"
                @pointerup="release" @pointerleave="leave" @wheel="wheel"></canvas>
        <p v-if="message" class="mesh-viewer-message" role="alert">{{ message }}</p>
      </div>
      <figcaption>
        <div class="cells-plan-scale">
          <span>objects a cell may see:</span>
          <span class="cells-plan-ramp">
            <span class="view-map-ramp" :style="{ background: ramp }"></span>
            <span class="cells-plan-ticks number">
              <span v-for="tick in ticks" :key="tick">{{ tick }}</span>
            </span>
          </span>
        </div>
        <div class="cells-plan-keys">
          <span class="mesh-viewer-legend"><span class="swatch cells-plan-chosen"></span>chosen cell</span>
          <span class="mesh-viewer-legend"><span class="swatch cells-plan-seen"></span>object it may see</span>
          <span class="mesh-viewer-legend"><span class="swatch cells-plan-hidden"></span>object hidden from it</span>
          <span v-if="partial" class="mesh-viewer-legend"><span class="swatch"></span>not computed</span>
        </div>
        <p :id="wordsId" class="view-map-words" aria-live="polite">{{ words }}</p>
      </figcaption>
    </figure>`,

  props: { base: String, stops: Array, chosen: Number, label: String },

  data() {
    return { state: "loading", message: "", active: this.chosen, hovered: null, range: null,
             partial: false };
  },

  computed: {
    wordsId() {
      return `${this.$attrs.id}-words`;
    },
    ramp() {
      return `linear-gradient(90deg, ${this.stops.join(", ")})`;
    },
    ticks() {
      if (!this.range) return [];
      const [low, high] = this.range;
      const middle = Math.round((low + high) / 2);
      return [...new Set([low, middle, high])].map((one) => one.toLocaleString("en"));
    },
    words() {
      const cell = this.hovered ?? this.active;
      return this.range && cell !== null ? this.told(cell) : "";
    },
  },

  watch: {
    async chosen(cell) {
      this.active = cell;
      await this.showSeen();
    },
    active() {
      this.invalidate();
    },
    hovered() {
      this.invalidate();
    },
  },

  async mounted() {
    try {
      this.sets = await loadSets(this.base);
    } catch (error) {
      this.state = "failed";
      this.message = `The cells cannot be shown: ${error.message}.`;
      return;
    }
    this.measure();
    this.sizes = new ResizeObserver(() => this.draw());
    this.sizes.observe(this.$refs.host);
    this.themes = new MutationObserver(() => this.invalidate());
    this.themes.observe(document.body, { attributeFilter: ["class"] });
    this.recall();
    await this.showSeen();
    this.state = "ready";
  },

  beforeUnmount() {
    cancelAnimationFrame(this.pending);
    clearTimeout(this.moving);
    this.sizes?.disconnect();
    this.themes?.disconnect();
  },

  methods: {
    // What does not change: the size of the plan and of the sets.
    measure() {
      const { cells, boxes, sizes } = this.sets;
      const [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
      for (const one of [...cells, ...boxes])
        one.forEach((value, at) => {
          low[at % 2] = Math.min(low[at % 2], value);
          high[at % 2] = Math.max(high[at % 2], value);
        });
      this.extent = [high[0] - low[0], high[1] - low[1]];
      this.centre = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
      const done = sizes.filter((size) => size >= 0);
      this.range = [done.reduce((a, b) => Math.min(a, b)), done.reduce((a, b) => Math.max(a, b))];
      this.partial = done.length < sizes.length;
      this.largest = sizes.indexOf(this.range[1]);
      const plan = this.extent[0] * this.extent[1];
      const areas = boxes.map(([x0, y0, x1, y1]) => (x1 - x0) * (y1 - y0));
      this.wide = areas.map((area) => area > WHOLE * plan);
      const filled = areas.reduce((sum, area, one) => sum + (this.wide[one] ? 0 : area), 0);
      this.tiled = filled > TILED * plan;
      this.reset();
    },

    // What the link shows of the plan: its middle, and how many times as large.
    recall() {
      const [x, y, zoomed] = kept("plan").split(",").map(Number);
      if (!Number.isFinite(x) || !Number.isFinite(y) || !(zoomed >= 1 && zoomed <= NEAREST)) return;
      this.middle = [x, y];
      this.zoomed = zoomed;
    },

    keepSoon() {
      clearTimeout(this.moving);
      this.moving = setTimeout(() => {
        const whole = this.zoomed === 1 && this.middle.every((one, at) => one === this.centre[at]);
        const told = [...this.middle, this.zoomed].map((one) => Number(one.toPrecision(6)));
        keep({ plan: whole ? "" : told.join(",") });
      }, QUIET);
    },

    reset() {
      this.middle = [...this.centre];
      this.zoomed = 1;
      this.invalidate();
    },

    told(cell) {
      const size = this.sets.sizes[cell];
      const all = this.sets.boxes.length.toLocaleString("en");
      const middle = this.sets.middle(cell);
      const up = "xyz".indexOf(this.sets.up);
      const around = middle.map((one, axis) => {
        const value = Number((one + this.sets.origin[axis]).toPrecision(4));
        return `${"xyz"[(up + 1 + axis) % 3]} ${value.toLocaleString("en")}`;
      });
      const place = `Cell ${cell}, around ${around.join(", ")}`;
      if (size < 0) return `${place}: not computed, all ${all} objects count as seen`;
      const share = (Math.floor((10000 * size) / this.sets.boxes.length) / 100).toFixed(2);
      const others = this.sets.at(middle).length > 1 ? "; click again for the next floor" : "";
      return (
        `${place}: ${size.toLocaleString("en")} of ${all} objects may be seen (${share} %)` + others
      );
    },

    async showSeen() {
      const cell = this.chosen;
      try {
        const seen = cell === null ? [] : await this.sets.objects(cell);
        if (cell === this.chosen) this.seen = new Set(seen);
      } catch (error) {
        this.message = `The set cannot be shown: ${error.message}.`;
      }
      this.invalidate();
    },

    invalidate() {
      if (this.pending) return;
      this.pending = requestAnimationFrame(() => {
        this.pending = 0;
        this.draw();
      });
    },

    // Pixels a unit of the plan.
    scale() {
      const { clientWidth, clientHeight } = this.$refs.host;
      const fit = this.extent.map((one) => (1 + 2 * MARGIN) * one);
      return this.zoomed * Math.min(clientWidth / fit[0], clientHeight / fit[1]);
    },

    onScreen([x, y]) {
      const { clientWidth, clientHeight } = this.$refs.host;
      const scale = this.scale();
      return [
        clientWidth / 2 + scale * (x - this.middle[0]),
        clientHeight / 2 - scale * (y - this.middle[1]),
      ];
    },

    inPlan(event) {
      const { left, top } = this.$refs.host.getBoundingClientRect();
      const { clientWidth, clientHeight } = this.$refs.host;
      const scale = this.scale();
      return [
        this.middle[0] + (event.clientX - left - clientWidth / 2) / scale,
        this.middle[1] - (event.clientY - top - clientHeight / 2) / scale,
      ];
    },

    draw() {
      const { host, canvas } = this.$refs;
      const { clientWidth: width, clientHeight: height } = host;
      if (!this.sets || !width || !height) return;
      const finer = window.devicePixelRatio;
      canvas.width = Math.round(width * finer);
      canvas.height = Math.round(height * finer);
      const context = canvas.getContext("2d");
      context.scale(finer, finer);
      const style = getComputedStyle(host);
      const colour = (name) => style.getPropertyValue(`--plan-${name}`).trim();
      this.drawObjects(context, colour);
      this.drawCells(context, colour);
      this.drawSeen(context, colour);
      this.drawMarks(context, colour);
      host.dataset.frames = Number(host.dataset.frames ?? 0) + 1;
    },

    path(outlines) {
      const path = new Path2D();
      for (const outline of outlines) {
        outline.forEach((corner, at) => {
          const [x, y] = this.onScreen(corner);
          if (at) path.lineTo(x, y);
          else path.moveTo(x, y);
        });
        path.closePath();
      }
      return path;
    },

    drawObjects(context, colour) {
      const { boxes } = this.sets;
      const hidden = this.path(boxes.filter((_, one) => !this.wide[one]).map(corners));
      context.fillStyle = colour("hidden");
      context.strokeStyle = colour("line");
      context.lineWidth = 0.5;
      context.fill(hidden);
      context.stroke(hidden);
      context.stroke(this.path(boxes.filter((_, one) => this.wide[one]).map(corners)));
    },

    drawCells(context, colour) {
      const { cells, sizes } = this.sets;
      const [low, high] = this.range;
      const shades = Array.from({ length: SHADES + 1 }, () => []);
      for (let cell = 0; cell < cells.length; cell++) {
        const share = high > low ? (sizes[cell] - low) / (high - low) : 0;
        shades[sizes[cell] < 0 ? SHADES : Math.min(SHADES - 1, Math.floor(share * SHADES))].push(
          this.sets.outline(cell),
        );
      }
      const [first] = cells;
      const across = this.scale() * Math.abs(first[2] - first[0]);
      context.lineWidth = 0.5;
      shades.forEach((outlines, shade) => {
        const path = this.path(outlines);
        context.fillStyle = mixed(this.stops, shade / (SHADES - 1));
        context.strokeStyle = colour("line");
        if (shade < SHADES) context.fill(path);
        if (shade === SHADES || across >= OUTLINED) context.stroke(path);
      });
    },

    // Over the cells as well: tiles of a terrain lie beneath all of them.
    drawSeen(context, colour) {
      const { boxes } = this.sets;
      const hidden = boxes.filter((_, one) => !this.wide[one] && !this.seen?.has(one));
      context.globalAlpha = OVER;
      context.lineWidth = 0.5;
      context.strokeStyle = colour("line");
      context.stroke(this.path(hidden.map(corners)));
      const seen = boxes.filter((_, one) => !this.wide[one] && this.seen?.has(one));
      const path = this.path(seen.map(corners));
      context.fillStyle = colour("seen");
      if (!this.tiled) context.fill(path);
      context.globalAlpha = 1;
      context.lineWidth = this.tiled ? 2 : 1;
      context.strokeStyle = colour(this.tiled ? "seen" : "seen-line");
      context.stroke(path);
    },

    drawMarks(context, colour) {
      const mark = (cell, name, width) => {
        const path = this.path([this.sets.outline(cell)]);
        context.lineJoin = "round";
        context.lineWidth = width + 2;
        context.strokeStyle = colour("halo");
        context.stroke(path);
        context.lineWidth = width;
        context.strokeStyle = colour(name);
        context.stroke(path);
      };
      const pointed = this.hovered ?? this.active;
      if (pointed !== null && pointed !== this.chosen) mark(pointed, "active", 1.5);
      if (this.chosen === null) return;
      mark(this.chosen, "chosen", 3);
      const [x, y] = this.onScreen(this.sets.middle(this.chosen));
      context.beginPath();
      context.arc(x, y, 13, 0, 2 * Math.PI);
      context.lineWidth = 4;
      context.strokeStyle = colour("halo");
      context.stroke();
      context.lineWidth = 2;
      context.strokeStyle = colour("chosen");
      context.stroke();
    },

    choose(cell) {
      this.active = cell;
      this.$emit("choose", cell);
    },

    // Where cells lie over each other, one click after the other goes through them.
    click(event) {
      if (!this.sets || this.dragged) return;
      const found = this.sets.at(this.inPlan(event));
      if (found.length) this.choose(found[(found.indexOf(this.chosen) + 1) % found.length]);
    },

    hold(event) {
      this.dragged = false;
      if (event.pointerType !== "mouse") return;
      this.held = { x: event.clientX, y: event.clientY, middle: this.middle };
      this.$refs.canvas.setPointerCapture(event.pointerId);
    },

    move(event) {
      if (!this.sets) return;
      if (!this.held) {
        const [cell] = this.sets.at(this.inPlan(event));
        this.hovered = cell ?? null;
        return;
      }
      const [x, y] = [event.clientX - this.held.x, event.clientY - this.held.y];
      this.dragged ||= Math.hypot(x, y) > STILL;
      const scale = this.scale();
      if (this.dragged) {
        this.middle = [this.held.middle[0] - x / scale, this.held.middle[1] + y / scale];
        this.keepSoon();
      }
      this.invalidate();
    },

    release() {
      this.held = null;
    },

    leave() {
      this.hovered = null;
    },

    // All of the plan in view, the wheel moves the page on.
    wheel(event) {
      if (event.deltaY >= 0 && this.zoomed === 1) return;
      event.preventDefault();
      this.zoom(event.deltaY < 0 ? ZOOM : 1 / ZOOM, this.inPlan(event));
    },

    // A point of the plan stays where it is.
    zoom(factor, [x, y]) {
      const wanted = Math.min(NEAREST, Math.max(1, this.zoomed * factor));
      const kept = this.zoomed / wanted;
      this.middle = [x + kept * (this.middle[0] - x), y + kept * (this.middle[1] - y)];
      this.zoomed = wanted;
      this.invalidate();
      this.keepSoon();
    },

    press(event) {
      if (!this.sets || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key in TOWARDS) this.step(...TOWARDS[event.key]);
      else if (event.key === "Home") this.active = this.largest;
      else if (event.key === "Enter" || event.key === " ") this.choose(this.active ?? this.largest);
      else if (event.key === "+" || event.key === "=") this.zoom(ZOOM, this.middle);
      else if (event.key === "-" || event.key === "_") this.zoom(1 / ZOOM, this.middle);
      else if (event.key === "0") {
        this.reset();
        this.keepSoon();
      } else return;
      this.hovered = null;
      event.preventDefault();
    },

    // To the nearest cell ahead, within a right angle.
    step(right, up) {
      const from = this.sets.middle(this.active ?? this.largest);
      let [best, least] = [null, Infinity];
      for (let cell = 0; cell < this.sets.cells.length; cell++) {
        const to = this.sets.middle(cell);
        const [x, y] = [to[0] - from[0], to[1] - from[1]];
        const ahead = x * right + y * up;
        const aside = Math.abs(x * up - y * right);
        if (ahead <= 0 || aside > ahead || ahead + ASIDE * aside >= least) continue;
        [best, least] = [cell, ahead + ASIDE * aside];
      }
      if (best !== null) this.active = best;
    },
  },
};

// A colour between some at equal distances, by a share of 0 to 1.
function mixed(stops, share) {
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(at), stops.length - 2);
  const parts = (colour) => [1, 3, 5].map((place) => parseInt(colour.slice(place, place + 2), 16));
  const [a, b] = [parts(stops[low]), parts(stops[low + 1])];
  return `rgb(${a.map((one, place) => Math.round(one + (b[place] - one) * (at - low))).join(",")})`;
}
