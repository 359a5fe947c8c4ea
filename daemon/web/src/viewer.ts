// Skull and face in 3D. Everything is shown in glTF's axes (x right, y up, the face along z), in mm.
import {
  AmbientLight,
  type Box3,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  DoubleSide,
  Group,
  Matrix4,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  Raycaster,
  Scene,
  SphereGeometry,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";

/** What can be turned into another face: offsets for one standard deviation. */
export interface Mode {
  name: string;
  offsets: Float32Array;
}

export interface Shape {
  geometry: BufferGeometry;
  modes: Mode[];
  coloured: boolean;
}

// Our frames have z up and the face along -y.
const gltfFromOurs = new Matrix4().set(1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1);

async function fetched(address: string): Promise<ArrayBuffer> {
  const response = await fetch(address);
  if (!response.ok) throw new Error(`${address}: ${response.status}`);
  return response.arrayBuffer();
}

/** A PLY of ours; `placed` takes it to the anatomical frame. */
export async function plyShape(address: string, placed = new Matrix4()): Promise<Shape> {
  const geometry = new PLYLoader().parse(await fetched(address));
  geometry.applyMatrix4(gltfFromOurs.clone().multiply(placed));
  if (!geometry.getAttribute("normal")) geometry.computeVertexNormals();
  return { geometry, modes: [], coloured: geometry.getAttribute("color") !== undefined };
}

function scale(values: Float32Array, factor: number): Float32Array {
  for (let i = 0; i < values.length; ++i) values[i] *= factor;
  return values;
}

/** A GLB of ours, with its morph targets as modes; `placed` takes it to the anatomical frame. */
export async function glbShape(address: string, placed?: Matrix4): Promise<Shape> {
  const gltf = await new GLTFLoader().parseAsync(await fetched(address), "");
  let found: Mesh | null = null;
  gltf.scene.traverse((node) => {
    if (found === null && (node as Mesh).isMesh) found = node as Mesh;
  });
  if (found === null) throw new Error(`${address}: no mesh`);
  const mesh = found as Mesh;
  const targets = mesh.geometry.morphAttributes.position ?? [];
  const names = Object.entries(mesh.morphTargetDictionary ?? {}).sort((a, b) => a[1] - b[1]);
  const modes = targets.map((target, i) => ({
    name: names[i]?.[0] ?? String(i + 1),
    offsets: scale(target.array as Float32Array, 1000),  // m to mm
  }));
  const geometry = mesh.geometry;
  geometry.morphAttributes = {};
  scale(geometry.getAttribute("position").array as Float32Array, 1000);
  geometry.boundingBox = geometry.boundingSphere = null;
  if (placed) geometry.applyMatrix4(gltfFromOurs.clone().multiply(placed).multiply(gltfFromOurs.clone().invert()));
  if (!geometry.getAttribute("normal")) geometry.computeVertexNormals();
  return { geometry, modes, coloured: geometry.getAttribute("color") !== undefined };
}

/** Normals of every vertex by the area of its triangles; three's own needs ten times as long. */
function shade(geometry: BufferGeometry): void {
  const index = geometry.getIndex()?.array;
  const normal = geometry.getAttribute("normal") as BufferAttribute | undefined;
  if (index === undefined || normal === undefined || !(normal.array instanceof Float32Array)) {
    return geometry.computeVertexNormals();
  }
  const p = geometry.getAttribute("position").array as Float32Array;
  const n = normal.array;
  n.fill(0);
  for (let i = 0; i < index.length; i += 3) {
    const a = 3 * index[i], b = 3 * index[i + 1], c = 3 * index[i + 2];
    const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
    const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    n[a] += x, n[a + 1] += y, n[a + 2] += z;
    n[b] += x, n[b + 1] += y, n[b + 2] += z;
    n[c] += x, n[c + 1] += y, n[c + 2] += z;
  }
  for (let v = 0; v < n.length; v += 3) {
    const length = Math.sqrt(n[v] * n[v] + n[v + 1] * n[v + 1] + n[v + 2] * n[v + 2]) || 1;
    n[v] /= length;
    n[v + 1] /= length;
    n[v + 2] /= length;
  }
  normal.needsUpdate = true;
}

/** Does the processor draw? Then every triangle and every sample of a pixel is dear. Takes the canvas's context. */
function drawnInSoftware(canvas: HTMLCanvasElement): boolean {
  const gl = canvas.getContext("webgl2");
  const about = gl?.getExtension("WEBGL_debug_renderer_info");
  if (!gl || !about) return false;
  const name = String(gl.getParameter(about.UNMASKED_RENDERER_WEBGL));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|basic render/i.test(name);
}

const cellsAcross = 90;

/** The triangles that are left if all vertices in a cell of a grid were one: what is drawn while
    something moves. Nothing if there are few triangles anyway. */
function coarseIndex(geometry: BufferGeometry): BufferAttribute | null {
  const index = geometry.getIndex()?.array;
  if (index === undefined || index.length < 3 * 30000) return null;
  const p = geometry.getAttribute("position").array;
  geometry.computeBoundingBox();
  const { min, max } = geometry.boundingBox as Box3;
  const cell = Math.max(max.x - min.x, max.y - min.y, max.z - min.z) / (cellsAcross - 1);
  const first = new Int32Array(cellsAcross ** 3).fill(-1);
  const stands = new Uint32Array(p.length / 3);
  for (let v = 0; v < stands.length; ++v) {
    const x = Math.floor((p[3 * v] - min.x) / cell), y = Math.floor((p[3 * v + 1] - min.y) / cell), z = Math.floor((p[3 * v + 2] - min.z) / cell);
    const at = (x * cellsAcross + y) * cellsAcross + z;
    if (first[at] < 0) first[at] = v;
    stands[v] = first[at];
  }
  const kept = new Uint32Array(index.length);
  let count = 0;
  for (let i = 0; i < index.length; i += 3) {
    const a = stands[index[i]], b = stands[index[i + 1]], c = stands[index[i + 2]];
    if (a === b || b === c || c === a) continue;
    kept[count++] = a, kept[count++] = b, kept[count++] = c;
  }
  return new BufferAttribute(kept.slice(0, count), 1);
}

/** The shape with other values of its modes, in standard deviations. */
export function morph(shape: Shape, mean: Float32Array, values: number[]): void {
  const position = shape.geometry.getAttribute("position") as BufferAttribute;
  const now = position.array as Float32Array;
  now.set(mean);
  shape.modes.forEach(({ offsets }, m) => {
    const value = values[m];
    if (value === 0) return;
    for (let i = 0; i < now.length; ++i) now[i] += value * offsets[i];
  });
  position.needsUpdate = true;
  shade(shape.geometry);
}

export class Viewer {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(18, 1, 10, 8000);
  private readonly controls: OrbitControls;
  private readonly sides = [new Group(), new Group()];
  private readonly materials = [0, 1].map(
    () => new MeshStandardMaterial({ roughness: 0.75, metalness: 0, side: DoubleSide }),
  );
  private readonly marks = new Group();
  private readonly resized: ResizeObserver;
  private readonly coarse = new Map<BufferGeometry, { fine: BufferAttribute; coarse: BufferAttribute }>();
  private readonly software: boolean;
  private asked = false;
  private before = () => {};
  private refining = 0;
  private sideBySide = true;

  /** Throws where there is no WebGL. */
  constructor(readonly canvas: HTMLCanvasElement) {
    this.software = drawnInSoftware(document.createElement("canvas"));
    this.renderer = new WebGLRenderer({ canvas, antialias: !this.software, alpha: true });
    this.renderer.debug.checkShaderErrors = false;  // it would wait for them
    this.renderer.setPixelRatio(this.software ? 1 : Math.min(2, window.devicePixelRatio));
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enablePan = false;
    this.controls.addEventListener("change", () => this.draw());
    const light = new DirectionalLight(0xffffff, 2.6);
    light.position.set(-500, 600, 500);
    this.camera.add(light);
    this.scene.add(this.camera, new AmbientLight(0xffffff, 0.7), ...this.sides, this.marks);
    this.resized = new ResizeObserver(() => this.resize());
    this.resized.observe(canvas);
    canvas.addEventListener("keydown", (event) => this.key(event));
    this.look("front");
  }

  /** Shows a shape on a side (0 left, 1 right), or nothing. */
  show(side: number, shape: Shape | null, colour: number): void {
    this.sides[side].clear();
    if (shape !== null) {
      this.coarsen(shape.geometry);
      const material = this.materials[side];
      material.vertexColors = shape.coloured;
      material.color = new Color(shape.coloured ? 0xffffff : colour);
      material.needsUpdate = true;
      this.sides[side].add(new Mesh(shape.geometry, material));
    }
    this.arrange(this.sideBySide);
  }

  arrange(sideBySide: boolean): void {
    this.sideBySide = sideBySide;
    const apart = sideBySide && this.sides.every((side) => side.children.length > 0) ? 115 : 0;
    this.sides[0].position.x = -apart;
    this.sides[1].position.x = apart;
    this.draw();
  }

  setOpacity(value: number): void {
    const material = this.materials[1];
    material.transparent = value < 1;
    material.opacity = value;
    material.depthWrite = value >= 1;
    material.needsUpdate = true;
    this.draw();
  }

  look(from: "front" | "side" | "three" | "back"): void {
    const turn = { front: 0, side: Math.PI / 2, three: Math.PI / 5, back: Math.PI }[from];
    const distance = this.sideBySide ? 1200 : 1000;
    this.controls.target.set(0, 0, 0);
    this.camera.position.set(distance * Math.sin(turn), 0, distance * Math.cos(turn));
    this.controls.update();
    this.draw();
  }

  /** Where a point of the canvas (-1 to 1) meets a surface, without the side's shift. */
  pick(x: number, y: number): Vector3 | null {
    this.scene.updateMatrixWorld();  // it may have been turned since it was drawn
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(x, y), this.camera);
    const hit = ray.intersectObjects(this.sides, true)[0];
    if (hit === undefined) return null;
    const mark = new Mesh(new SphereGeometry(2.2, 12, 8), new MeshStandardMaterial({ color: 0xd33a2c }));
    mark.position.copy(hit.point);
    this.marks.add(mark);
    this.draw();
    return hit.point.clone().sub(hit.object.parent?.position ?? new Vector3());
  }

  clearMarks(): void {
    this.marks.clear();
    this.draw();
  }

  /** With the next frame; before it, once, what the last caller wants to be done first. */
  draw(before?: () => void): void {
    if (before) this.before = before;
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.before();
      this.before = () => {};
      this.render(this.coarse.size > 0 ? "coarse" : "fine");
      if (this.coarse.size === 0) return;
      clearTimeout(this.refining);
      this.refining = window.setTimeout(() => this.asked || this.render("fine"), 250);
    });
  }

  end(): void {
    clearTimeout(this.refining);
    this.resized.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
  }

  private render(detail: "coarse" | "fine"): void {
    for (const [geometry, indices] of this.coarse) geometry.setIndex(indices[detail]);
    this.renderer.render(this.scene, this.camera);
    for (const [geometry, indices] of this.coarse) geometry.setIndex(indices.fine);
    this.canvas.dataset.detail = detail;
    this.canvas.dispatchEvent(new Event("drawn"));
  }

  private coarsen(geometry: BufferGeometry): void {
    if (!this.software || this.coarse.has(geometry)) return;
    const coarse = coarseIndex(geometry);
    if (coarse !== null) this.coarse.set(geometry, { fine: geometry.getIndex() as BufferAttribute, coarse });
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    // Two heads side by side must fit on a phone that is held upright.
    this.camera.zoom = Math.min(1, this.camera.aspect / 1.1);
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  private key(event: KeyboardEvent): void {
    const turns: Record<string, [number, number]> = {
      ArrowLeft: [-0.12, 0],
      ArrowRight: [0.12, 0],
      ArrowUp: [0, -0.12],
      ArrowDown: [0, 0.12],
    };
    const offset = this.camera.position.clone().sub(this.controls.target);
    if (event.key in turns) {
      const [around, up] = turns[event.key];
      const distance = offset.length();
      const azimuth = Math.atan2(offset.x, offset.z) + around;
      const polar = Math.min(3, Math.max(0.14, Math.acos(offset.y / distance) + up));
      offset.set(Math.sin(polar) * Math.sin(azimuth), Math.cos(polar), Math.sin(polar) * Math.cos(azimuth)).multiplyScalar(distance);
    } else if (event.key === "+" || event.key === "-") {
      offset.multiplyScalar(event.key === "+" ? 0.9 : 1.1);
    } else {
      return;
    }
    event.preventDefault();
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
  }
}
