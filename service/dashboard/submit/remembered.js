// Values that this browser keeps for a page.

export default {
  template: `<span hidden></span>`,
  props: { name: String },

  mounted() {
    let kept = null;
    try {
      kept = JSON.parse(localStorage.getItem(this.name));
    } catch {
      // Kept by somebody else, or not to be read: as if nothing was.
    }
    this.$emit("kept", kept);
  },

  methods: {
    keep(values) {
      try {
        localStorage.setItem(this.name, JSON.stringify(values));
      } catch {
        // A browser that keeps nothing goes without.
      }
    },
  },
};
