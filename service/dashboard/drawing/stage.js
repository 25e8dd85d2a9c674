// The canvas: draws once for each change, and not while nothing changes.

import { THREE } from "nicegui-scene";
import { Eye } from "./eye.js";
import { HeatMap } from "./heat_map.js";
import { Pieces } from "./pieces.js";
import { Silhouette } from "./silhouette.js";

const QUIET = 150; // milliseconds without a change after which pixels are counted

export class Stage {
  // `told` has: counted(shares), moved(), lost(), restored(). Raises where there is no WebGL.
  constructor(host, { up, palette, ramp }, told) {
    this.host = host;
    this.told = told;
    this.renderer = new THREE.WebGLRenderer({ antialias: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.canvas = this.renderer.domElement;
    host.prepend(this.canvas);
    this.pieces = new Pieces();
    this.silhouette = new Silhouette(palette);
    this.heatMap = new HeatMap(ramp);
    this.eye = new Eye(this.canvas, up, () => {
      this.invalidate();
      told.moved();
    });
    this.pieces.scene.add(this.eye.headlight);
    this.mode = "overlay";
    this.wireframe = false;
    this.share = 0.5; // of the width, up to which a wipe shows the original
    this.frames = 0;
    this.canvas.addEventListener("webglcontextlost", () => told.lost());
    this.canvas.addEventListener("webglcontextrestored", () => {
      told.restored();
      this.invalidate();
    });
    this.sizes = new ResizeObserver(() => this.resize());
    this.sizes.observe(host);
    this.themes = new MutationObserver(() => this.repaint());
    this.themes.observe(document.body, { attributeFilter: ["class"] });
    this.repaint();
    this.resize();
  }

  setMode(mode) {
    this.mode = mode;
    this.eye.setOrthographic(mode === "silhouette");
    this.pieces.setTransparent(mode === "transparent");
    this.resize();
  }

  setShare(share) {
    this.share = share;
    this.invalidate();
  }

  // Where recall is lost, as HeatMap takes it.
  showLoss(loss) {
    this.heatMap.load(loss);
    this.invalidate();
  }

  setWireframe(on) {
    this.pieces.setWireframe(on);
    this.heatMap.setWireframe(on);
    this.invalidate();
  }

  lookAlong(direction) {
    this.eye.given = new THREE.Vector3(...direction);
    this.eye.lookAlong(this.eye.given);
  }

  // Draw before the next picture of the screen.
  invalidate() {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.draw();
    });
  }

  draw() {
    const { renderer, pieces, eye } = this;
    const { clientWidth: width, clientHeight: height } = this.host;
    if (this.mode === "silhouette") {
      this.silhouette.draw(renderer, pieces, eye.camera);
      clearTimeout(this.quiet);
      this.quiet = setTimeout(() => this.count(), QUIET);
    } else {
      renderer.setClearColor(this.background, 1);
      if (this.mode === "side") {
        this.drawHalf(0, width / 2, height, { original: true, occluder: false });
        this.drawHalf(width / 2, width / 2, height, { original: false, occluder: true });
        renderer.setScissorTest(false);
        renderer.setViewport(0, 0, width, height);
      } else if (this.mode === "wipe") {
        const edge = this.share * width;
        this.drawPart(0, edge, height, { original: true, occluder: false });
        this.drawPart(edge, width - edge, height, { original: false, occluder: true });
        renderer.setScissorTest(false);
      } else if (this.mode === "loss") {
        pieces.show({ original: true, occluder: false });
        this.heatMap.draw(renderer, pieces.scene, eye.camera);
      } else {
        pieces.show({ original: this.mode !== "alone", occluder: true });
        renderer.render(pieces.scene, eye.camera);
      }
    }
    this.host.dataset.frames = ++this.frames;
  }

  drawHalf(left, width, height, shown) {
    this.renderer.setViewport(left, 0, width, height);
    this.drawPart(left, width, height, shown);
  }

  drawPart(left, width, height, shown) {
    if (width <= 0) return;
    this.renderer.setScissor(left, 0, width, height);
    this.renderer.setScissorTest(true);
    this.pieces.show(shown);
    this.renderer.render(this.pieces.scene, this.eye.camera);
  }

  count() {
    if (this.mode !== "silhouette") return;
    const shares = this.silhouette.count(this.renderer, this.pieces, this.eye.whole());
    this.told.counted({ ...shares, direction: this.eye.direction.toArray() });
  }

  // Draws at once: a canvas of another size is empty, and would be seen so.
  resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.eye.setAspect((this.mode === "side" ? width / 2 : width) / height);
    this.draw();
  }

  repaint() {
    const style = getComputedStyle(this.host);
    const colour = (name) => style.getPropertyValue(`--viewer-${name}`).trim();
    this.background = colour("background");
    this.pieces.paint({ original: colour("original"), occluder: colour("occluder") });
    this.invalidate();
  }

  dispose() {
    cancelAnimationFrame(this.pending);
    clearTimeout(this.quiet);
    this.sizes.disconnect();
    this.themes.disconnect();
    this.eye.dispose();
    this.silhouette.dispose();
    this.heatMap.dispose();
    this.pieces.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.canvas.remove();
  }
}
