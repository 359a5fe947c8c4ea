// Small things that several pages show.
import { Refusal, type Case } from "./api";
import { fill, h } from "./dom";
import { currentLanguage, says, t, word } from "./text";
import de from "./messages/de.json";

/** What went wrong, in words of this language where there are some. */
export function words(error: unknown): string {
  if (error instanceof Refusal) {
    return `error.${error.code}` in de ? word("error", error.code) : error.message;
  }
  return String(error);
}

/** A place where a page says how something went; screen readers say it, too. */
export function notice(): { place: HTMLElement; bad(error: unknown): void; good(text: string): void; clear(): void } {
  const place = h("div", { role: "alert" });
  return {
    place,
    bad: (error) => fill(place, h("p", { class: "note bad" }, words(error))),
    good: (text) => fill(place, h("p", { class: "note good" }, text)),
    clear: () => fill(place),
  };
}

/** A sentence of the station's; marked as English where it is not known in this language. */
export function stationSays(text: string): HTMLElement {
  const here = says(text);
  return h("span", { lang: currentLanguage() !== "en" && here === text ? "en" : null }, here);
}

export function tag(group: string, state: string): HTMLElement {
  return h("span", { class: `tag ${state}` }, word(group, state));
}

export function caseLink(row: Case): HTMLElement {
  return h("a", { href: `#/case/${row.id}` }, row.number);
}

export function field(label: string, input: HTMLElement): HTMLElement {
  return h("label", {}, label, input);
}

/** Asks before something that can't be taken back. */
export function sure(question: string, yes: string): Promise<boolean> {
  return new Promise((resolve) => {
    const dialog = h("dialog", { "aria-label": question });
    const answer = (value: boolean) => () => {
      dialog.close();
      dialog.remove();
      resolve(value);
    };
    fill(
      dialog,
      h("p", {}, question),
      h("div", { class: "row" }, h("button", { class: "danger", onclick: answer(true) }, yes), h("button", { autofocus: true, onclick: answer(false) }, t("no"))),
    );
    dialog.addEventListener("cancel", answer(false));
    document.body.append(dialog);
    dialog.showModal();
  });
}

/** A form that does one thing: while it is being done its button waits. */
export function form(children: (Node | false)[], label: string, kind: string, act: () => Promise<void>): HTMLFormElement {
  const button = h("button", { class: kind }, label);
  const said = notice();
  return h(
    "form",
    {
      onsubmit: async (event: Event) => {
        event.preventDefault();
        said.clear();
        button.disabled = true;
        await act().catch(said.bad);
        button.disabled = false;
      },
    },
    children,
    said.place,
    button,
  );
}
