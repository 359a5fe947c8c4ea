import type { ScanView, Station } from "./api";
import { svg } from "./dom";
import { t } from "./text";

/** The views of a placement seen from above the table: a ring for each camera, the lowest outside. */
export function coverageDome(station: Station, views: ScanView[], pass: number): SVGElement {
  const cameras = [...station.cameras].sort((a, b) => (a.elevation_deg ?? 0) - (b.elevation_deg ?? 0));
  const here = views.filter((view) => view.pass === pass);
  const all = cameras.length * station.views_per_ring;
  const bad = here.filter((view) => view.rejected).length;
  const dots: SVGElement[] = [];
  cameras.forEach((camera, ring) => {
    const radius = 100 - (ring * 70) / Math.max(1, cameras.length);
    const taken = new Map(
      here.filter((v) => v.camera === camera.id).map((v) => [Math.round(((v.angle_deg ?? 0) / 360) * station.views_per_ring) % station.views_per_ring, v]),
    );
    dots.push(svg("circle", { cx: 120, cy: 120, r: radius, fill: "none", stroke: "currentColor", "stroke-opacity": 0.2 }));
    for (let i = 0; i < station.views_per_ring; ++i) {
      const angle = (2 * Math.PI * i) / station.views_per_ring - Math.PI / 2;
      const view = taken.get(i);
      const kind = view === undefined ? "todo" : view.rejected ? "bad" : "taken";
      const at = { cx: 120 + radius * Math.cos(angle), cy: 120 + radius * Math.sin(angle) };
      // Not by colour alone: what is not good enough is a ring with a cross's size.
      dots.push(svg("circle", { class: kind, ...at, r: view?.rejected ? 6.5 : view ? 5 : 3.5 }));
    }
  });
  const label = `${t("table.pass", { pass: pass + 1, all: station.passes })}. ${t("table.dome", { done: here.length, all, bad })}`;
  return svg("svg", { class: "dome", viewBox: "0 0 240 240", role: "img", "aria-label": label }, dots, svg("text", { x: 120, y: 124, "text-anchor": "middle", "font-size": 12, fill: "currentColor" }, `${here.length} / ${all}`));
}
