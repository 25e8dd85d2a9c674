/* All assets in one grid: filtered, sorted and scrolled within the page, thousands at a time.
   Text from outside becomes text nodes only. */

import * as AgGrid from "nicegui-aggrid";
import { assetsAt } from "occluder-assets";

AgGrid.ModuleRegistry.registerModules([AgGrid.AllCommunityModule]);

const STORED = "occluder.overview.columns";
const NARROW = 1000; // pixels; below, the less important columns begin hidden,
const MIDDLE = 1400; // and below this the least important
const WORD_CLASS = { held: "good", missed: "bad", good: "good", weak: "doubt", unusable: "bad" };
const SVG = "http://www.w3.org/2000/svg";
const SPARK = { width: 92, height: 22, margin: 3, leastSpan: 0.02 };

const LOOK = AgGrid.themeQuartz.withParams({
  accentColor: "var(--accent)",
  backgroundColor: "var(--surface)",
  borderColor: "var(--line)",
  browserColorScheme: "inherit",
  cellHorizontalPaddingScale: 0.75,
  chromeBackgroundColor: "var(--raised)",
  fontFamily: "inherit",
  fontSize: 13,
  foregroundColor: "var(--text)",
  headerHeight: 34,
  rowHeight: 34,
  spacing: 6,
  wrapperBorderRadius: 4,
});

/* As in rows.py: never more than it is. */
function percent(share) {
  const hundredths = Math.floor(share * 10000 + 1e-6);
  return `${Math.floor(hundredths / 100)}.${String(hundredths % 100).padStart(2, "0")} %`;
}

function moment(seconds) {
  const two = (number) => String(number).padStart(2, "0");
  const at = new Date(seconds * 1000);
  const day = `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())}`;
  return `${day} ${two(at.getHours())}:${two(at.getMinutes())}`;
}

const shown = (format) => (cell) => (cell.value === null ? "" : format(cell.value));

const isPoor = (row) => row.verdict === "weak" || row.verdict === "unusable";

function nameCell(cell) {
  const link = document.createElement("a");
  link.className = "asset-name";
  link.href = `/assets/${encodeURIComponent(cell.data.id)}`;
  link.tabIndex = -1; // the cell has the focus, and opens by Enter
  link.title = cell.value;
  link.textContent = cell.value;
  return link;
}

/* Of what is to be small: never less than it is. */
function atMost(share) {
  return `${(Math.ceil(share * 10000 - 1e-6) / 100).toFixed(2)} %`;
}

function wordCell(cell) {
  if (cell.value === null) return "";
  const word = document.createElement("span");
  word.className = `verdict ${WORD_CLASS[cell.value] ?? "quiet"}`;
  word.textContent = cell.value;
  return word;
}

function demandCell(cell) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "plain-button";
  button.tabIndex = -1;
  button.textContent = "Set";
  button.setAttribute("aria-label", `Set the thresholds of ${cell.data.name}`);
  return button;
}

function sparkCell(cell) {
  const recalls = cell.value;
  if (recalls.length === 0) return "";
  const { width, height, margin, leastSpan } = SPARK;
  const low = Math.min(...recalls);
  const high = Math.max(...recalls);
  const span = Math.max(high - low, leastSpan);
  const floor = (low + high - span) / 2;
  const step = recalls.length > 1 ? (width - 2 * margin) / (recalls.length - 1) : 0;
  const place = (recall, index) => [
    recalls.length > 1 ? margin + index * step : width - margin,
    height - margin - ((recall - floor) / span) * (height - 2 * margin),
  ];
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("class", "spark");
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", `${recalls.length} runs, ${percent(low)} to ${percent(high)}`);
  const line = document.createElementNS(SVG, "polyline");
  line.setAttribute("points", recalls.map((one, index) => place(one, index).join(",")).join(" "));
  const last = document.createElementNS(SVG, "circle");
  const [x, y] = place(recalls[recalls.length - 1], recalls.length - 1);
  last.setAttribute("cx", x);
  last.setAttribute("cy", y);
  last.setAttribute("r", 2);
  svg.append(line, last);
  return svg;
}

