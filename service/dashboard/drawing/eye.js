// Where one looks from: a camera that turns about the middle of the unit sphere.
//
// Views of one group look from the same place: what turns one turns all.

import { OrbitControls, THREE } from "nicegui-scene";

const FIELD = 35; // degrees, upright
const AWAY = 3; // of the orthographic camera, which sees the same from any distance
const AROUND = 1.06; // a margin
const STEP = Math.PI / 18;
const ZOOM = 1.2;
const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
// From the front, a little to the right and above, whichever axis is up.
const FRONT = { x: [0.35, -0.6, 1], y: [0.6, 0.35, 1], z: [0.6, -1, 0.35] };

const groups = new Map();

export class Eye {
  constructor(element, up, moved) {
    this.moved = moved;
    this.upward = new THREE.Vector3(...AXES[up]);
    this.front = new THREE.Vector3(...FRONT[up]).normalize();
    this.perspective = new THREE.PerspectiveCamera(FIELD, 1, 0.01, 100);
    this.orthographic = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.01, 2 * AWAY);
    this.perspective.up.copy(this.upward);
    this.orthographic.up.copy(this.upward);
    this.headlight = new THREE.Group();
    const lamp = new THREE.DirectionalLight("#ffffff", 1.6);
    lamp.position.set(0.4, 0.6, 1);
    this.headlight.add(lamp, lamp.target, new THREE.AmbientLight("#ffffff", 1.1));
    this.camera = this.perspective;
    this.controls = new OrbitControls(this.camera, element);
    this.controls.minDistance = 0.2;
    this.controls.maxDistance = 40;
    this.controls.minZoom = 0.2;
    this.controls.maxZoom = 40;
    this.controls.addEventListener("change", () => {
      this.fitted = false;
      this.changed();
    });
    this.aspect = 1;
    this.fitted = true; // nobody has come nearer, gone away or aside
    this.given = this.front.clone().negate(); // the line of sight that the page asks for
    this.place(this.given, AWAY);
    this.frame({ min: { x: -1, y: -1, z: -1 }, max: { x: 1, y: 1, z: 1 } });
  }

  // The line of sight, a unit vector.
  get direction() {
    return this.controls.target.clone().sub(this.camera.position).normalize();
  }

  // Where a box fills the picture, as seen along a direction.
  distance(direction) {
    const turn = new THREE.Object3D(); // unlike a camera, it turns its +z to what it looks at
    turn.up.copy(this.upward);
    turn.lookAt(direction.clone().negate());
    const upright = Math.tan((FIELD / 360) * Math.PI);
    const across = upright * this.aspect;
    const away = this.corners.map((corner) => {
      const { x, y, z } = corner.clone().applyQuaternion(turn.quaternion.clone().invert());
      return z + Math.max(Math.abs(x) / across, Math.abs(y) / upright);
    });
    return AROUND * Math.max(...away);
  }

  // A box that is to be in view, in units of the bounding sphere.
  frame({ min, max }) {
    this.corners = [0, 1, 2, 3, 4, 5, 6, 7].map(
      (bits) =>
        new THREE.Vector3(
          bits & 1 ? max.x : min.x,
          bits & 2 ? max.y : min.y,
          bits & 4 ? max.z : min.z,
        ),
    );
    this.lookAlong(this.direction);
  }

  // What an accuracy report sees along the same line: the whole sphere, and nothing else.
  whole() {
    const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.01, 2 * AWAY);
    camera.up.copy(this.upward);
    camera.position.copy(this.direction).multiplyScalar(-AWAY);
    camera.lookAt(0, 0, 0);
    camera.updateMatrixWorld();
    return camera;
  }

  join(name) {
    this.leave();
    this.group = groups.get(name) ?? new Set();
    this.group.add(this);
    groups.set(name, this.group);
    this.name = name;
  }

  leave() {
    this.group?.delete(this);
    if (this.group?.size === 0) groups.delete(this.name);
    this.group = null;
  }

  reset() {
    this.lookAlong(this.front.clone().negate());
  }

  // Where one stands, looks to, and how near, as text; empty where all is seen as the page asks.
  get told() {
    if (this.fitted && this.direction.distanceTo(this.given) < 1e-3) return "";
    const numbers = [...this.camera.position, ...this.controls.target, this.camera.zoom];
    return numbers.map((one) => Number(one.toFixed(3))).join(",");
  }

  stand(told) {
    const numbers = told.split(",").map(Number);
    if (numbers.length !== 7 || !numbers.every(Number.isFinite) || numbers[6] <= 0) return;
    const target = new THREE.Vector3(...numbers.slice(3, 6));
    const position = new THREE.Vector3(...numbers.slice(0, 3));
    if (position.distanceTo(target) < this.controls.minDistance) return;
    this.controls.target.copy(target);
    this.camera.position.copy(position);
    this.camera.zoom = numbers[6];
    this.fitted = false;
    this.changed();
  }

  // From outside towards the middle, all of the sphere in view.
  lookAlong(direction) {
    this.fitted = true;
    this.controls.target.set(0, 0, 0);
    this.camera.zoom = 1;
    this.place(direction, this.camera === this.perspective ? this.distance(direction) : AWAY);
    this.changed();
  }

  // Keep the line of sight, with the other kind of camera.
  setOrthographic(on) {
    const wanted = on ? this.orthographic : this.perspective;
    if (this.camera === wanted) return;
    const direction = this.direction;
    this.camera = this.controls.object = wanted;
    this.lookAlong(direction);
  }

  setAspect(aspect) {
    this.aspect = aspect;
    this.perspective.aspect = aspect;
    this.orthographic.right = Math.max(1, aspect);
    this.orthographic.top = Math.max(1, 1 / aspect);
    this.orthographic.left = -this.orthographic.right;
    this.orthographic.bottom = -this.orthographic.top;
    this.perspective.updateProjectionMatrix();
    this.orthographic.updateProjectionMatrix();
    if (this.fitted) this.lookAlong(this.direction);
  }

  // Whether the key means anything here.
  press(key) {
    const turns = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (key in turns) this.turn(...turns[key].map((steps) => steps * STEP));
    else if (key === "+" || key === "=") this.zoom(ZOOM);
    else if (key === "-" || key === "_") this.zoom(1 / ZOOM);
    else if (key === "0") this.reset();
    else return false;
    return true;
  }

  dispose() {
    this.leave();
    this.controls.dispose();
  }

  // Radians about the up axis and away from it.
  turn(around, down) {
    const upright = new THREE.Quaternion().setFromUnitVectors(
      this.upward,
      new THREE.Vector3(0, 1, 0),
    );
    const offset = this.camera.position.clone().sub(this.controls.target);
    const ball = new THREE.Spherical().setFromVector3(offset.applyQuaternion(upright));
    ball.theta -= around;
    ball.phi += down;
    ball.makeSafe();
    offset.setFromSpherical(ball).applyQuaternion(upright.invert());
    this.camera.position.copy(this.controls.target).add(offset);
    this.fitted = false;
    this.changed();
  }

  zoom(factor) {
    if (this.camera === this.orthographic) this.camera.zoom *= factor;
    else this.camera.position.sub(this.controls.target).divideScalar(factor).add(this.controls.target);
    this.fitted = false;
    this.changed();
  }

  place(direction, distance) {
    this.camera.position.copy(this.controls.target).addScaledVector(direction, -distance);
  }

  changed() {
    this.settle();
    this.moved();
    for (const other of this.group ?? []) if (other !== this) other.follow(this);
  }

  follow(other) {
    this.controls.target.copy(other.controls.target);
    this.place(other.direction, other.camera.position.distanceTo(other.controls.target));
    this.camera.zoom = other.camera.zoom;
    this.fitted = other.fitted;
    this.settle();
    this.moved();
  }

  settle() {
    this.camera.lookAt(this.controls.target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.headlight.position.copy(this.camera.position);
    this.headlight.quaternion.copy(this.camera.quaternion);
  }
}
