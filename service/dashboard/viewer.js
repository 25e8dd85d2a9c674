// The 3D view as an element of a page: its properties, its keys, and what it says in words.

import { keep, kept } from "occluder-address";
import { Stage, loadLoss } from "occluder-drawing";
import { loadSets } from "occluder-sets";

const NO_WEBGL =
  "This browser draws no 3D: WebGL is switched off or missing. The figures, pictures and " +
  "downloads of this page work without it.";
const MIDDLE = 0.5; // of the slider
const STILL = 300; // milliseconds without a movement after which the address tells where one stands
const css = (colour) => `rgb(${colour.join(",")})`;
const LOST = "The graphics card has dropped the 3D view. It comes back by itself, or on a reload.";

export default {
  template: `
    <figure class="mesh-viewer" :data-state="state">
      <div ref="host" class="mesh-viewer-canvas" tabindex="0" role="application" :aria-label="label"
           :aria-describedby="wordsId" @keydown="press">
        <p v-if="message" class="mesh-viewer-message" role="alert">{{ message }}</p>
        <p v-else-if="state === 'loading'" class="mesh-viewer-message" role="status">Loading…</p>
        <p v-else-if="waiting" class="mesh-viewer-message" role="status">{{ waiting }}</p>
        <div v-if="mode === 'side' && !message" class="mesh-viewer-halves" aria-hidden="true">
          <span>original</span><span>occluder</span>
        </div>
      </div>
      <input v-if="mode === 'wipe' && !message" class="mesh-viewer-wipe" type="range" min="0" max="1"
        step="0.005" v-model.number="share" aria-label="Original to the left, occluder to the right">
      <figcaption :id="wordsId" class="mesh-viewer-words">
        <template v-if="mode === 'silhouette'">
          <span v-for="one in legend" :key="one.name" class="mesh-viewer-legend">
            <span class="swatch" :style="{ background: one.colour }"></span>{{ one.text }}
          </span>
        </template>
        <template v-else-if="mode === 'loss'">
          <span v-if="lossFault" role="alert">{{ lossFault }}</span>
          <template v-else-if="lossWords">
            <span class="loss-scale">
              <span class="loss-ramp" :style="{ background: gradient }"></span>
              <span class="loss-ticks">
                <span>0 %, always covered</span><span>50 %</span><span>100 %, never covered</span>
              </span>
            </span>
            <span class="mesh-viewer-legend">
              <span class="swatch" :style="{ background: unseen }"></span>seen by no view
            </span>
            <span class="loss-words">{{ lossWords }}</span>
          </template>
        </template>
        <span v-else>{{ words }}</span>
      </figcaption>
    </figure>`,

  props: {
    original: String,
    levels: Array,
    level: Number,
    mode: String,
    wireframe: Boolean,
    up: String,
    palette: Array,
    direction: Array,
    label: String,
    group: String,
    sets: String,
    cell: Number,
    loss: String,
    ramp: Array,
    suffix: String,
  },

  data() {
    return { state: "loading", message: "", triangles: null, shares: null, share: this.keptShare(),
      lossShare: null, lossViews: null, lossFault: "", waiting: "" };
  },

  computed: {
    wordsId() {
      return `${this.$attrs.id}-words`;
    },
    words() {
      if (!this.triangles) return "";
      const { original, occluder } = this.triangles;
      if (this.sets)
        return (
          `What cell ${this.cell} may see: yellow, ${occluder.toLocaleString("en")} of ` +
          `${original.toLocaleString("en")} triangles shown. The cell: pink. Drag or arrow keys ` +
          `turn, wheel or + and - zoom, right drag pans, 0 resets.`
        );
      return (
        `Original: ${original.toLocaleString("en")} triangles shown, grey. Occluder: ` +
        `${occluder.toLocaleString("en")}, yellow. Drag or arrow keys turn, wheel or + and - zoom, ` +
        `right drag pans, 0 resets.`
      );
    },
    gradient() {
      return `linear-gradient(90deg, ${this.ramp.slice(1).map(css).join(", ")})`;
    },
    unseen() {
      return css(this.ramp[0]);
    },
    lossWords() {
      if (this.lossShare === null) return "";
      return (
        `Colour: the share of what ${this.lossViews.toLocaleString("en")} views see of a place ` +
        `that the occluder does not cover. Over the whole mesh: ` +
        `${(100 * this.lossShare).toFixed(2)} %. Measured on the finest level.`
      );
    },
    legend() {
      const [, wrong, missed, both] = this.palette.map(css);
      const shares = this.shares;
      const covered = shares ? shares.both + shares.missed + shares.wrong : 0;
      const share = (name) =>
        covered ? ` ${((100 * shares[name]) / covered).toFixed(1)} %` : "";
      return [
        { name: "both", colour: both, text: `original and occluder${share("both")}` },
        { name: "missed", colour: missed, text: `original only${share("missed")}` },
        { name: "wrong", colour: wrong, text: `occluder only (hides too much)${share("wrong")}` },
      ];
    },
  },

  watch: {
    mode(mode) {
      this.stage?.setMode(mode);
      this.paintLoss();
    },
    share(share) {
      this.stage?.setShare(share);
      this.keepSoon();
    },
    wireframe(on) {
      this.stage?.setWireframe(on);
    },
    level() {
      this.showLevel();
    },
    cell() {
      this.showLevel();
    },
  },

  async mounted() {
    await this.$nextTick();
    try {
      this.stage = new Stage(
        this.$refs.host,
        { up: this.up, palette: this.palette, ramp: this.ramp },
        {
          counted: (shares) => {
            this.shares = shares;
            this.$emit("counted", shares);
          },
          moved: () => this.keepSoon(),
          lost: () => this.fail("lost", LOST),
          restored: () => {
            this.message = "";
            this.state = "ready";
          },
        },
      );
    } catch {
      this.fail("absent", NO_WEBGL);
      return;
    }
    if (this.group) this.stage.eye.join(this.group);
    this.stage.setMode(this.mode);
    this.stage.setWireframe(this.wireframe);
    this.stage.setShare(this.share);
    if (this.direction) this.lookAlong(this.direction);
    try {
      this.stage.eye.frame(await this.stage.pieces.loadOriginal(this.original));
    } catch (error) {
      this.fail("failed", `The original cannot be shown: ${error.message}.`);
      return;
    }
    if (kept("eye")) this.stage.eye.stand(kept("eye"));
    this.keeping = true;
    await this.showLevel();
    await this.paintLoss();
  },

  beforeUnmount() {
    clearTimeout(this.moving);
    this.stage?.dispose();
  },

  methods: {
    async showLevel() {
      if (!this.stage) return;
      const [level, cell] = [this.level, this.cell];
      try {
        if (this.sets) await this.loadCell(cell);
        else await this.stage.pieces.loadLevel(this.levels[level]);
      } catch (error) {
        const what = this.sets ? `The set of cell ${cell}` : `Level ${level}`;
        this.fail("failed", `${what} cannot be shown: ${error.message}.`);
        return;
      }
      // What was asked for later may have come earlier.
      if (level !== this.level || cell !== this.cell) return this.showLevel();
      this.message = "";
      this.state = "ready";
      this.shares = null;
      this.triangles = this.stage.pieces.triangles();
      this.stage.invalidate();
      this.$emit("ready", this.triangles);
    },

    // Loaded once, when it is first to be seen: the service works it out then.
    async paintLoss() {
      if (this.mode !== "loss" || !this.stage || !this.loss || this.lossAsked) return;
      this.lossAsked = true;
      this.lossFault = "";
      this.waiting = "Finding where recall is lost…";
      try {
        const loss = await loadLoss(this.loss);
        this.stage?.showLoss(loss);
        this.lossShare = loss.share;
        this.lossViews = loss.views;
      } catch (error) {
        this.lossAsked = false;
        this.lossFault = `The heat map cannot be shown: ${error.message}.`;
      }
      this.waiting = "";
    },

    async loadCell(cell) {
      const sets = await loadSets(this.sets);
      const objects = await sets.objects(cell);
      this.stage.pieces.showObjects(objects, sets.triangles, await sets.hidden(cell));
      this.stage.pieces.showCell(sets.solid(cell));
    },

    lookAlong(direction) {
      this.stage?.lookAlong(direction);
    },

    keptShare() {
      const share = Number(kept(`share${this.suffix}`, MIDDLE));
      return share >= 0 && share <= 1 ? share : MIDDLE;
    },

    keepSoon() {
      if (!this.keeping) return; // the page has not yet what its address says
      clearTimeout(this.moving);
      this.moving = setTimeout(() => {
        const share = this.share === MIDDLE ? "" : this.share;
        keep({ eye: this.stage.eye.told, [`share${this.suffix}`]: share });
      }, STILL);
    },

    press(event) {
      if (!this.stage || event.ctrlKey || event.metaKey || event.altKey) return;
      if (this.stage.eye.press(event.key)) event.preventDefault();
    },

    fail(state, message) {
      this.state = state;
      this.message = message;
    },
  },
};
