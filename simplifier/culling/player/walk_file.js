// A walk as simplifier/culling/walk_file.py writes it, read.

const MAGIC = 0x4b4c574f; // "OWLK"
const TYPES = { "<f4": Float32Array, "<u4": Uint32Array, "<u2": Uint16Array, "|u1": Uint8Array };
const PLANES = 3;

// Give the walk that a response or a blob holds.
export async function readWalk(stream) {
  const plain = stream.pipeThrough(new DecompressionStream("gzip"));
  const buffer = await new Response(plain).arrayBuffer();
  const view = new DataView(buffer);
  if (buffer.byteLength < 8 || view.getUint32(0, true) !== MAGIC) throw new Error("this is no walk");
  const start = 8 + view.getUint32(4, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, start - 8)));
  if (header.version !== 1) throw new Error("it was made by another version; make it again");
  const arrays = {};
  for (const [name, { at, type, shape }] of Object.entries(header.arrays))
    arrays[name] = new TYPES[type](buffer, start + at, shape.reduce((all, one) => all * one, 1));
  const walk = { ...header, ...arrays };
  walk.fates = fatesOf(walk);
  walk.drawn = drawnOf(walk);
  return walk;
}

// A row of bytes a frame from what changes from one to the next.
function rows(changes, frames) {
  const wide = changes.length / frames;
  const all = Uint8Array.from(changes);
  for (let at = wide; at < all.length; at += 1) all[at] ^= all[at - wide];
  return Array.from({ length: frames }, (_, frame) => all.subarray(frame * wide, (frame + 1) * wide));
}

const bit = (row, from, at) => (row[from + (at >> 3)] >> (at & 7)) & 1;

function fatesOf({ fates, frames, parts }) {
  const wide = Math.ceil(parts / 8);
  return rows(fates, frames).map((row) =>
    Uint8Array.from({ length: parts }, (_, part) => {
      let fate = 0;
      for (let plane = 0; plane < PLANES; plane += 1) fate |= bit(row, plane * wide, part) << plane;
      return fate;
    }),
  );
}

function drawnOf({ drawn, frames, occluders }) {
  if (occluders === 0) return Array.from({ length: frames }, () => new Uint8Array(0));
  return rows(drawn, frames).map((row) =>
    Uint8Array.from({ length: occluders }, (_, one) => bit(row, 0, one)),
  );
}

// Where the camera is between two frames: { position, right, up, forward, fov, near }.
export function cameraAt({ cameras, frames }, time) {
  const from = Math.min(Math.floor(time), frames - 1);
  const to = Math.min(from + 1, frames - 1);
  const share = time - from;
  const mixed = Array.from({ length: 14 }, (_, at) => {
    const [one, other] = [cameras[14 * from + at], cameras[14 * to + at]];
    return one + (other - one) * share;
  });
  const forward = unit(mixed.slice(9, 12));
  const right = unit(cross(forward, mixed.slice(6, 9)));
  return {
    position: mixed.slice(0, 3), right, up: cross(right, forward), forward,
    fov: mixed[12], near: mixed[13],
  };
}

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];
export const unit = (a) => a.map((one) => one / (Math.hypot(...a) || 1));
export const along = (a, b, share) => a.map((one, at) => one + share * b[at]);
