import { get, type AuditEntry } from "../api";
import { fill, h } from "../dom";
import { notice } from "../parts";
import { moment, t } from "../text";

interface LogCheck {
  intact: boolean;
  entries: number;
  findings: { line: number; what: string }[];
}

export function auditPage(place: HTMLElement): () => void {
  const said = notice();
  const rows = h("tbody");
  async function check(): Promise<void> {
    const found = await get<LogCheck>("/audit/check");
    if (found.intact) said.good(t("audit.intact", { entries: found.entries }));
    else fill(said.place, h("div", { class: "note bad" }, t("audit.broken"), h("ul", {}, found.findings.map((f) => h("li", {}, `${f.line}: ${f.what}`)))));
  }
  const details = (e: AuditEntry) =>
    Object.entries(e.details)
      .filter(([name]) => name !== "public_key")
      .map(([name, value]) => `${name}: ${typeof value === "object" ? JSON.stringify(value) : value}`)
      .join(", ");
  const head = [t("audit.time"), t("audit.who"), t("audit.what"), t("cases.number"), t("audit.details")];
  fill(
    place,
    h("h1", {}, t("audit.title")),
    h("section", { class: "card" }, h("button", { onclick: () => void check().catch(said.bad) }, t("audit.check")), h("p", {}), said.place, h("div", { class: "scroll", tabindex: 0 }, h("table", {}, h("thead", {}, h("tr", {}, head.map((k) => h("th", { scope: "col" }, k)))), rows))),
  );
  get<{ entries: AuditEntry[] }>("/audit").then(
    ({ entries }) => fill(rows, entries.map((e) => h("tr", {}, h("td", {}, moment(e.time)), h("td", {}, e.who), h("td", {}, e.what), h("td", {}, e.case), h("td", { class: "soft" }, details(e))))),
    said.bad,
  );
  return () => {};
}
