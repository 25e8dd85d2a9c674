// Files and folders that are dropped or chosen, sent one after the other by the browser itself.
// Overrides go along with the mesh that they are named after.

import { filesOf, leftOut, MOST } from "occluder-folders";

const REFUSED = "The connection ended before the answer came.";
const UNFIT = "This file is not sent. It is not in one of the formats above.";
const PARTS = /[^/_.\- ]*[/_.\- ]*/g; // where names may be broken, as in the list of assets
const OVERRIDES = ".overrides.toml"; // in place of the mesh's own ending

function overridesName(mesh) {
  return mesh.replace(/\.[^.]*$/, "") + OVERRIDES;
}

export default {
  template: `
    <div>
      <div class="drop-zone" :class="{ over }" @dragover.prevent="over = true"
           @dragleave="over = false" @drop.prevent="drop">
        <label :for="inputId" class="panel-title">{{ title }}</label>
        <input :id="inputId" ref="input" type="file" multiple :accept="accept" :disabled="busy"
               :aria-describedby="helpId" @change="choose" />
        <label class="folder-choice">or a folder:
          <input type="file" webkitdirectory :disabled="busy" aria-label="A folder"
                 :aria-describedby="helpId" @change="chooseFolder" />
        </label>
        <span :id="helpId" class="option-help">{{ help }}</span>
      </div>
      <p v-if="reading" class="quiet" role="status">Reading the folder, {{ reading }} files so far</p>
      <details v-if="out.length" class="left-out">
        <summary>{{ out.length === 1 ? "1 file is" : out.length + " files are" }} left out</summary>
        <ul>
          <li v-for="one in out.slice(0, 200)" :key="one.path">
            <span class="name">{{ one.path }}</span>: {{ one.reason }}
          </li>
          <li v-if="out.length > 200">and {{ out.length - 200 }} more</li>
        </ul>
      </details>
      <table v-if="files.length" class="upload-list">
        <caption class="for-readers">Files to be sent</caption>
        <tbody>
          <tr v-for="(one, index) in files" :key="one.key" :data-state="one.state">
            <td class="name"><template v-for="part in parts(one.path)">{{ part }}<wbr
              /></template></td>
            <td class="number">{{ size(one.file.size) }}</td>
            <td>
              <progress v-if="one.state === 'sending'" :value="one.share" max="1"
                        :aria-label="'Upload of ' + one.path"></progress>
              <span v-else-if="one.state === 'sent'" class="good">sent</span>
              <div v-else-if="wrong(one)" class="fault name" role="alert">{{ wrong(one) }}</div>
              <span v-else class="quiet name">{{ plan(one) }}</span>
            </td>
            <td class="button-cell">
              <button v-if="one.state !== 'sent'" type="button" @click="remove(index)"
                      :aria-label="(one.state === 'sending' ? 'Stop ' : 'Remove ') + one.path">
                {{ one.state === "sending" ? "Stop" : "Remove" }}
              </button>
            </td>
          </tr>
        </tbody>
      </table>
    </div>`,

  props: { address: String, title: String, accept: String, help: String, overrides: Boolean,
    largest: Number },

  data() {
    return { files: [], out: [], over: false, busy: false, reading: 0, next: 0 };
  },

  computed: {
    inputId() {
      return `${this.$attrs.id}-input`;
    },
    helpId() {
      return `${this.$attrs.id}-help`;
    },
  },

  mounted() {
    this.warn = (event) => {
      if (this.busy) event.preventDefault();
    };
    window.addEventListener("beforeunload", this.warn);
  },

  unmounted() {
    window.removeEventListener("beforeunload", this.warn);
  },

  methods: {
    size(bytes) {
      if (bytes < 1e3) return `${bytes} B`;
      if (bytes < 1e6) return `${(bytes / 1e3).toFixed(1)} kB`;
      return bytes < 1e9 ? `${(bytes / 1e6).toFixed(1)} MB` : `${(bytes / 1e9).toFixed(2)} GB`;
    },

    parts(name) {
      return name.match(PARTS).filter(Boolean);
    },

    choose(event) {
      this.add([...event.target.files].map((file) => ({ file, path: file.name })));
      event.target.value = ""; // the same file may be chosen again
    },

    chooseFolder(event) {
      const found = [...event.target.files].map((file) => ({ file, path: file.webkitRelativePath }));
      this.addFolder(found);
      event.target.value = "";
    },

    async drop(event) {
      this.over = false;
      if (this.busy) return;
      // What was dropped is gone after this call; only what is taken out of it stays.
      const entries = [...event.dataTransfer.items].map((one) => one.webkitGetAsEntry?.());
      const folders = entries.filter((one) => one?.isDirectory);
      const files = [...event.dataTransfer.files].filter((_, at) => !entries[at]?.isDirectory);
      this.add(files.map((file) => ({ file, path: file.name })));
      if (!folders.length) return;
      this.reading = 1;
      this.addFolder(await filesOf(folders, (count) => (this.reading = count)));
      this.reading = 0;
    },

    // What of a folder can be sent; all else is listed with its reason.
    addFolder(found) {
      const wanted = found.map((one) => ({
        ...one, reason: one.reason ?? leftOut(one, this.accept.split(","), this.largest),
      }));
      const good = wanted.filter((one) => !one.reason);
      this.out = [
        ...wanted.filter((one) => one.reason),
        ...good.splice(MOST).map((one) => ({ ...one, reason: `more than ${MOST} files at once` })),
      ].map(({ path, reason }) => ({ path, reason }));
      this.add(good);
    },

    // The same place again takes the place of what was chosen before.
    add(files) {
      const again = new Set(files.map((one) => one.path));
      const folder = (path) => path.includes("/");
      this.files = this.files.filter(
        (one) => one.state === "sent" || one.state === "sending" || !again.has(one.path)
          || !(one.overrides || folder(one.path)),
      );
      for (const { file, path } of files) {
        const overrides = this.overrides && /\.toml$/i.test(file.name);
        this.files.push({
          key: this.next++, file, path, overrides, state: "chosen", share: 0, fault: "",
        });
      }
      this.tell();
    },

    remove(index) {
      const one = this.files[index];
      one.stop?.();
      this.files.splice(index, 1);
      this.tell();
    },

    waiting() {
      return this.files.filter(
        (one) => !one.overrides && this.fits(one)
          && (one.state === "chosen" || one.state === "refused"),
      );
    },

    // Whether its name ends as that of one of the formats.
    fits(one) {
      return this.accept.split(",").some((suffix) => one.path.toLowerCase().endsWith(suffix));
    },

    // Whether these are overrides of that name that a mesh may still take along.
    awaits(one, name) {
      return one.overrides && one.state !== "sent" && one.path === name;
    },

    overridesOf(mesh) {
      return this.files.find((one) => this.awaits(one, overridesName(mesh.path)));
    },

    meshesOf(overrides) {
      return this.files.filter(
        (one) => !one.overrides && one.state !== "sent" && this.overridesOf(one) === overrides,
      );
    },

    wrong(one) {
      if (!one.overrides) return this.fits(one) ? one.fault : UNFIT;
      if (!one.file.name.endsWith(OVERRIDES)) {
        return `Overrides are named after their mesh: castle${OVERRIDES} for castle.glb.`;
      }
      if (this.meshesOf(one).length) return "";
      const stem = one.file.name.slice(0, -OVERRIDES.length);
      return `Its mesh is missing. Choose ${stem}.glb, or ${stem} in another format, as well.`;
    },

    plan(one) {
      if (!one.overrides) return "to be sent";
      return `goes with ${this.meshesOf(one).map((mesh) => mesh.path).join(", ")}`;
    },

    tell() {
      this.$emit("chosen", this.waiting().map((one) => one.path));
    },

    // Each file with the same settings; `assets` has a name for each, empty for none.
    async send(settings, assets) {
      this.busy = true;
      const files = this.waiting();
      for (const [place, one] of files.entries()) {
        if (!this.files.includes(one)) continue; // removed meanwhile
        const query = new URLSearchParams(settings);
        if (assets[place]) query.set("asset", assets[place]);
        const overrides = this.overridesOf(one);
        const answer = await this.post(one, overrides, query);
        if (!answer) continue;
        if (overrides && !this.meshesOf(overrides).length) overrides.state = "sent";
        this.$emit("sent", answer);
      }
      this.busy = false;
      this.tell();
      this.$emit("done");
    },

    post(one, overrides, query) {
      let body = one.file;
      if (overrides) {
        body = new FormData();
        body.append("mesh", one.file);
        body.append("overrides", overrides.file);
      } else {
        query.set("filename", one.file.name);
      }
      Object.assign(one, { state: "sending", share: 0, fault: "" });
      return new Promise((resolve) => {
        const request = new XMLHttpRequest();
        one.stop = () => request.abort();
        request.upload.onprogress = (event) => {
          one.share = event.total ? event.loaded / event.total : 0;
        };
        request.onload = () => resolve(this.answered(one, request));
        request.onerror = () => resolve(this.refuse(one, REFUSED));
        request.onabort = () => resolve(null);
        request.open("POST", `${this.address}?${query}`);
        if (!overrides) request.setRequestHeader("Content-Type", "application/octet-stream");
        request.setRequestHeader("Accept", "application/json");
        request.send(body);
      });
    },

    answered(one, request) {
      const place = request.getResponseHeader("Location");
      if (request.status >= 200 && request.status < 300 && place) {
        one.state = "sent";
        return { job: place.split("/").pop() };
      }
      return this.refuse(one, this.fault(request));
    },

    refuse(one, fault) {
      Object.assign(one, { state: "refused", fault });
      return null;
    },

    fault(request) {
      try {
        const { detail, remedy } = JSON.parse(request.responseText);
        return [detail, remedy].filter(Boolean).map(this.sentence).join(" ");
      } catch {
        return `The service answered ${request.status} ${request.statusText}.`;
      }
    },

    sentence(text) {
      const named = text.split(" ", 1)[0].endsWith(":");
      return `${named ? text[0] : text[0].toUpperCase()}${text.slice(1)}.`;
    },
  },
};
