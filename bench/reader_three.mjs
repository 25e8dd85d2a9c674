// The triangles that three.js reads of a file, as JSON: node reader_three.mjs FILE, three in NODE_PATH.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { extname, join } from 'node:path';

const require = createRequire(join(process.cwd(), 'none.js'));
const from = (name) => import(require.resolve(`three/examples/jsm/loaders/${name}.js`));
const { REVISION } = await import(require.resolve('three').replace('three.cjs', 'three.module.js'));

async function shown(path) {
  const data = readFileSync(path);
  const bytes = data.buffer.slice(data.byteOffset, data.byteOffset + data.length);
  switch (extname(path)) {
    case '.glb':
      return (await new (await from('GLTFLoader')).GLTFLoader().parseAsync(bytes, '')).scene;
    case '.obj':
      return new (await from('OBJLoader')).OBJLoader().parse(data.toString());
    case '.ply':
      return new (await from('PLYLoader')).PLYLoader().parse(bytes);
    case '.stl':
      return new (await from('STLLoader')).STLLoader().parse(bytes);
    default:
      throw new Error(`three.js has no loader of ${path}`);
  }
}

function add(corners, geometry, placed) {
  const position = geometry.getAttribute('position');
  const count = geometry.index ? geometry.index.count : position.count;
  for (let i = 0; i < count; i++) {
    const vertex = geometry.index ? geometry.index.getX(i) : i;
    corners.push(placed(position.getX(vertex), position.getY(vertex), position.getZ(vertex)));
  }
}

const found = await shown(process.argv[2]);
const corners = [];
if (found.isBufferGeometry) {
  add(corners, found, (x, y, z) => [x, y, z]);
} else {
  found.updateMatrixWorld(true);
  found.traverse((node) => {
    if (!node.isMesh) return;
    const m = node.matrixWorld.elements; // columns; numbers as they are, not as float32
    const row = (i, x, y, z) => m[i] * x + m[i + 4] * y + m[i + 8] * z + m[i + 12];
    add(corners, node.geometry, (x, y, z) => [0, 1, 2].map((i) => row(i, x, y, z)));
  });
}
console.log(JSON.stringify({ version: `r${REVISION}`, corners }));
