/* A chart that is drawn when it comes into sight: its library is larger than all else on a page. */

export default {
  template: `<div ref="chart" role="img" :aria-label="label"></div>`,
  props: { options: Object, label: String },
  mounted() {
    this.seen = new IntersectionObserver((entries) => {
      if (entries.some((entry) => entry.isIntersecting)) this.draw();
    });
    this.seen.observe(this.$refs.chart);
    this.sized = new ResizeObserver(() => this.chart?.resize());
    this.sized.observe(this.$refs.chart);
  },
  unmounted() {
    this.seen.disconnect();
    this.sized.disconnect();
    this.chart?.dispose();
  },
  methods: {
    async draw() {
      this.seen.disconnect();
      const { echarts } = await import("nicegui-echart");
      if (!this.$refs.chart || this.chart) return; // the page is another one by now
      // As SVG, whose text takes on the colours of the page.
      this.chart = echarts.init(this.$refs.chart, null, { renderer: "svg" });
      this.chart.setOption(this.options);
    },
  },
};
