/* The rows of all assets, fetched once for all that show them. */

let last = { address: null, rows: null };

/* A promise of them.  An address that was asked for before gives the same rows again. */
export function assetsAt(address) {
  if (last.address !== address) last = { address, rows: fetched(address) };
  return last.rows;
}

/* Rows as they are sent, a list of values each, as objects. */
export function rowsOf({ names, rows }) {
  return rows.map((values) => Object.fromEntries(names.map((name, at) => [name, values[at]])));
}

async function fetched(address) {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`the assets cannot be read: ${answer.status}`);
  return rowsOf(await answer.json());
}
