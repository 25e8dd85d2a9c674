// A walk as an element of a page: fetched when somebody wants it, for it may have to be made.

import { keep, kept } from "occluder-address";
import { WalkPlayer } from "occluder-walk";

const NAMES = ["frame", "speed", "shows", "above"];

export default {
  template: `
    <div class="walk-view" :data-state="state">
      <div v-if="state !== 'ready'" class="row-of-controls">
        <button v-if="state === 'waiting' || state === 'failed'" type="button" class="walk-open"
          @click="open">{{ state === "failed" ? "Try again" : "Show the walk" }}</button>
        <p v-if="state === 'loading'" role="status">{{ words }}</p>
        <p v-if="state === 'failed'" role="alert" class="bad">{{ words }}</p>
      </div>
      <div ref="host"></div>
    </div>`,

  props: { address: String, made: Boolean },

  data() {
    return { state: "waiting", words: "" };
  },

  mounted() {
    if (kept("frame")) this.open();
  },

  beforeUnmount() {
    this.player?.dispose();
  },

  methods: {
    // `asked` is the click of whoever wants it, whom the focus follows; a link asks for nothing.
    async open(asked) {
      this.state = "loading";
      this.words = this.made
        ? "Loading…"
        : "The walk is being made: a path is found, and each of its frames is culled and checked. "
          + "A large scene takes a minute or two.";
      try {
        const answer = await fetch(this.address);
        if (!answer.ok) throw new Error(await reason(answer));
        this.player = new WalkPlayer(this.$refs.host, {
          kept: Object.fromEntries(NAMES.map((name) => [name, kept(name)])),
          changed: keep,
        });
        await this.player.open(answer.body);
        this.state = "ready";
        await this.$nextTick();
        if (asked) this.player.play.focus();
      } catch (error) {
        this.player?.dispose();
        this.state = "failed";
        this.words = `The walk cannot be shown: ${error.message}.`;
      }
    },
  },
};

async function reason(answer) {
  const told = await answer.json().catch(() => ({}));
  return [told.detail ?? `it is not there (${answer.status})`, told.remedy].filter(Boolean).join("; ");
}
