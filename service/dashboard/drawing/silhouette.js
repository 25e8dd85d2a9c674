// Silhouettes of the original and its occluder over each other, coloured as the report does.
//
// Both are drawn flat into one picture, the original into its red, the occluder into its green; a
// second pass turns the four cases into colours.

import { THREE } from "nicegui-scene";

const FINER = 2; // samples a pixel, each way
const LARGEST = 4096;
const COUNTED = 512; // pixels a side that shares are counted at

const VERTEX = `
  void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`;
const FRAGMENT = `
  uniform sampler2D masks;
  uniform vec3 palette[4];
  uniform int finer;
  out vec4 colour;
  void main() {
    ivec2 corner = ivec2(gl_FragCoord.xy) * finer;
    vec3 sum = vec3(0.0);
    for (int y = 0; y < finer; y++) {
      for (int x = 0; x < finer; x++) {
        vec4 mask = texelFetch(masks, corner + ivec2(x, y), 0);
        sum += palette[(mask.r > 0.5 ? 2 : 0) + (mask.g > 0.5 ? 1 : 0)];
      }
    }
    colour = vec4(sum / float(finer * finer), 1.0);
  }`;

export class Silhouette {
  // The palette: neither, occluder only, original only, both; each red, green, blue to 255.
  constructor(palette) {
    this.first = flat("#ff0000");
    this.second = flat("#00ff00");
    this.target = null;
    this.paint = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      depthTest: false,
      depthWrite: false,
      uniforms: {
        masks: { value: null },
        finer: { value: FINER },
        palette: { value: palette.map((one) => new THREE.Vector3(...one).divideScalar(255)) },
      },
    });
    this.screen = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), this.paint);
    this.screen.frustumCulled = false;
    this.flatCamera = new THREE.Camera();
  }

  // Fill the canvas.
  draw(renderer, pieces, camera) {
    const size = renderer.getDrawingBufferSize(new THREE.Vector2());
    const finer = Math.max(size.x, size.y) * FINER <= LARGEST ? FINER : 1;
    this.target = sized(this.target, size.x * finer, size.y * finer);
    this.drawMasks(renderer, this.target, pieces, camera);
    this.paint.uniforms.masks.value = this.target.texture;
    this.paint.uniforms.finer.value = finer;
    renderer.render(this.screen, this.flatCamera);
  }

  // Pixels of each kind, in a square picture.
  count(renderer, pieces, camera) {
    const target = sized(null, COUNTED, COUNTED);
    this.drawMasks(renderer, target, pieces, camera);
    const pixels = new Uint8Array(4 * COUNTED * COUNTED);
    renderer.readRenderTargetPixels(target, 0, 0, COUNTED, COUNTED, pixels);
    target.dispose();
    const found = [0, 0, 0, 0];
    for (let at = 0; at < pixels.length; at += 4)
      found[(pixels[at] > 127 ? 2 : 0) + (pixels[at + 1] > 127 ? 1 : 0)]++;
    const [, wrong, missed, both] = found;
    return { both, missed, wrong, pixels: COUNTED * COUNTED };
  }

  dispose() {
    this.target?.dispose();
    this.screen.geometry.dispose();
    for (const material of [this.first, this.second, this.paint]) material.dispose();
  }

  drawMasks(renderer, target, pieces, camera) {
    const cleared = renderer.autoClear;
    renderer.setRenderTarget(target);
    renderer.setClearColor("#000000", 0);
    renderer.clear();
    renderer.autoClear = false;
    this.drawMask(renderer, pieces, camera, this.first, { original: true, occluder: false });
    this.drawMask(renderer, pieces, camera, this.second, { original: false, occluder: true });
    renderer.autoClear = cleared;
    renderer.setRenderTarget(null);
  }

  drawMask(renderer, pieces, camera, material, shown) {
    pieces.show(shown);
    pieces.scene.overrideMaterial = material;
    renderer.render(pieces.scene, camera);
    pieces.scene.overrideMaterial = null;
  }
}

// Adds to what is there, whatever lies in front of it.
function flat(colour) {
  return new THREE.MeshBasicMaterial({
    color: colour,
    side: THREE.DoubleSide,
    depthTest: false,
    depthWrite: false,
    blending: THREE.CustomBlending,
    blendSrc: THREE.OneFactor,
    blendDst: THREE.OneFactor,
  });
}

function sized(target, width, height) {
  if (target) target.setSize(width, height);
  else
    target = new THREE.WebGLRenderTarget(width, height, {
      minFilter: THREE.NearestFilter,
      magFilter: THREE.NearestFilter,
      depthBuffer: false,
    });
  return target;
}
