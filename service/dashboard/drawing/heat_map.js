// Where recall is lost, painted on the original.
//
// The file counts in cells of the cube around the bounding sphere, which is the unit sphere here. A
// fragment takes the mean of the cells around it, each for as much as it is to be trusted: those that
// no view sees have no say.

import { THREE } from "nicegui-scene";

const VERTEX = `
  out vec3 place;
  void main() {
    vec4 world = modelMatrix * vec4(position, 1.0);
    place = world.xyz;
    gl_Position = projectionMatrix * viewMatrix * world;
  }`;
// Little light and shade, which would else be taken for the scale's.
const FRAGMENT = `
  precision highp sampler3D;
  uniform sampler3D cells;
  uniform vec3 ramp[STOPS];
  uniform vec3 unseen;
  in vec3 place;
  out vec4 colour;
  void main() {
    vec2 found = texture(cells, 0.5 * (place + 1.0)).rg;
    vec3 paint = unseen;
    if (found.g > 0.004) {
      float at = clamp(found.r / found.g, 0.0, 1.0) * float(STOPS - 1);
      int low = min(int(at), STOPS - 2);
      paint = mix(ramp[low], ramp[low + 1], at - float(low));
    }
    vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
    vec3 sight = normalize(cameraPosition - place);
    colour = vec4(paint * (0.86 + 0.14 * abs(dot(normal, sight))), 1.0);
  }`;

// The share of each cell times its trust, and the trust; as `simplifier.save_loss_map` writes it.
export async function loadLoss(url) {
  const answer = await fetch(url);
  const told = await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Error(told.detail ?? `the service answers ${answer.status}`);
  const packed = Uint8Array.from(atob(told.data), (one) => one.charCodeAt(0));
  const unpacking = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const cells = new Uint8Array(await new Response(unpacking).arrayBuffer());
  for (let at = 0; at < cells.length; at += 2)
    cells[at] = Math.round((cells[at] * cells[at + 1]) / 255);
  return { ...told, data: cells };
}

export class HeatMap {
  // The ramp: what no view sees, then from nothing lost to all; each red, green, blue to 255.
  constructor([unseen, ...ramp]) {
    const parts = (colour) => new THREE.Vector3(...colour).divideScalar(255);
    this.paint = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      defines: { STOPS: ramp.length },
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      side: THREE.DoubleSide,
      uniforms: {
        cells: { value: texture(new Uint8Array(2), 1) },
        ramp: { value: ramp.map(parts) },
        unseen: { value: parts(unseen) },
      },
    });
  }

  load({ data, cells }) {
    this.paint.uniforms.cells.value.dispose();
    this.paint.uniforms.cells.value = texture(data, cells);
  }

  setWireframe(on) {
    this.paint.wireframe = on;
  }

  draw(renderer, scene, camera) {
    scene.overrideMaterial = this.paint;
    renderer.render(scene, camera);
    scene.overrideMaterial = null;
  }

  dispose() {
    this.paint.uniforms.cells.value.dispose();
    this.paint.dispose();
  }
}

function texture(data, side) {
  const made = new THREE.Data3DTexture(data, side, side, side);
  made.format = THREE.RGFormat;
  made.minFilter = made.magFilter = THREE.LinearFilter;
  made.unpackAlignment = 1;
  made.needsUpdate = true;
  return made;
}