function columns(editable) {
  const number = { type: "rightAligned", cellClass: ["number", "ag-right-aligned-cell"] };
  const narrow = window.innerWidth < NARROW;
  const middle = window.innerWidth < MIDDLE;
  const all = [
    { field: "name", headerName: "Asset", flex: 1, minWidth: 200, cellRenderer: nameCell,
      lockVisible: true },
    { field: "verdict", headerName: "Verdict", width: 104, cellRenderer: wordCell },
    { field: "holds", headerName: "Thresholds", width: 108, cellRenderer: wordCell },
    { field: "precision", headerName: "Precision", width: 96, ...number,
      valueFormatter: shown(percent) },
    { field: "recall", headerName: "Recall", width: 86, ...number, valueFormatter: shown(percent) },
    { field: "recalls", headerName: "Recall so far", width: 114, cellRenderer: sparkCell,
      sortable: false, hide: narrow },
    { field: "worst", headerName: "Worst view", width: 100, ...number, hide: narrow,
      valueFormatter: shown(percent),
      tooltipValueGetter: (cell) => cell.data.worstView === null ? "" : `view ${cell.data.worstView}` },
    { field: "overhang", headerName: "Overhang", width: 96, ...number,
      valueFormatter: shown(atMost) },
    { field: "input", headerName: "Triangles in", width: 108, ...number, hide: middle,
      valueFormatter: shown((value) => value.toLocaleString("en-US")) },
    { field: "triangles", headerName: "Out", width: 64, ...number,
      valueFormatter: shown((value) => value.toLocaleString("en-US")) },
    { field: "seconds", headerName: "Run time", width: 90, ...number, hide: middle,
      valueFormatter: shown((value) => `${value.toFixed(1)} s`) },
    { field: "created", headerName: "Latest run", width: 144, hide: narrow,
      valueFormatter: shown(moment) },
  ];
  if (editable) {
    all.push({ colId: "demand", headerName: "Edit", width: 66, cellRenderer: demandCell,
      sortable: false });
  }
  return all;
}

