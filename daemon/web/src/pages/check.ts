import { get, type Finding } from "../api";
import { fill, h } from "../dom";
import { live } from "../live";
import { notice, stationSays, tag } from "../parts";
import { bytes, t } from "../text";

interface Check {
  findings: Finding[];
  certificate_sha256: string;
  free_bytes?: number;
}

export function checkPage(place: HTMLElement): () => void {
  const said = notice();
  const rows = h("tbody");
  const facts = h("dl");
  const again = h("button", { onclick: () => void look() }, t("check.again"));
  async function look(): Promise<void> {
    again.disabled = true;
    fill(said.place, h("p", { class: "soft" }, t("check.looking")));
    try {
      const check = await get<Check>("/station/check");
      said.clear();
      fill(
        rows,
        check.findings.map((f) => h("tr", {}, h("td", {}, tag("check", f.verdict)), h("td", {}, stationSays(f.topic)), h("td", {}, stationSays(f.what), f.advice && h("div", { class: "soft" }, stationSays(f.advice))))),
      );
      const fact = (name: string, value: string) => [h("dt", {}, h("strong", {}, name)), h("dd", {}, value)];
      fill(
        facts,
        fact(t("check.version"), live.station?.version ?? ""),
        check.free_bytes !== undefined ? fact(t("check.space"), bytes(check.free_bytes)) : null,
        fact(t("check.certificate"), check.certificate_sha256),
      );
    } catch (error) {
      said.bad(error);
    }
    again.disabled = false;
  }
  const head = ["check.verdict", "check.topic", "check.what"] as const;
  fill(
    place,
    h("h1", {}, `${t("check.title")} ${live.station?.station ?? ""}`),
    h("section", { class: "card" }, h("h2", {}, t("check.findings")), said.place, h("div", { class: "scroll", tabindex: 0 }, h("table", {}, h("thead", {}, h("tr", {}, head.map((k) => h("th", { scope: "col" }, t(k))))), rows)), h("p", {}), again),
    h("section", { class: "card" }, facts),
  );
  void look();
  return () => {};
}
