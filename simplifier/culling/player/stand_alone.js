// A page of its own: the walk is in the page.

import { WalkPlayer } from "./player.js";

const host = document.getElementById("walk");
const text = document.getElementById("walk-data").textContent.trim();
const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
new WalkPlayer(host).open(new Blob([bytes]).stream()).catch((error) => {
  host.textContent = `The walk cannot be shown: ${error.message}.`;
  host.setAttribute("role", "alert");
});