export default {
  template: `
    <div class="assets">
      <div class="row-of-controls">
        <label class="field">Filter by name
          <input ref="filter" type="search" spellcheck="false" @input="find" />
        </label>
        <label class="field">Show
          <select v-model="wanted" @change="narrow">
            <option value="all">all ({{ counts.all }})</option>
            <option value="missed">thresholds missed ({{ counts.missed }})</option>
            <option value="poor">weak or unusable ({{ counts.poor }})</option>
            <option value="worse">got worse ({{ counts.worse }})</option>
          </select>
        </label>
        <details ref="chooser" class="chooser" @keydown.esc="closeChooser">
          <summary>Columns</summary>
          <fieldset>
            <legend class="for-readers">Columns to show</legend>
            <label v-for="column in choices" :key="column.id">
              <input type="checkbox" v-model="column.visible" @change="choose(column)" />
              {{ column.title }}
            </label>
          </fieldset>
        </details>
        <button type="button" class="plain-button" @click="exportShown">Export as CSV</button>
        <span class="quiet number" role="status">{{ displayed }} shown</span>
      </div>
      <div ref="grid" class="grid"></div>
    </div>`,
  props: { editable: Boolean, source: String },
  data() {
    return {
      wanted: "all",
      displayed: 0,
      counts: { all: 0, missed: 0, poor: 0, worse: 0 },
      choices: [],
    };
  },
  mounted() {
    this.words = []; // all of which a name has to hold
    this.api = AgGrid.createGrid(this.$refs.grid, {
      theme: LOOK,
      columnDefs: columns(this.editable),
      defaultColDef: {
        suppressHeaderMenuButton: true,
        sortingOrder: ["asc", "desc", null],
      },
      rowData: [],
      getRowId: (row) => row.data.id,
      animateRows: false,
      ensureDomOrder: true,
      suppressCellFocus: false,
      tooltipShowDelay: 400,
      localeText: { noRowsToShow: "No asset is like this." },
      isExternalFilterPresent: () => this.wanted !== "all" || this.words.length > 0,
      doesExternalFilterPass: (row) => this.passes(row.data),
      onCellClicked: (event) => this.act(event),
      onCellKeyDown: (event) => event.event.key === "Enter" && this.act(event),
      onModelUpdated: (event) => this.tellCount(event.api),
      onColumnResized: (event) => event.finished && event.source !== "flex" && this.remember(),
      onColumnMoved: (event) => event.finished && this.remember(),
      onColumnVisible: () => this.remember(),
      onSortChanged: () => this.remember(),
    });
    this.$refs.grid.querySelector("[role=grid], [role=treegrid]")?.setAttribute("aria-label", "Assets");
    this.recall();
    document.addEventListener("click", this.closeElsewhere);
    this.load();
  },
  watch: {
    source() {
      this.load();
    },
  },
  unmounted() {
    document.removeEventListener("click", this.closeElsewhere);
    this.api?.destroy();
  },
  methods: {
    /* Rows keep their place by their ids: what is read or chosen stays where it is. */
    async load() {
      if (!this.source) return;
      const source = this.source;
      const rows = await assetsAt(source);
      if (source !== this.source) return; // others were asked for meanwhile
      this.api.setGridOption("rowData", rows);
      this.count();
    },

    find(event) {
      // Not the grid's own filter, which asks all columns for their text.
      this.words = event.target.value.toLowerCase().split(/\s+/).filter(Boolean);
      this.api.onFilterChanged();
    },
    narrow() {
      this.api.onFilterChanged();
    },
    act(event) {
      if (event.column.getColId() === "demand") {
        this.$emit("demand", event.data.id);
      } else if (!event.event.defaultPrevented && !event.event.target.closest?.("a")) {
        window.location.assign(`/assets/${encodeURIComponent(event.data.id)}`);
      }
    },
    exportShown() {
      const ids = [];
      this.api.forEachNodeAfterFilterAndSort((row) => ids.push(row.data.id));
      this.$emit("export", ids);
    },
    choose(column) {
      this.api.setColumnsVisible([column.id], column.visible);
    },
    closeChooser() {
      this.$refs.chooser.open = false;
      this.$refs.chooser.querySelector("summary").focus();
    },
    closeElsewhere(event) {
      if (!this.$refs.chooser.contains(event.target)) this.$refs.chooser.open = false;
    },

    passes(row) {
      if (this.wanted === "missed" && row.holds !== "missed") return false;
      if (this.wanted === "poor" && !isPoor(row)) return false;
      if (this.wanted === "worse" && !row.worse) return false;
      const name = row.name.toLowerCase();
      return this.words.every((word) => name.includes(word));
    },
    tellCount(api) {
      this.displayed = api.getDisplayedRowCount();
      if (this.displayed === 0) api.showNoRowsOverlay();
      else api.hideOverlay();
    },
    count() {
      const counts = { all: 0, missed: 0, poor: 0, worse: 0 };
      this.api.forEachNode((row) => {
        counts.all += 1;
        counts.missed += row.data.holds === "missed";
        counts.poor += isPoor(row.data);
        counts.worse += row.data.worse;
      });
      this.counts = counts;
    },
    remember() {
      try {
        localStorage.setItem(STORED, JSON.stringify(this.api.getColumnState()));
      } catch {} // a browser that keeps nothing forgets the columns, and no more
    },
    recall() {
      try {
        const state = JSON.parse(localStorage.getItem(STORED));
        if (Array.isArray(state)) this.api.applyColumnState({ state, applyOrder: true });
      } catch {}
      this.choices = this.api
        .getColumns()
        .filter((column) => !column.getColDef().lockVisible)
        .map((column) => ({
          id: column.getColId(),
          title: column.getColDef().headerName,
          visible: column.isVisible(),
        }));
    },
  },
};
