// The original and the levels of its occluder, side by side in one space.
//
// Everything is moved and scaled so that the original's bounding sphere becomes the unit sphere. Both
// files keep their vertices around a centre of their own, and three.js multiplies matrices in 64 bits
// before the graphics card sees them: coordinates of a map do not jitter.

import { GLTFLoader, THREE } from "nicegui-scene";

const SEE_THROUGH = 0.25;
const GHOST = 0.12; // of many objects, one behind the other
const MARK = "#d6006c";
const PIN = 0.12; // of the bounding sphere's radius

export class Pieces {
  constructor() {
    this.scene = new THREE.Scene();
    this.world = new THREE.Group();
    this.original = new THREE.Group();
    this.occluder = new THREE.Group();
    this.world.add(this.original, this.occluder);
    this.scene.add(this.world);
    // The original gives way where both lie in one plane.
    this.surface = new THREE.MeshLambertMaterial({
      side: THREE.DoubleSide,
      flatShading: true,
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
    });
    this.cover = new THREE.MeshLambertMaterial({ side: THREE.DoubleSide, flatShading: true });
    this.marked = new THREE.Group();
    this.world.add(this.marked);
    this.loader = new GLTFLoader();
    this.levels = new Map();
  }

  // Gives the box that it lies in, in units of its sphere.  Raises what the loader does, also for a
  // file that does not tell its bounding sphere.
  async loadOriginal(url) {
    const loaded = (await this.loader.loadAsync(url)).scene;
    const sphere = find(loaded, (one) => one.userData.bounding_sphere);
    if (!sphere) throw new Error("the file tells no bounding sphere");
    const { centre, radius } = sphere.userData.bounding_sphere;
    this.centre = new THREE.Vector3(...centre);
    this.world.scale.setScalar(1 / radius);
    this.world.position.fromArray(centre).multiplyScalar(-1 / radius);
    this.original.add(dressed(loaded, this.surface));
    this.world.updateMatrixWorld();
    return new THREE.Box3().setFromObject(this.original);
  }

  // Show one level; each file is loaded once.
  async loadLevel(url) {
    if (!this.levels.has(url)) {
      this.levels.set(
        url,
        this.loader.loadAsync(url).then((file) => dressed(file.scene, this.cover)),
      );
    }
    try {
      const level = await this.levels.get(url);
      this.occluder.clear();
      this.occluder.add(level);
    } catch (error) {
      this.levels.delete(url);
      throw error;
    }
  }

  // In place of a level: some objects of the original, which has so many triangles of each in turn,
  // less what lies in the block of each, in shares of its box; null where there are no blocks.
  showObjects(objects, triangles, blocks) {
    const whole = find(this.original, (one) => one.isMesh);
    const starts = [0];
    for (const count of triangles) starts.push(starts.at(-1) + 3 * count);
    const total = objects.reduce((sum, one) => sum + triangles[one], 0);
    const indices = new Uint32Array(3 * total);
    let end = 0;
    const points = whole.geometry.attributes.position;
    objects.forEach((one, at) => {
      const all = whole.geometry.index.array.subarray(starts[one], starts[one + 1]);
      const own = blocks?.[at] ? outOfBlock(all, points, blocks[at]) : all;
      indices.set(own, end);
      end += own.length;
    });
    const geometry = new THREE.BufferGeometry();
    for (const [name, values] of Object.entries(whole.geometry.attributes))
      geometry.setAttribute(name, values);
    geometry.setIndex(new THREE.BufferAttribute(indices.subarray(0, end), 1));
    // Only the indices are its own.
    for (const old of this.occluder.children) old.geometry.dispose();
    this.occluder.clear();
    const shown = new THREE.Mesh(geometry, this.cover);
    whole.updateWorldMatrix(true, false);
    this.world.updateWorldMatrix(true, false);
    shown.matrixAutoUpdate = false;
    shown.matrix.copy(this.world.matrixWorld).invert().multiply(whole.matrixWorld);
    this.occluder.add(shown);
    this.ghost = GHOST;
    this.setTransparent(this.surface.transparent);
  }

