// Views as dots on a map; the mouse and the keyboard choose one.

const TOWARDS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const ASIDE = 2.5; // how much dearer a step to the side is than one ahead

export default {
  template: `
    <figure class="view-map">
      <svg viewBox="-2.08 -1.08 4.16 2.16" role="listbox" tabindex="0" :aria-label="label"
           :aria-activedescendant="idOf(active)" @keydown="press" @blur="hovered = null">
        <polyline v-for="(line, at) in lines" :key="at" class="view-map-line" :points="points(line)" />
        <g v-for="dot in dots" :key="dot.index" :id="idOf(dot.index)" role="option"
           :aria-selected="dot.index === chosen" :aria-label="dot.text"
           @click="choose(dot.index)" @pointerenter="hovered = dot.index"
           @pointerleave="hovered = null">
          <circle class="view-map-dot" :class="{ active: dot.index === active }" :cx="dot.x"
                  :cy="-dot.y" r="0.042" :fill="dot.colour" />
          <circle v-if="dot.index === chosen" class="view-map-chosen" :cx="dot.x" :cy="-dot.y"
                  r="0.075" />
          <path v-if="dot.index === worst" class="view-map-worst" :d="cross(dot)" />
        </g>
      </svg>
      <div class="view-map-ends" aria-hidden="true">
        <span>left</span><span>front</span><span>right</span>
      </div>
      <figcaption>
        <div class="view-map-scale">
          <span>{{ low }}</span>
          <span class="view-map-ramp" :style="{ background: ramp }"></span>
          <span>{{ high }}</span>
          <span class="view-map-key">✕ worst</span><span class="view-map-key">◯ shown</span>
        </div>
        <p class="view-map-words" aria-live="polite">{{ words }}</p>
      </figcaption>
    </figure>`,

  props: {
    dots: Array,
    lines: Array,
    worst: Number,
    chosen: Number,
    stops: Array,
    low: String,
    high: String,
    label: String,
  },

  data() {
    return { active: this.chosen ?? this.worst, hovered: null };
  },

  computed: {
    ramp() {
      return `linear-gradient(90deg, ${this.stops.join(", ")})`;
    },
    words() {
      const index = this.hovered ?? this.active;
      return this.dots.find((dot) => dot.index === index)?.text ?? "";
    },
  },

  watch: {
    chosen(index) {
      this.active = index;
    },
  },

  methods: {
    idOf(index) {
      return `${this.$attrs.id}-view-${index}`;
    },

    points(line) {
      return line.map(([x, y]) => `${x},${-y}`).join(" ");
    },

    cross({ x, y }) {
      const [left, right, top, low] = [x - 0.06, x + 0.06, -y - 0.06, -y + 0.06];
      return `M${left} ${top}L${right} ${low}M${left} ${low}L${right} ${top}`;
    },

    choose(index) {
      this.active = index;
      this.$emit("choose", index);
    },

    press(event) {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key in TOWARDS) this.step(...TOWARDS[event.key]);
      else if (event.key === "Home") this.active = this.worst;
      else if (event.key === "Enter" || event.key === " ") this.choose(this.active);
      else return;
      event.preventDefault();
    },

    // To the nearest dot ahead, within a right angle.
    step(right, up) {
      const from = this.dots.find((dot) => dot.index === this.active);
      let best = null;
      let least = Infinity;
      for (const dot of this.dots) {
        const [x, y] = [dot.x - from.x, dot.y - from.y];
        const ahead = x * right + y * up;
        const aside = Math.abs(x * up - y * right);
        if (ahead <= 0 || aside > ahead) continue;
        if (ahead + ASIDE * aside < least) {
          least = ahead + ASIDE * aside;
          best = dot;
        }
      }
      if (best) this.active = best.index;
    },
  },
};
