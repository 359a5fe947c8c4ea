// The part of a case's page that shows its shapes: two of them, side by side or one over the other.
import { Matrix4, type Vector3 } from "three";
import { fileAddress, type ArtifactFile, type Job } from "./api";
import { fill, h, setText } from "./dom";
import { field } from "./parts";
import { number, t, word, type Key } from "./text";
import { glbShape, morph, plyShape, Viewer, type Shape } from "./viewer";

interface Choice {
  id: string;
  label: string;
  colour: number;
  load(): Promise<Shape>;
}

function choices(face: Job, skull: Job | undefined, files: ArtifactFile[], anatomicalFromInput: number[][] | undefined): Choice[] {
  const bone = 0xe3d7bd;
  const skin = 0xd9a98c;
  const list: Choice[] = [];
  const has = (path: string) => files.some((f) => f.path === path);
  if (skull && anatomicalFromInput) {
    const placed = new Matrix4().set(...(anatomicalFromInput.flat() as Parameters<Matrix4["set"]>));
    list.push({ id: "skull", label: t("result.skull"), colour: bone, load: () => glbShape(fileAddress(skull.id, "skull.glb"), placed) });
  }
  const ply = (id: string, path: string, label: Key, colour: number) => has(path) && list.push({ id, label: t(label), colour, load: () => plyShape(fileAddress(face.id, path)) });
  ply("fitted", "skull_fitted.ply", "result.fitted", bone);
  if (has("head.glb")) list.push({ id: "face", label: t("result.face"), colour: skin, load: () => glbShape(fileAddress(face.id, "head.glb")) });
  ply("uncertainty", "uncertainty.ply", "result.uncertainty", skin);
  for (const { path } of files.filter((f) => f.path.startsWith("variants/") && f.path.endsWith(".glb"))) {
    const name = path.slice(9, -4).replaceAll("_", " ");
    list.push({ id: path, label: t("result.variant", { name }), colour: skin, load: () => glbShape(fileAddress(face.id, path)) });
  }
  return list;
}

function modeLabel(name: string): string {
  const tissue = name.match(/^tissue (\d+)$/);
  return tissue ? t("mode.tissue", { number: tissue[1] }) : word("mode", name);
}