  // A cell, seen through all that stands before it: its corners below and above, in world units.
  showCell([below, above]) {
    const place = (corner) => new THREE.Vector3(...corner).sub(this.centre);
    const ends = below.flatMap((corner, at) => {
      const next = (at + 1) % below.length;
      return [corner, below[next], above[at], above[next], corner, above[at]].map(place);
    });
    for (const old of this.marked.children) {
      old.geometry.dispose();
      old.material.dispose();
    }
    this.marked.clear();
    const sides = below.flatMap((corner, at) => {
      const next = (at + 1) % below.length;
      return [corner, below[next], above[next], corner, above[next], above[at]].map(place);
    });
    const style = { color: MARK, depthTest: false, transparent: true };
    const edges = new THREE.LineSegments(
      new THREE.BufferGeometry().setFromPoints(ends),
      new THREE.LineBasicMaterial(style),
    );
    const faces = new THREE.Mesh(
      new THREE.BufferGeometry().setFromPoints(sides),
      new THREE.MeshBasicMaterial({ ...style, opacity: 0.45, side: THREE.DoubleSide }),
    );
    this.marked.position.copy(this.centre);
    this.marked.renderOrder = 1;
    this.marked.add(faces, edges, this.pin(below.map(place), above.map(place)));
  }

  // Stands on a cell, so that it is found in a town.
  pin(below, above) {
    const upward = above[0].clone().sub(below[0]).normalize();
    const high = PIN / this.world.scale.x;
    const pin = new THREE.Mesh(
      new THREE.ConeGeometry(0.25 * high, high, 24),
      new THREE.MeshLambertMaterial({ color: MARK, depthTest: false, transparent: true }),
    );
    const top = above.reduce((sum, one) => sum.add(one), new THREE.Vector3());
    pin.position.copy(top.divideScalar(above.length)).addScaledVector(upward, 0.5 * high);
    pin.quaternion.setFromUnitVectors(new THREE.Vector3(0, -1, 0), upward);
    return pin;
  }

  paint({ original, occluder }) {
    this.surface.color.set(original);
    this.cover.color.set(occluder);
  }

  setWireframe(on) {
    this.surface.wireframe = this.cover.wireframe = on;
  }

  setTransparent(on) {
    this.surface.transparent = on;
    this.surface.opacity = on ? (this.ghost ?? SEE_THROUGH) : 1;
    this.surface.depthWrite = !on;
    this.surface.needsUpdate = true;
  }

  show({ original, occluder }) {
    this.original.visible = original;
    this.occluder.visible = occluder;
  }

  triangles() {
    return { original: count(this.original), occluder: count(this.occluder) };
  }

  dispose() {
    for (const group of [this.original, this.occluder, this.marked])
      group.traverse((one) => one.geometry?.dispose());
    for (const material of [this.surface, this.cover]) material.dispose();
  }
}

// The triangles of an object, three indices each, that reach out of a block of its box.  What meets a
// side of the box reaches out of it nowhere.
function outOfBlock(indices, points, block) {
  const limits = block.map(([from, to], axis) => {
    let [low, high] = [Infinity, -Infinity];
    for (const index of indices) {
      low = Math.min(low, points.getComponent(index, axis));
      high = Math.max(high, points.getComponent(index, axis));
    }
    const at = (share) => low + share * (high - low);
    return [from > 0 ? at(from) : -Infinity, to < 1 ? at(to) : Infinity];
  });
  const inside = (index) =>
    limits.every(([low, high], axis) => {
      const value = points.getComponent(index, axis);
      return low <= value && value <= high;
    });
  return indices.filter((_, place) => {
    const first = place - (place % 3);
    return ![0, 1, 2].every((corner) => inside(indices[first + corner]));
  });
}

function dressed(root, material) {
  root.traverse((one) => {
    if (!one.isMesh) return;
    one.material.dispose();
    one.material = material;
  });
  return root;
}

function find(root, wanted) {
  let found = null;
  root.traverse((one) => {
    if (!found && wanted(one)) found = one;
  });
  return found;
}

function count(group) {
  let total = 0;
  group.traverse((one) => {
    if (one.isMesh) total += (one.geometry.index ?? one.geometry.attributes.position).count / 3;
  });
  return total;
}
