// Visible sets as a job leaves them: cells and objects in plan at once, the set of a cell when it is
// asked for, by the few hundred bytes of a file that it takes.

const known = new Map();

// The sets under an address; parts of one page share them.
export function loadSets(base) {
  if (!known.has(base)) {
    const loading = load(base);
    known.set(base, loading);
    loading.catch(() => known.delete(base));
  }
  return known.get(base);
}

async function load(base) {
  const answer = await fetch(`${base}/plan.json`);
  if (!answer.ok) throw new Error(`the plan is not there (${answer.status})`);
  return new VisibleSets(base, await answer.json());
}

class VisibleSets {
  constructor(base, plan) {
    Object.assign(this, plan); // as service/engines/work/set_view.py writes it
    this.base = base;
    this.sets = new Map();
  }

  // The corners of a cell in plan.
  outline(cell) {
    const at = this.cells[cell];
    if (at.length === 4) return corners(at);
    return [at.slice(0, 2), at.slice(2, 4), at.slice(4, 6)];
  }

  middle(cell) {
    const outline = this.outline(cell);
    return [0, 1].map((axis) => outline.reduce((sum, one) => sum + one[axis], 0) / outline.length);
  }

  // The cells that hold a point of the plan: several, where there are floors.
  at([x, y]) {
    const found = [];
    for (let cell = 0; cell < this.cells.length; cell++)
      if (holds(this.cells[cell], x, y)) found.push(cell);
    return found;
  }

  // The objects of a cell's set, in the scene's order.
  objects(cell) {
    if (!this.sets.has(cell)) {
      const loading = this.loadObjects(cell);
      this.sets.set(cell, loading);
      loading.catch(() => this.sets.delete(cell));
    }
    return this.sets.get(cell);
  }

  async loadObjects(cell) {
    const row = this.rows[cell];
    if (row < 0) return this.order.map((_, place) => place);
    return runs(await this.part("sets.bin", this.offsets[row], this.offsets[row + 1]))
      .flatMap(([first, last]) => this.order.slice(first, last))
      .sort((a, b) => a - b);
  }

  // Some bytes of a file.
  async part(name, begin, end) {
    if (begin === end) return new Uint8Array(0);
    const headers = { Range: `bytes=${begin}-${end - 1}` };
    const answer = await fetch(`${this.base}/${name}`, { headers });
    if (!answer.ok) throw new Error(`the set is not there (${answer.status})`);
    const bytes = new Uint8Array(await answer.arrayBuffer());
    return answer.status === 206 ? bytes : bytes.slice(begin, end);
  }

  // The first and last slice of each object of a cell's set that is drawn, from 1, for each axis of
  // the plan and up; an axis that draws none has 1 and 0.  Null where all are drawn whole.
  async drawn(cell) {
    if (!this.slices || this.rows[cell] < 0) return null;
    const { count, starts } = this.slices;
    const bytes = await this.part("parts.bin", 3 * starts[cell], 3 * starts[cell + 1]);
    const values = new Int8Array(bytes.buffer);
    return Array.from({ length: values.length / 3 }, (_, at) =>
      drawnSlices([...values.subarray(3 * at, 3 * at + 3)], count),
    );
  }

  // The block of each object of a cell's set that no slice draws: from and to in shares of its box,
  // for each axis of the world; null for an object that is drawn whole.
  async hidden(cell) {
    const drawn = await this.drawn(cell);
    if (!drawn) return null;
    const { count } = this.slices;
    const up = "xyz".indexOf(this.up);
    return drawn.map((ranges) => {
      if (ranges.some(([low, high]) => low === 1 && high === count)) return null;
      const block = [];
      ranges.forEach(([low, high], axis) => {
        block[(up + 1 + axis) % 3] = low > 1 ? [0, (low - 1) / count] : [high / count, 1];
      });
      return block;
    });
  }

  // From which height in the world each object of a cell's set is seen; null where that is not
  // known, and for what is seen from any height.
  async seenFrom(cell) {
    if (!this.altitudes || this.rows[cell] < 0) return null;
    const size = 2 * this.boxes.length;
    const bytes = await this.part("altitudes.bin", size * cell, size * (cell + 1));
    const { low, step } = this.altitudes;
    const view = new DataView(bytes.buffer);
    const objects = await this.objects(cell);
    return objects.map((one) => {
      const number = view.getUint16(2 * one, true);
      return number ? low + step * number : null;
    });
  }

  // The names of all objects.
  async names() {
    const answer = await fetch(`${this.base}/names.json`);
    if (!answer.ok) throw new Error(`the names are not there (${answer.status})`);
    return answer.json();
  }

  // A cell in the world: its corners below and above, one after the other around.
  solid(cell) {
    const up = "xyz".indexOf(this.up);
    const world = (point) => {
      const placed = [0, 0, 0];
      point.forEach((value, axis) => (placed[(up + 1 + axis) % 3] = value + this.origin[axis]));
      return placed;
    };
    return this.heights[cell].map((z) => this.outline(cell).map(([x, y]) => world([x, y, z])));
  }
}

export function corners([x0, y0, x1, y1]) {
  return [
    [x0, y0],
    [x1, y0],
    [x1, y1],
    [x0, y1],
  ];
}

// As `drawn` in simplifier/geometry/pvs.py.
function drawnSlices([x, y, z], count) {
  if (!x && !y && !z) return [0, 1, 2].map(() => [1, count]);
  const across = [x, y].map((value) => (value < 0 ? [1 - value, count] : [1, value]));
  return [...across, z > 0 ? [z, count] : [1, 0]];
}

// From where to where visible ones go: lengths in seven bits a byte, hidden and visible in turn.
function runs(bytes) {
  const found = [];
  let [place, number, scale, visible] = [0, 0, 1, false];
  for (const byte of bytes) {
    number += (byte & 127) * scale;
    scale *= 128;
    if (byte & 128) continue;
    if (visible) found.push([place, place + number]);
    place += number;
    [number, scale, visible] = [0, 1, !visible];
  }
  return found;
}

function holds(cell, x, y) {
  if (cell.length === 4) return cell[0] <= x && x <= cell[2] && cell[1] <= y && y <= cell[3];
  const [ax, ay, bx, by, cx, cy] = cell;
  const left = (px, py, qx, qy) => (qx - px) * (y - py) >= (qy - py) * (x - px);
  return left(ax, ay, bx, by) && left(bx, by, cx, cy) && left(cx, cy, ax, ay);
}
