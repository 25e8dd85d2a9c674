// A page of its own: the walk is in the page, and what is shown of it in the address, behind the #,
// which pages from a folder may change, too.

import { WalkPlayer } from "./player.js";

const host = document.getElementById("walk");
const text = document.getElementById("walk-data").textContent.trim();
const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
const kept = Object.fromEntries(new URLSearchParams(window.location.hash.slice(1)));
function changed(shown) {
  const told = Object.entries(shown).filter(([, value]) => value);
  window.history.replaceState(null, "", `#${new URLSearchParams(told)}`);
}
new WalkPlayer(host, { kept, changed }).open(new Blob([bytes]).stream()).catch((error) => {
  host.textContent = `The walk cannot be shown: ${error.message}.`;
  host.setAttribute("role", "alert");
});
