// What is in folders that are dropped, and what of it is left out.

export const MOST = 1000; // files that are sent at once
const LOOKED_AT = 20000; // in folders; a home folder dropped by mistake has millions

// All files below some folders: { file, path }, by their paths; `tell` hears how many there are.
export async function filesOf(folders, tell) {
  const found = [];
  const waiting = [...folders];
  while (waiting.length && found.length < LOOKED_AT) {
    const folder = waiting.shift();
    for (const entry of await entriesOf(folder)) {
      if (entry.isDirectory) waiting.push(entry);
      else found.push(await fileOf(entry));
    }
    tell(found.length);
  }
  const rest = waiting.map((one) => ({
    path: pathOf(one), reason: `a folder beyond ${LOOKED_AT.toLocaleString("en")} files`,
  }));
  return [...found.sort((one, other) => (one.path < other.path ? -1 : 1)), ...rest];
}

// Why a file of a folder is not sent; empty for one that is.
export function leftOut({ file, path }, suffixes, largest) {
  if (path.split("/").some((one) => one.startsWith("."))) return "hidden";
  if (!suffixes.some((one) => path.toLowerCase().endsWith(one))) return "not one of the formats";
  if (path.toLowerCase().endsWith(".toml") && !path.endsWith(".overrides.toml")) return "no overrides";
  if (file.size === 0) return "empty";
  if (file.size > largest) return `larger than ${(largest / 1e6).toLocaleString("en")} MB`;
  return "";
}

const pathOf = (entry) => entry.fullPath.replace(/^\//, "");

// A folder tells some hundred of its entries at a time, and none once it has told all.
async function entriesOf(folder) {
  const reader = folder.createReader();
  const all = [];
  for (;;) {
    const some = await new Promise((resolve) => reader.readEntries(resolve, () => resolve([])));
    if (!some.length) return all;
    all.push(...some);
  }
}

function fileOf(entry) {
  const path = pathOf(entry);
  return new Promise((resolve) =>
    entry.file((file) => resolve({ file, path }), () => resolve({ path, reason: "it cannot be read" })),
  );
}
