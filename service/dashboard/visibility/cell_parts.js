// What is drawn of the objects that a cell may see: slices as bars, or from which height they are
// seen.  A table, the objects with most triangles first.

import { loadSets } from "occluder-sets";

const SHOWN = 30;

export default {
  template: `
    <div class="cell-parts" :data-cell="ready">
      <p v-if="message" role="alert">{{ message }}</p>
      <p v-else class="quiet" role="status">{{ words }}</p>
      <div v-if="rows.length" class="wide-table">
        <table class="plain-table">
          <caption class="for-readers">Objects of cell {{ ready }}</caption>
          <thead>
            <tr>
              <th scope="col">Object</th>
              <th scope="col" class="number">Triangles</th>
              <th v-for="axis in axes" :key="axis" scope="col">Slices along {{ axis }}</th>
              <th v-if="!axes.length" scope="col" class="number">Seen from, {{ up }}</th>
            </tr>
          </thead>
          <tbody>
            <tr v-for="row in rows" :key="row.object">
              <th scope="row" class="name">{{ row.name }}</th>
              <td class="number">{{ row.triangles.toLocaleString("en") }}</td>
              <td v-for="(one, axis) in row.slices" :key="axis">
                <span class="slice-bar" aria-hidden="true">
                  <span v-for="slice in count" :key="slice"
                        :class="{ drawn: slice >= one[0] && slice <= one[1] }"></span>
                </span>
                {{ told(one) }}
              </td>
              <td v-if="!axes.length" class="number">{{ row.height }}</td>
            </tr>
          </tbody>
        </table>
      </div>
    </div>`,

  props: { base: String, chosen: Number },

  data() {
    return { rows: [], axes: [], up: "", count: 0, words: "", message: "", ready: null };
  },

  watch: {
    chosen() {
      this.show();
    },
  },

  mounted() {
    this.show();
  },

  methods: {
    async show() {
      const cell = this.chosen;
      try {
        const sets = await loadSets(this.base);
        this.names ??= await sets.names();
        const found = await Promise.all([sets.objects(cell), sets.drawn(cell), sets.seenFrom(cell)]);
        if (cell === this.chosen) this.tell(sets, cell, ...found);
      } catch (error) {
        this.message = `What is drawn cannot be shown: ${error.message}.`;
      }
    },

    tell(sets, cell, objects, drawn, heights) {
      const up = "xyz".indexOf(sets.up);
      this.up = sets.up;
      this.count = sets.slices?.count ?? 0;
      this.axes = drawn ? [1, 2, 3].map((turn) => "xyz"[(up + turn) % 3]) : [];
      const rows = objects.map((object, at) => ({
        object,
        name: this.names[object],
        triangles: sets.triangles[object],
        slices: drawn ? drawn[at] : [],
        height: this.height(heights && heights[at]),
      }));
      rows.sort((a, b) => b.triangles - a.triangles || a.object - b.object);
      this.rows = drawn || heights ? rows.slice(0, SHOWN) : [];
      this.words = this.summary(cell, rows, drawn, heights);
      this.ready = cell;
    },

    summary(cell, rows, drawn, heights) {
      const all = rows.length.toLocaleString("en");
      if (!drawn && !heights) return `Cell ${cell} is not computed: everything is drawn.`;
      const part = drawn
        ? drawn.filter((each) => each.every(([low, high]) => low > 1 || high < this.count)).length
        : heights.filter((each) => each !== null).length;
      const what = drawn ? "are drawn in part" : "are seen only from higher up";
      const more = rows.length > SHOWN ? `; below, the ${SHOWN} with most triangles` : "";
      return `Of the ${all} objects that cell ${cell} may see, ${part.toLocaleString("en")} ${what}${more}.`;
    },

    height(value) {
      return value === null ? "any height" : Number(value.toPrecision(6)).toLocaleString("en");
    },

    told([low, high]) {
      if (low > high) return "none";
      return low === high ? `${low}` : `${low} to ${high}`;
    },
  },
};
