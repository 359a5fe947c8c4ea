// Elements without markup in strings: whatever comes from outside is text and nothing else.

type Child = Node | string | number | null | undefined | false | Child[];
type Properties = Record<string, unknown>;

function append(parent: Element, children: Child[]): void {
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    if (Array.isArray(child)) append(parent, child);
    else parent.append(child instanceof Node ? child : String(child));
  }
}

function set(element: Element, properties: Properties): void {
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) {
      element.addEventListener(name.slice(2), value as EventListener);
    } else if (name === "value") {
      (element as HTMLInputElement).value = String(value);
    } else {
      element.setAttribute(name, value === true ? "" : String(value));
    }
  }
}

/** h("button", { onclick: go }, "Start") */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  append(element, children);
  set(element, properties);
  return element;
}

export function svg(tag: string, properties: Properties = {}, ...children: Child[]): SVGElement {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  set(element, properties);
  append(element, children);
  return element;
}

/** Shows other children, without touching those that are there already. */
export function fill(parent: Element, ...children: Child[]): void {
  const fresh = document.createElement("div");
  append(fresh, children);
  parent.replaceChildren(...fresh.childNodes);
}

export function setText(node: Element, text: string): void {
  if (node.textContent !== text) node.textContent = text;
}
