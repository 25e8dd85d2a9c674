/* All assets in one list: searched, sorted and scrolled within the page, thousands at a time.
   Only the rows in sight are elements of the page.  Text from outside becomes text nodes only. */

import { assetsAt, rowsOf } from "occluder-assets";
import { kept, keep } from "occluder-address";

const STORED = "occluder.overview.columns";
const NARROW = 1000; // pixels; below, the less important columns begin hidden,
const MIDDLE = 1400; // and below this the least important
const ROW_HEIGHT = 58; // about, until a row was measured
const MOST_FOLDERS = 14;
const WORD_CLASS = { met: "good", missed: "bad", good: "good", weak: "doubt", unusable: "bad" };
const SPARK = { width: 92, height: 22, margin: 3, leastSpan: 0.02 };
const PARTS = /[^/_.\- ]*[/_.\- ]*/g;

/* Never more than it is, and nothing only where it is. */
function percent(share) {
  const hundredths = Math.floor(share * 10000 + 1e-6);
  if (hundredths === 0 && share > 0) return "< 0.01 %";
  return `${Math.floor(hundredths / 100)}.${String(hundredths % 100).padStart(2, "0")} %`;
}

/* Of what is to be small: never less than it is. */
function atMost(share) {
  return `${(Math.ceil(share * 10000 - 1e-6) / 100).toFixed(2)} %`;
}

function moment(seconds) {
  const two = (number) => String(number).padStart(2, "0");
  const at = new Date(seconds * 1000);
  const day = `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())}`;
  return `${day} ${two(at.getHours())}:${two(at.getMinutes())}`;
}

/* As on all other pages: milliseconds below a second, hundredths from there on. */
function spanOfTime(seconds) {
  if (seconds < 1) return `${whole(Math.round(1000 * seconds))} ms`;
  const digits = { minimumFractionDigits: 2, maximumFractionDigits: 2 };
  return `${seconds.toLocaleString("en-US", digits)} s`;
}

const whole = (value) => value.toLocaleString("en-US");

const isPoor = (row) => row.verdict === "weak" || row.verdict === "unusable";

const KINDS = [
  { value: "", title: "All", holds: () => true },
  { value: "failed", title: "Upload failed", holds: (row) => row.failed !== null },
  { value: "missed", title: "Below a threshold", holds: (row) => row.holds === "missed" },
  { value: "poor", title: "Weak or unusable", holds: isPoor },
  { value: "worse", title: "Got worse", holds: (row) => row.worse },
  { value: "new", title: "No run yet", holds: (row) => row.holds === "no run yet" },
];

const COLUMNS = [
  { id: "verdict", title: "Verdict", value: (row) => row.verdict },
  { id: "holds", title: "Thresholds", value: (row) => row.holds },
  { id: "recall", title: "Recall", value: (row) => row.recall, text: percent },
  { id: "recalls", title: "Recall history", unsorted: true, from: NARROW },
  { id: "precision", title: "Precision", value: (row) => row.precision, text: percent },
  { id: "worst", title: "Worst view", value: (row) => row.worst, text: percent, from: NARROW },
  { id: "overhang", title: "Overhang", value: (row) => row.overhang, text: atMost, best: "low" },
  { id: "input", title: "Triangles in", value: (row) => row.input, text: whole, from: MIDDLE },
  { id: "triangles", title: "Triangles", value: (row) => row.triangles, text: whole },
  { id: "seconds", title: "Run time", value: (row) => row.seconds, from: MIDDLE,
    text: spanOfTime },
  { id: "created", title: "Latest run", value: (row) => row.created, text: moment, from: NARROW },
];
const LIMITS = [
  { id: "min_recall", title: "recall at least" },
  { id: "min_precision", title: "precision at least" },
  { id: "max_overhang", title: "overhang at most" },
];
const NAME = { id: "name", value: (row) => row.name };
const WORDS = new Set(["verdict", "holds"]);

function compared(a, b) {
  if (typeof a === "string") return a.localeCompare(b);
  return a - b;
}

