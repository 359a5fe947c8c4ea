// Where the packages of a case are on their way, and what a person may do about it.
import { send, type Delivery, type SignIn, type WholeCase } from "../api";
import { h } from "../dom";
import { notice, stationSays, tag } from "../parts";
import { moment, t } from "../text";

/** Will it go on by itself? Then the page looks again. */
export function onTheirWay(whole: WholeCase): boolean {
  return whole.deliveries.some((d) => ["queued", "sending", "waiting"].includes(d.state));
}

function summary(whole: WholeCase): string {
  if (whole.removed) return t("result.removed", { time: moment(whole.removed) });
  if (whole.verified) return t("result.delivered", { time: moment(whole.verified) });
  const sealed = whole.jobs.some((job) => job.step === "seal" && job.state === "done");
  if (!sealed) return t("delivery.not_sealed");
  return whole.targets.length === 0 ? t("delivery.no_target") : t("result.not_delivered");
}

export function deliveryPart(whole: WholeCase, who: SignIn, again: () => void): HTMLElement {
  const said = notice();
  const act = (id: number, what: "retry" | "hold") => send("POST", `/deliveries/${id}/${what}`).then(again, said.bad);
  const mayRetry = ["operator", "examiner", "administrator"].includes(who.role);
  const mayHold = ["examiner", "administrator"].includes(who.role);
  const row = (d: Delivery) =>
    h(
      "li",
      {},
      h("strong", {}, d.target),
      tag("delivery", d.state),
      d.delivered && h("span", { class: "soft" }, t("delivery.delivered_on", { time: moment(d.delivered) })),
      d.state !== "delivered" && d.attempts > 0 && h("span", { class: "soft" }, t("delivery.attempts", { count: d.attempts })),
      d.next_attempt && h("span", { class: "soft" }, t("delivery.next", { time: moment(d.next_attempt) })),
      d.state !== "delivered" && d.last_error && h("p", { class: d.state === "rejected" ? "note bad" : "note" }, stationSays(d.last_error)),
      mayRetry && ["waiting", "rejected", "held"].includes(d.state) && h("button", { "aria-label": t("delivery.retry_to", { target: d.target }), onclick: () => act(d.id, "retry") }, t("delivery.retry")),
      mayHold && ["queued", "waiting", "rejected"].includes(d.state) && h("button", { "aria-label": t("delivery.hold_to", { target: d.target }), onclick: () => act(d.id, "hold") }, t("delivery.hold")),
    );
  return h("div", {}, h("h2", {}, t("result.delivery")), h("p", {}, summary(whole)), whole.deliveries.length > 0 && h("ul", { class: "plain" }, whole.deliveries.map(row)), said.place);
}
