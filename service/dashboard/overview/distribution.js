/* One point an asset, precision against recall.  The table beside it says the same in words. */

import { assetsAt } from "occluder-assets";

const SERIES = [
  { name: "missed", symbol: "triangle", colour: "--bad" },
  { name: "others", symbol: "circle", colour: "--accent" },
];
const percent = (share) => `${(Math.floor(share * 10000 + 1e-6) / 100).toFixed(2)} %`;

export default {
  template: `
    <details class="fold" @toggle="open($event.target.open)">
      <summary>Precision against recall</summary>
      <div ref="chart" class="distribution" role="img"
        aria-label="Precision against recall, one point an asset. The list has the same figures."></div>
    </details>`,
  props: { source: String },
  data() {
    return { points: [] };
  },
  mounted() {
    this.sized = new ResizeObserver(() => this.chart?.resize());
    this.sized.observe(this.$refs.chart);
    this.coloured = new MutationObserver(() => this.draw());
    this.coloured.observe(document.body, { attributes: true, attributeFilter: ["class"] });
  },
  watch: {
    source() {
      this.load();
    },
  },
  unmounted() {
    this.sized.disconnect();
    this.coloured.disconnect();
    this.chart?.dispose();
  },
  methods: {
    // The library that draws it is larger than all else on the page.
    async open(opened) {
      if (!opened || this.chart) return;
      const { echarts } = await import("nicegui-echart");
      this.chart = echarts.init(this.$refs.chart);
      this.chart.on("click", (event) => {
        const point = this.points[event.data?.[2]];
        if (point) window.location.assign(`/assets/${encodeURIComponent(point.id)}`);
      });
      await this.load();
    },

    async load() {
      if (!this.chart) return;
      const source = this.source;
      const rows = await assetsAt(source);
      if (source !== this.source) return; // others were asked for meanwhile
      this.points = rows.filter((row) => row.precision !== null && row.recall !== null);
      this.draw();
    },
    draw() {
      if (!this.chart) return;
      const colour = (name) => getComputedStyle(document.body).getPropertyValue(name).trim();
      const text = { color: colour("--quiet"), fontSize: 12 };
      const axis = (name, step) => ({
        name,
        nameLocation: "middle",
        nameTextStyle: text,
        type: "value",
        max: 1,
        min: (range) => Math.max(0, Math.floor(Math.min(range.min, 0.99) / step + 1e-6) * step),
        axisLabel: { ...text, formatter: (value) => `${Math.round(value * 1000) / 10} %` },
        axisLine: { show: true, lineStyle: { color: colour("--line") } },
        splitLine: { lineStyle: { color: colour("--line") } },
        splitNumber: 5,
      });
      const of = (missed) =>
        this.points
          .map((point, index) => [point.precision, point.recall, index])
          .filter((row) => (this.points[row[2]].holds === "missed") === missed);
      this.chart.setOption(
        {
          animation: false,
          grid: { left: 62, right: 18, top: 34, bottom: 46 },
          legend: { top: 0, left: 0, textStyle: text, itemGap: 16, itemWidth: 10, itemHeight: 10 },
          // As text on the canvas: a name that holds markup stays a name.
          tooltip: {
            renderMode: "richText",
            confine: true,
            backgroundColor: colour("--raised"),
            borderColor: colour("--line"),
            textStyle: { color: colour("--text"), fontSize: 12, width: 300, overflow: "break" },
            formatter: (event) => {
              const point = this.points[event.data[2]];
              // Braces would begin a style of their own.
              const name = point.name.replace(/[{}|]/g, " ");
              return `${name}\nprecision ${percent(point.precision)}, recall ${percent(point.recall)}`;
            },
          },
          xAxis: { ...axis("Precision", 0.01), nameGap: 28 },
          yAxis: { ...axis("Recall", 0.2), nameGap: 46 },
          series: SERIES.map((one) => ({
            name: one.name === "missed" ? "below a threshold" : "all others",
            type: "scatter",
            symbol: one.symbol,
            symbolSize: one.name === "missed" ? 7 : 5,
            large: true,
            largeThreshold: 2000,
            itemStyle: { color: colour(one.colour), opacity: 0.7 },
            data: of(one.name === "missed"),
          })),
        },
        { notMerge: true },
      );
    },
  },
};
