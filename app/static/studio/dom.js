// Small helpers for elements and numbers.

export const $ = (id) => document.getElementById(id);

/** An element with attributes, listeners (`onclick`) and children. Text goes in as text. */
export function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) node.setAttribute(name, value);
  }
  node.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return node;
}

/** A number with so many significant digits as tell something, never as 1e5. */
export function figure(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size === 0) return "0";
  if (size < 1e-4) return value.toExponential(1).replace("e-", " · 10⁻").replace(/\d+$/, superscript);
  const places = Math.max(0, Math.min(6, digits - 1 - Math.floor(Math.log10(size))));
  return value.toFixed(places).replace("-", "−");
}

const superscript = (digits) => [...digits].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]).join("");

export const percent = (share, digits = 3) => `${figure(share * 100, digits)} %`;

/** A table of rows of words, elements and numbers; an object instead of a row has its `cells` beside its attributes. */
export function table(head, rows) {
  const cell = (value) => (value === null || typeof value === "number" ? el("td", { class: "number" }, figure(value)) : el("td", {}, value));
  const row = (given) => (Array.isArray(given) ? el("tr", {}, given.map(cell)) : el("tr", { ...given, cells: null }, given.cells.map(cell)));
  const first = rows[0]?.cells ?? rows[0];
  const names = head.map((name, k) => (name instanceof Node ? name : el("th", { class: first?.[k] === null || typeof first?.[k] === "number" ? "number" : null }, name)));
  return el("div", { class: "scroll" }, el("table", {}, el("thead", {}, el("tr", {}, names)), el("tbody", {}, rows.map(row))));
}

/** A custom property of the page's style, as it is now. */
export const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Offers a text or blob as a file. */
export function save(name, content, type) {
  const url = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  const link = el("a", { href: url, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

/** Makes tabs of the buttons of a list: click and arrow keys choose; `chosen(button)` is told. */
export function tabs(list, chosen) {
  const buttons = () => [...list.querySelectorAll("[role=tab]")];
  const choose = (button) => {
    for (const each of buttons()) {
      const selected = each === button;
      each.setAttribute("aria-selected", selected);
      each.tabIndex = selected ? 0 : -1;
      const pane = $(each.getAttribute("aria-controls"));
      if (pane && each.hasAttribute("id")) pane.hidden = !selected;
    }
    chosen?.(button);
  };
  list.addEventListener("click", (event) => {
    const button = event.target.closest("[role=tab]");
    if (button) choose(button);
  });
  list.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const all = buttons();
    const next = all[(all.indexOf(document.activeElement) + step + all.length) % all.length];
    next.focus();
    choose(next);
    event.stopPropagation();
    event.preventDefault();
  });
}