// As many as the window has room for.
function usualColumns() {
  return COLUMNS.filter((column) => window.innerWidth >= (column.from ?? 0)).map((one) => one.id);
}

export default {
  template: `
    <div class="assets">
      <div class="row-of-controls">
        <label class="field">Search
          <input type="search" spellcheck="false" v-model="find" />
        </label>
        <label class="field">Show
          <select v-model="show">
            <option v-for="kind in kinds" :key="kind.value" :value="kind.value">
              {{ kind.title }} ({{ kind.count.toLocaleString("en-US") }})
            </option>
          </select>
        </label>
        <label class="field sort-choice">Sort by
          <select v-model="sort">
            <option v-for="one in sortings" :key="one.value" :value="one.value">
              {{ one.title }}
            </option>
          </select>
        </label>
        <details ref="chooser" class="chooser" @keydown.esc="closeChooser">
          <summary>Columns</summary>
          <fieldset>
            <legend class="for-readers">Columns to show</legend>
            <label v-for="column in columns" :key="column.id">
              <input type="checkbox" :value="column.id" v-model="chosenColumns" />
              {{ column.title }}
            </label>
          </fieldset>
        </details>
        <button type="button" class="plain-button" @click="$emit('export', ids)">
          Export as CSV
        </button>
        <span class="quiet number" role="status">{{ told }}</span>
      </div>
      <nav v-if="folder || folders.length" class="folders" aria-label="Folders">
        <button type="button" class="tag" :aria-current="folder ? null : 'true'" @click="folder = ''">
          All
        </button>
        <button v-for="one in above" :key="'a' + one.path" type="button" class="tag"
                :aria-current="one.path === folder ? 'true' : null" @click="folder = one.path">
          {{ one.name }}/
        </button>
        <button v-for="one in listedFolders" :key="one.path" type="button" class="tag within"
                @click="folder = one.path">
          {{ one.name }}/ <span class="quiet number">{{ one.count.toLocaleString("en-US") }}</span>
        </button>
        <button v-if="folders.length > listedFolders.length" type="button" class="tag within"
                @click="allFolders = true">
          {{ folders.length - listedFolders.length }} more folders
        </button>
      </nav>
      <div class="row-of-controls scope">
        <span>{{ scope }}</span>
        <button v-if="editable" type="button" class="plain-button" @click="$emit('demandFolder', folder)">
          Set thresholds of {{ folder ? folder + "/" : "all assets" }}
        </button>
      </div>
      <div v-if="chosen.length" class="row-of-controls chosen-bar" role="group" aria-label="Chosen assets">
        <span class="number" role="status">{{ chosen.length.toLocaleString("en-US") }} chosen</span>
        <button type="button" class="plain-button" @click="removeChosen">Delete</button>
        <button type="button" class="plain-button" @click="$emit('export', chosen)">
          Export as CSV
        </button>
        <button type="button" class="plain-button" @click="chosen = []">Clear</button>
      </div>
      <q-virtual-scroll type="table" class="asset-list" scroll-target="body" :items="shown"
                        :virtual-scroll-item-size="rowHeight" :table-colspan="visible.length + 4">
        <template #before>
          <caption class="for-readers">Assets</caption>
          <thead>
            <tr>
              <th v-if="editable" scope="col" class="pick-cell">
                <input type="checkbox" aria-label="Choose all" :checked="allChosen"
                       @change="chosen = $event.target.checked ? ids : []" />
              </th>
              <th scope="col"><span class="for-readers">Picture</span></th>
              <th scope="col" :aria-sort="ariaSort(name)">
                <button type="button" @click="turn(name)">Asset{{ arrow(name) }}</button>
              </th>
              <th v-for="column in visible" :key="column.id" scope="col" :class="looks(column)"
                  :aria-sort="ariaSort(column)">
                <span v-if="column.unsorted">{{ column.title }}</span>
                <button v-else type="button" @click="turn(column)">
                  {{ column.title }}{{ arrow(column) }}
                </button>
              </th>
              <th v-if="editable" scope="col"><span class="for-readers">Change</span></th>
            </tr>
          </thead>
        </template>
        <template #default="{ item: row }">
          <tr :key="row.id" class="asset-row" @click="open($event, row)">
            <td v-if="editable" class="pick-cell">
              <input type="checkbox" :value="row.id" v-model="chosen"
                     :aria-label="'Choose ' + row.name" />
            </td>
            <td class="thumb-cell">
              <img v-if="row.pictured" class="thumb" :src="picture(row)" alt="" loading="lazy"
                   width="48" height="48" />
              <span v-else class="thumb"></span>
            </td>
            <td class="name-cell">
              <a class="asset-name" :href="address(row)" :title="row.name"><template
                v-for="part in parts(row.name)">{{ part }}<wbr /></template></a>
              <a v-if="row.failed" class="failed-link" :href="'/jobs/' + row.failed"
                 :aria-label="'Why the latest upload of ' + row.name + ' failed'">upload failed</a>
              <span v-if="row.evaluation" class="evaluation-mark"
                    title="The occluder of the latest run was made elsewhere and measured here."
                >evaluation</span>
            </td>
            <td v-for="column in visible" :key="column.id" :class="looks(column)"
                :data-column="column.id" :data-label="column.title">
              <template v-if="column.id === 'recalls'">
                <svg v-if="row.recalls.length" class="spark" :viewBox="sparkBox" role="img"
                     :aria-label="sparkWords(row.recalls)">
                  <polyline :points="sparkPoints(row.recalls)" />
                  <circle :cx="sparkEnd(row.recalls)[0]" :cy="sparkEnd(row.recalls)[1]" r="2" />
                </svg>
              </template>
              <span v-else-if="isWord(column)" class="verdict" :class="wordClass(column.value(row))">{{
                column.value(row) }}</span>
              <template v-else>{{ text(column, row) }}</template>
            </td>
            <td v-if="editable" class="menu-cell">
              <button type="button" class="plain-button menu-button" aria-haspopup="menu"
                      :aria-label="'Change ' + row.name">⋯
                <q-menu anchor="bottom right" self="top right" auto-close>
                  <q-list>
                    <q-item clickable @click="$emit('demand', row.id)">
                      <q-item-section>Thresholds</q-item-section>
                    </q-item>
                    <q-item clickable @click="$emit('rename', row.id)">
                      <q-item-section>Rename</q-item-section>
                    </q-item>
                    <q-item clickable @click="$emit('remove', [row.id])">
                      <q-item-section>Delete</q-item-section>
                    </q-item>
                  </q-list>
                </q-menu>
              </button>
            </td>
          </tr>
        </template>
        <template #after>
          <tbody v-if="!shown.length && loaded">
            <tr><td :colspan="visible.length + 4" class="quiet">No assets match.</td></tr>
          </tbody>
        </template>
      </q-virtual-scroll>
    </div>`,

  props: { editable: Boolean, source: String, first: Object, count: Number, limits: Object },

  data() {
    return {
      rows: Vue.markRaw(rowsOf(this.first)),
      loaded: false,
      find: kept("find"),
      show: kept("show"),
      folder: kept("folder"),
      sort: kept("sort"),
      allFolders: false,
      chosen: [],
      columns: COLUMNS,
      name: NAME,
      chosenColumns: this.recalled() ?? usualColumns(),
      rowHeight: ROW_HEIGHT,
      sparkBox: `0 0 ${SPARK.width} ${SPARK.height}`,
    };
  },

  computed: {
    visible() {
      return COLUMNS.filter((column) => this.chosenColumns.includes(column.id));
    },

    kinds() {
      return KINDS.map((kind) => ({
        ...kind,
        count: kind.value || this.loaded ? this.rows.filter(kind.holds).length : this.count,
      }));
    },

    sortings() {
      const both = [NAME, ...COLUMNS].filter((column) => !column.unsorted);
      return [
        { value: "", title: "what needs attention" },
        ...both.flatMap((column) => {
          const title = (column.title ?? "Asset").toLowerCase();
          if (WORDS.has(column.id) || column === NAME) return [{ value: column.id, title }];
          return [
            { value: column.id, title: `${title}, lowest first` },
            { value: `-${column.id}`, title: `${title}, highest first` },
          ];
        }),
      ];
    },

    // Those that lie in the folder and are of the wanted kind, with all words in their names.
    found() {
      const words = this.find.toLowerCase().split(/\s+/).filter(Boolean);
      const { holds } = KINDS.find((kind) => kind.value === this.show) ?? KINDS[0];
      const within = this.folder && `${this.folder}/`;
      return this.rows.filter((row) => {
        if (within && !row.name.startsWith(within)) return false;
        if (!holds(row)) return false;
        const name = row.name.toLowerCase();
        return words.every((word) => name.includes(word));
      });
    },

    shown() {
      const id = this.sort.replace(/^-/, "");
      const column = [NAME, ...COLUMNS].find((one) => one.id === id && !one.unsorted);
      if (!column) return this.found;
      const sign = this.sort.startsWith("-") ? -1 : 1;
      const known = this.found.filter((row) => column.value(row) !== null);
      known.sort((a, b) => sign * compared(column.value(a), column.value(b)));
      return [...known, ...this.found.filter((row) => column.value(row) === null)];
    },

    ids() {
      return this.shown.map((row) => row.id);
    },

    told() {
      const count = this.shown.length.toLocaleString("en-US");
      return this.loaded ? `${count} shown` : `Loading ${this.count.toLocaleString("en-US")}`;
    },

    allChosen() {
      return this.shown.length > 0 && this.chosen.length >= this.shown.length;
    },

    // What is demanded of the assets in the folder that do not say so themselves.
    scope() {
      const paths = [""].concat(this.above.map((one) => one.path)).reverse();
      const found = LIMITS.flatMap(({ id, title }) => {
        const path = paths.find((one) => (this.limits[one]?.[id] ?? null) !== null);
        if (path === undefined) return [];
        const from = path === this.folder ? "" : ` (from ${path ? `${path}/` : "all assets"})`;
        return [`${title} ${+(100 * this.limits[path][id]).toPrecision(6)} %${from}`];
      });
      const where = this.folder ? `${this.folder}/` : "all assets";
      if (!found.length) return `No thresholds set for ${where}.`;
      return `Thresholds of ${where}: ${found.join(", ")}.`;
    },

    above() {
      const names = this.folder ? this.folder.split("/") : [];
      return names.map((name, at) => ({ name, path: names.slice(0, at + 1).join("/") }));
    },

    // Directly within the folder, with how many assets they hold.
    folders() {
      const within = this.folder ? `${this.folder}/` : "";
      const counts = new Map();
      for (const { name } of this.rows) {
        if (!name.startsWith(within)) continue;
        const end = name.indexOf("/", within.length);
        if (end < 0) continue;
        const path = name.slice(0, end);
        counts.set(path, (counts.get(path) ?? 0) + 1);
      }
      return [...counts]
        .map(([path, count]) => ({ path, count, name: path.slice(within.length) }))
        .sort((a, b) => b.count - a.count || a.path.localeCompare(b.path));
    },

    listedFolders() {
      return this.allFolders ? this.folders : this.folders.slice(0, MOST_FOLDERS);
    },
  },

  watch: {
    source() {
      this.load();
    },
    find: "tellAddress",
    show: "tellAddress",
    sort: "tellAddress",
    folder() {
      this.allFolders = false;
      this.tellAddress();
    },
    chosenColumns() {
      keep({ columns: this.chosenColumns.join(",") });
      try {
        localStorage.setItem(STORED, JSON.stringify(this.chosenColumns));
      } catch {} // a browser that keeps nothing forgets the columns, and no more
    },
  },

  mounted() {
    document.addEventListener("click", this.closeElsewhere);
    if (this.recalled()) keep({ columns: this.chosenColumns.join(",") });
    // What is in sight is drawn first.
    requestAnimationFrame(() => setTimeout(() => this.load()));
  },

  unmounted() {
    document.removeEventListener("click", this.closeElsewhere);
  },

  methods: {
    async load() {
      const source = this.source;
      const rows = await assetsAt(source);
      if (source !== this.source) return; // others were asked for meanwhile
      this.rows = Vue.markRaw(rows);
      this.loaded = true;
      const there = new Set(rows.map((row) => row.id));
      this.chosen = this.chosen.filter((id) => there.has(id));
    },

    // From outside: what the panel of what needs attention leads to.
    showKind(show) {
      this.show = show;
      this.$el.scrollIntoView();
    },

    removeChosen() {
      this.$emit("remove", this.chosen);
      this.chosen = [];
    },

    tellAddress() {
      keep({ find: this.find, show: this.show, folder: this.folder, sort: this.sort });
    },

    // What somebody has chosen, here or in the link; null where nobody has.
    recalled() {
      const known = new Set(COLUMNS.map((column) => column.id));
      const stored = () => {
        try {
          return JSON.parse(localStorage.getItem(STORED));
        } catch {
          return null;
        }
      };
      const chosen = kept("columns") ? kept("columns").split(",") : stored();
      return Array.isArray(chosen) ? chosen.filter((one) => known.has(one)) : null;
    },

    picture(row) {
      return `/v1/jobs/${row.job}/files/thumbnail.png`;
    },
    address(row) {
      return `/assets/${encodeURIComponent(row.id)}`;
    },
    open(event, row) {
      if (event.defaultPrevented || event.target.closest("a, button, input, label")) return;
      window.location.assign(this.address(row));
    },

    // Once more turns it around, and the third time back to what needs attention.
    turn(column) {
      const down = `-${column.id}`;
      if (this.sort === column.id) this.sort = down;
      else this.sort = this.sort === down ? "" : column.id;
    },
    ariaSort(column) {
      if (this.sort === column.id) return "ascending";
      return this.sort === `-${column.id}` ? "descending" : null;
    },
    arrow(column) {
      if (this.sort === column.id) return " \u25b4";
      return this.sort === `-${column.id}` ? " \u25be" : "";
    },

    looks(column) {
      return [WORDS.has(column.id) || column.unsorted ? "" : "number", `of-${column.id}`];
    },
    isWord(column) {
      return WORDS.has(column.id);
    },
    wordClass(word) {
      return WORD_CLASS[word] ?? "quiet";
    },
    text(column, row) {
      const value = column.value(row);
      return value === null ? "" : column.text(value);
    },
    parts(name) {
      return name.match(PARTS).filter(Boolean);
    },

    sparkPlaces(recalls) {
      const { width, height, margin, leastSpan } = SPARK;
      const [low, high] = [Math.min(...recalls), Math.max(...recalls)];
      const span = Math.max(high - low, leastSpan);
      const floor = (low + high - span) / 2;
      const step = recalls.length > 1 ? (width - 2 * margin) / (recalls.length - 1) : 0;
      return recalls.map((recall, at) => [
        recalls.length > 1 ? margin + at * step : width - margin,
        height - margin - ((recall - floor) / span) * (height - 2 * margin),
      ]);
    },
    sparkPoints(recalls) {
      return this.sparkPlaces(recalls).map((place) => place.join(",")).join(" ");
    },
    sparkEnd(recalls) {
      return this.sparkPlaces(recalls).at(-1);
    },
    sparkWords(recalls) {
      return `${recalls.length} runs, ${percent(Math.min(...recalls))} to ${percent(Math.max(...recalls))}`;
    },

    closeChooser() {
      this.$refs.chooser.open = false;
      this.$refs.chooser.querySelector("summary").focus();
    },
    closeElsewhere(event) {
      if (!this.$refs.chooser.contains(event.target)) this.$refs.chooser.open = false;
    },
  },
};
