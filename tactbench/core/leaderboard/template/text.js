// Text is only ever put in as text; what cannot be seen, or turns the rest round, is written out.
const UNSEEN = /(?![\n\t])[\p{C}\p{Zl}\p{Zp}]/gu;
const visible = (text) => text.replace(UNSEEN, (one) => {
  if ("\r\v\f\u2028\u2029".includes(one)) return " ";
  const code = one.codePointAt(0), hex = code.toString(16);
  return code < 0x100 ? `\\x${hex.padStart(2, "0")}` : code < 0x10000 ? `\\u${hex.padStart(4, "0")}` : `\\U${hex.padStart(8, "0")}`;
});

const asText = (value) => {
  if (value === null || value === undefined) return "";
  if (typeof value === "string") return value;
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (Array.isArray(value)) return value.map(asText).join("; ");
  if (typeof value === "object") return Object.entries(value).map(([name, one]) => `${name} ${asText(one)}`).join(", ");
  return String(value);
};

const SVG = "http://www.w3.org/2000/svg";
const filled = (one, attributes, children) => {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) one.addEventListener(name.slice(2), value);
    else if (value === true) one.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) one.setAttribute(name, value);
  }
  one.append(...children.map((child) => (child instanceof Node ? child : visible(String(child)))));
  return one;
};
const make = (tag, attributes = {}, ...children) => filled(document.createElement(tag), attributes, children);
const draw = (tag, attributes = {}, ...children) => filled(document.createElementNS(SVG, tag), attributes, children);
const byId = (id) => document.getElementById(id);

// What stands between backticks is code.
const prose = (text) => {
  const parts = String(text).split("`");
  if (parts.length % 2 === 0) return [text];
  return parts.map((part, place) => (place % 2 ? make("code", {}, part) : part));
};

const whole = (count) => count.toLocaleString("en");
// The different values of a list, and how often each is in it.
const counted = (values) => {
  const counts = new Map();
  for (const value of values) counts.set(value, (counts.get(value) ?? 0) + 1);
  return [...counts];
};

// A stable address of a cell: its name in plain letters, and a digest of the name as it is (FNV-1a, 32 bits).
const address = (name) => {
  let digest = 0x811c9dc5;
  for (let at = 0; at < name.length; at += 1) {
    digest = Math.imul(digest ^ name.charCodeAt(at), 0x01000193) >>> 0;
  }
  const plain = name.replace(/[^A-Za-z0-9._:=,-]+/g, "-").slice(0, 120);
  return `${plain}-${digest.toString(16).padStart(8, "0")}`;
};
