/* The rows of all assets, fetched once for all that show them. */

let last = { address: null, rows: null };

/* A promise of them.  An address that was asked for before gives the same rows again. */
export function assetsAt(address) {
  if (last.address !== address) last = { address, rows: fetched(address) };
  return last.rows;
}

async function fetched(address) {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`the assets cannot be read: ${answer.status}`);
  return answer.json();
}