export function facesPart(face: Job, skull: Job | undefined, files: ArtifactFile[], anatomicalFromInput: number[][] | undefined): { element: HTMLElement; end(): void } {
  const list = choices(face, skull, files, anatomicalFromInput);
  const loaded = new Map<string, Promise<Shape>>();
  const shapeOf = (choice: Choice) => {
    if (!loaded.has(choice.id)) loaded.set(choice.id, choice.load());
    return loaded.get(choice.id) as Promise<Shape>;
  };
  const atFirst = ["fitted", "face"];
  // They come while the browser gets ready to draw. Who shows them tells what went wrong.
  for (const choice of list.filter(({ id }) => atFirst.includes(id))) shapeOf(choice).catch(() => {});
  const canvas = h("canvas", { class: "scene", tabindex: 0, role: "img", "aria-label": t("result.canvas") });
  const status = h("p", { role: "status", class: "soft" }, t("result.loading"));
  let viewer: Viewer;
  try {
    viewer = new Viewer(canvas);
  } catch {
    return { element: h("section", { class: "card" }, h("p", { class: "note" }, t("result.no_3d"))), end: () => {} };
  }
  const sides = atFirst.map((id, side) => {
    const choose = h(
      "select",
      { onchange: () => void put(side) },
      h("option", { value: "" }, "–"),
      list.map((c) => h("option", { value: c.id, selected: c.id === id }, c.label)),
    );
    return choose;
  });
  const shows = ["", ""];
  const legend = h("p", { class: "soft", hidden: true }, t("result.legend"));
  async function put(side: number): Promise<void> {
    const choice = list.find((c) => c.id === sides[side].value);
    legend.hidden = !sides.some((s) => s.value === "uncertainty");
    viewer.clearMarks();
    first = null;
    const shown = (id: string) => {
      shows[side] = id;
      canvas.dataset.shows = shows.join(" ").trim();
    };
    shown("");
    if (choice === undefined) return viewer.show(side, null, 0);
    setText(status, t("result.loading"));
    try {
      const shape = await shapeOf(choice);
      if (sides[side].value !== choice.id) return;
      viewer.show(side, shape, choice.colour);
      shown(choice.id);
      if (choice.id === "face") showModes(shape);
      setText(status, "");
    } catch (error) {
      setText(status, String(error));
    }
  }

  const sliders = h("div");
  let modesShown = false;
  function showModes(shape: Shape): void {
    if (modesShown || shape.modes.length === 0) return;
    modesShown = true;
    const mean = Float32Array.from(shape.geometry.getAttribute("position").array);
    const inputs = shape.modes.map((mode) => {
      const value = h("output", {}, number(0, 1));
      const input = h("input", {
        type: "range",
        min: -3,
        max: 3,
        step: 0.1,
        value: 0,
        "aria-label": t("result.mode", { name: modeLabel(mode.name) }),
        oninput: () => (setText(value, number(Number(input.value), 1)), change()),
      });
      return { input, value, label: modeLabel(mode.name) };
    });
    const change = () => viewer.draw(() => morph(shape, mean, inputs.map(({ input }) => Number(input.value))));
    const reset = () => {
      for (const { input, value } of inputs) {
        input.value = "0";
        setText(value, number(0, 1));
      }
      change();
    };
    const row = (part: (typeof inputs)[number]) => h("div", { class: "row" }, h("label", {}, part.label, part.input), part.value);
    fill(
      sliders,
      h("h2", {}, t("result.modes")),
      inputs.slice(0, 4).map(row),
      inputs.filter((p, i) => i >= 4 && p.label === word("mode", "body mass index")).map(row),
      h("button", { onclick: reset }, t("result.mean")),
    );
  }

  let first: Vector3 | null = null;
  const measured = h("p", { role: "status" });
  function mark(x: number, y: number): void {
    if (first === null) viewer.clearMarks();
    const point = viewer.pick(x, y);
    if (point === null) return setText(measured, t("result.no_point"));
    if (first === null) {
      first = point;
      return setText(measured, t("result.first_point"));
    }
    setText(measured, t("result.distance", { value: number(point.distanceTo(first), 1) }));
    first = null;
  }
  let pressed = [0, 0];
  canvas.addEventListener("pointerdown", (e) => (pressed = [e.clientX, e.clientY]));
  canvas.addEventListener("click", (e) => {
    const dragged = Math.hypot(e.clientX - pressed[0], e.clientY - pressed[1]) > 4;
    if (!measure.open || dragged) return;
    const box = canvas.getBoundingClientRect();
    mark((2 * (e.clientX - box.left)) / box.width - 1, 1 - (2 * (e.clientY - box.top)) / box.height);
  });
  const measure = h(
    "details",
    {},
    h("summary", {}, t("result.measure")),
    h("p", { class: "soft" }, t("result.measure_help")),
    h("button", { onclick: () => mark(0, 0) }, t("result.mark")),
    measured,
  );

  const layout = h(
    "select",
    { onchange: () => (viewer.arrange(layout.value === "side"), viewer.look("front")) },
    h("option", { value: "side" }, t("result.side")),
    h("option", { value: "over" }, t("result.over")),
  );
  const opacity = h("input", { type: "range", min: 0, max: 1, step: 0.05, value: 1, oninput: () => viewer.setOpacity(Number(opacity.value)) });
  const view = (from: "front" | "side" | "three" | "back", label: Key) => h("button", { onclick: () => viewer.look(from) }, t(label));
  const element = h(
    "div",
    { class: "columns" },
    h(
      "section",
      { class: "card" },
      h("div", { class: "row" }, field(t("result.left"), sides[0]), field(t("result.right"), sides[1])),
      h("div", { class: "scene-box" }, canvas),
      status,
      legend,
      h("div", { class: "row", role: "group", "aria-label": t("result.views") }, view("front", "result.front"), view("three", "result.three"), view("side", "result.side_view"), view("back", "result.back")),
    ),
    h("section", { class: "card" }, h("div", { class: "row" }, field(t("result.layout"), layout), field(t("result.opacity"), opacity)), sliders, measure),
  );
  void put(0);
  void put(1);
  return { element, end: () => viewer.end() };
}
