// The original and the levels of its occluder, side by side in one space.
//
// Everything is moved and scaled so that the original's bounding sphere becomes the unit sphere. Both
// files keep their vertices around a centre of their own, and three.js multiplies matrices in 64 bits
// before the graphics card sees them: coordinates of a map do not jitter.

import { GLTFLoader, THREE } from "nicegui-scene";

const SEE_THROUGH = 0.25;

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

  paint({ original, occluder }) {
    this.surface.color.set(original);
    this.cover.color.set(occluder);
  }

  setWireframe(on) {
    this.surface.wireframe = this.cover.wireframe = on;
  }

  setTransparent(on) {
    this.surface.transparent = on;
    this.surface.opacity = on ? SEE_THROUGH : 1;
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
    for (const group of [this.original, this.occluder])
      group.traverse((one) => one.geometry?.dispose());
    for (const material of [this.surface, this.cover]) material.dispose();
  }
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
