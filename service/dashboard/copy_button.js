// The address of the page as it is shown now, to be sent to somebody.

import "occluder-address";

const SAID = 2500; // milliseconds

// Where the page did not come by HTTPS, browsers have no clipboard to write to but this.
function copyByCommand(text) {
  const field = Object.assign(document.createElement("textarea"), { value: text });
  field.setAttribute("readonly", "");
  field.style.position = "fixed";
  document.body.append(field);
  field.select();
  const done = document.execCommand("copy");
  field.remove();
  return done;
}

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return copyByCommand(text);
  }
}

export default {
  template: `
    <span class="copy-button">
      <button type="button" class="plain-button" @click="copy">{{ title }}</button>
      <span class="quiet" role="status">{{ said }}</span>
    </span>`,
  props: { title: String, text: String },

  data() {
    return { said: "" };
  },

  methods: {
    async copy() {
      const done = await copy(this.text ?? window.location.href);
      this.said = done ? "Copied" : "The browser does not allow copying";
      clearTimeout(this.timer);
      this.timer = setTimeout(() => (this.said = ""), SAID);
    },
  },
};
