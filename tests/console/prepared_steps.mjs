// Steps that are done at once, for driving the console: copies of the demo's results.
//   node tests/console/prepared_steps.mjs out/demo FOLDER [TRIANGLES]
// writes FOLDER/step, which `skullstationd --step-program FOLDER/step` runs instead of
// `skullstation step`; a step takes four seconds. The package of an approved case is empty: the true
// step seals no reconstruction that was made of other photographs. With TRIANGLES the head is
// divided into so many or a few more: same surface, same modes.
import { chmodSync, cpSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const [demo, folder, triangles] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
cpSync(join(demo, "reconstruction"), join(folder, "reconstruct"), { recursive: true });
cpSync(join(demo, "case"), join(folder, "approximate"), { recursive: true });
mkdirSync(join(folder, "seal", "signature"), { recursive: true });
for (const file of ["bagit.txt", "manifest-sha256.txt", "tagmanifest-sha256.txt", "signature/ed25519.sig"]) {
  writeFileSync(join(folder, "seal", file), "");
}
const script = `#!/bin/sh -e
# usage: step NAME FOLDER
from=$(dirname "$0")/$1
for i in 1 2 3 4 5 6 7 8; do
  echo "{\\"fraction\\": 0.$i, \\"stage\\": \\"copying\\"}"
  sleep 0.5
done
mkdir -p "$2/out"
cp -r "$from/." "$2/out"
echo '{}' > "$2/result.json"
`;
writeFileSync(join(folder, "step"), script);
chmodSync(join(folder, "step"), 0o755);
if (triangles) {
  const file = join(folder, "approximate", "head.glb");
  writeFileSync(file, divided(readFileSync(file), Number(triangles)));
}

/** Every triangle into n x n, the first ones a bit finer, with all attributes in between. */
function divided(glb, wanted) {
  const length = glb.readUInt32LE(12);
  const json = JSON.parse(glb.subarray(20, 20 + length));
  const bin = glb.subarray(28 + length);
  const read = (accessor, Type, width) => {
    const { bufferView, count } = json.accessors[accessor];
    const begin = bin.byteOffset + (json.bufferViews[bufferView].byteOffset ?? 0);
    return new Type(glb.buffer.slice(begin, begin + 4 * width * count));
  };
  const mesh = json.meshes[0].primitives[0];
  const index = read(mesh.indices, Uint32Array, 1);
  const names = [mesh.attributes.POSITION, mesh.attributes.NORMAL, ...mesh.targets.map((t) => t.POSITION)];
  const before = names.map((accessor) => read(accessor, Float32Array, 3));
  const after = before.map(() => []);
  const faces = [];
  const known = new Map();
  const vertex = (corners, shares) => {
    const parts = corners.map((c, i) => [c, shares[i]]).filter(([, s]) => s > 0).sort((a, b) => a[0] - b[0]);
    const key = parts.join(";");
    if (!known.has(key)) {
      known.set(key, after[0].length / 3);
      before.forEach((values, k) => {
        for (let d = 0; d < 3; ++d) after[k].push(parts.reduce((sum, [c, s]) => sum + s * values[3 * c + d], 0));
      });
    }
    return known.get(key);
  };
  const count = index.length / 3;
  const n = Math.floor(Math.sqrt(wanted / count));
  const finer = Math.ceil((wanted - count * n * n) / (2 * n + 1));
  for (let f = 0; f < count; ++f) {
    const corners = [...index.subarray(3 * f, 3 * f + 3)];
    const m = f < finer ? n + 1 : n;
    const at = (i, j) => vertex(corners, [(m - i - j) / m, i / m, j / m]);
    for (let i = 0; i < m; ++i) {
      for (let j = 0; i + j < m; ++j) {
        faces.push(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < m) faces.push(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
    }
  }
  const range = (values, pick) => [0, 1, 2].map((d) => values.reduce((m, v, i) => (i % 3 === d ? pick(m, v) : m), values[d]));
  const parts = [];
  const views = [];
  const accessors = [];
  const add = (typed, accessor) => {
    accessors.push({ bufferView: views.length, ...accessor });
    views.push({ buffer: 0, byteOffset: parts.reduce((s, p) => s + p.length, 0), byteLength: typed.byteLength });
    parts.push(Buffer.from(typed.buffer));
    return accessors.length - 1;
  };
  const vectors = after.map((values) => {
    const typed = Float32Array.from(values);
    return add(typed, { componentType: 5126, count: typed.length / 3, type: "VEC3", min: range(typed, Math.min), max: range(typed, Math.max) });
  });
  mesh.attributes = { POSITION: vectors[0], NORMAL: vectors[1] };
  mesh.targets = vectors.slice(2).map((accessor) => ({ POSITION: accessor }));
  mesh.indices = add(Uint32Array.from(faces), { componentType: 5125, count: faces.length, type: "SCALAR" });
  const data = Buffer.concat(parts);
  Object.assign(json, { accessors, bufferViews: views, buffers: [{ byteLength: data.length }] });
  let text = JSON.stringify(json);
  text += " ".repeat((4 - (Buffer.byteLength(text) % 4)) % 4);
  const chunk = (type, bytes) => {
    const head = Buffer.alloc(8);
    head.writeUInt32LE(bytes.length, 0);
    head.writeUInt32LE(type, 4);
    return Buffer.concat([head, bytes]);
  };
  const body = Buffer.concat([chunk(0x4e4f534a, Buffer.from(text)), chunk(0x004e4942, data)]);
  const head = Buffer.alloc(12);
  head.write("glTF", 0);
  head.writeUInt32LE(2, 4);
  head.writeUInt32LE(12 + body.length, 8);
  console.log(`${faces.length / 3} triangles, ${after[0].length / 3} vertices, ${body.length + 12} bytes`);
  return Buffer.concat([head, body]);
}
