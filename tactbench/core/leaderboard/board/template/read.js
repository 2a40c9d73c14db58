// The page's data: blobs of deflated planes, and columns read from them.
const packed = JSON.parse(document.getElementById("data").textContent);

const inflated = async (text) => {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let at = 0; at < letters.length; at += 1) bytes[at] = letters.charCodeAt(at);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
};

const inflateAll = async () => Promise.all(packed.blobs.map(inflated));

const json = (bytes) => JSON.parse(new TextDecoder().decode(bytes));

// Whole numbers below 2^53: the lowest bytes of all rows, then the next higher ones.
const planes = (blobs, [blob, width]) => {
  const bytes = blobs[blob];
  const count = bytes.length / width;
  const whole = width > 4 ? new Float64Array(count) : new Uint32Array(count);
  for (let plane = 0, worth = 1; plane < width; plane += 1, worth *= 256) {
    const from = plane * count;
    for (let at = 0; at < count; at += 1) whole[at] += bytes[from + at] * worth;
  }
  return whole;
};

const NO_VALUE = 255;

const wordsColumn = (blobs, told) => {
  const words = json(blobs[told.words]);
  const at = planes(blobs, told.at);
  return { words, at, raw: (row) => words[at[row]], text: (row) => asText(words[at[row]]) };
};

// A text is its pattern with the digits put back; its value is what it shows, and how far it was rounded.
const digitsColumn = (blobs, told) => {
  const at = planes(blobs, told.at);
  const numbers = told.numbers.map((one) => planes(blobs, one));
  const text = (row) => {
    const [pattern, counts] = told.patterns[at[row]];
    const digits = counts.map((count, place) => String(numbers[place][row]).padStart(count, "0")).join("");
    let next = 0;
    return counts.length ? pattern.replace(/#/g, () => digits[next++]) : pattern;
  };
  let values = null;
  const read = () => {
    values = new Float64Array(at.length).fill(NaN);
    if (told.values !== undefined) {
      const bytes = blobs[told.values];
      const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
      for (let row = 0; row < values.length; row += 1) values[row] = view.getFloat32(4 * row, true);
      return values;
    }
    const rest = told.rest === undefined ? null : blobs[told.rest];
    for (let row = 0; row < values.length; row += 1) {
      const [, , scales, shares] = told.patterns[at[row]];
      if (!scales.length || (rest && rest[row] === NO_VALUE)) continue;
      values[row] = 0;
      for (let place = 0; place < scales.length; place += 1) {
        values[row] += numbers[place][row] * scales[place] * shares[place];
      }
      if (rest) values[row] += ((rest[row] - told.steps / 2) / told.steps) * Math.abs(scales[0]);
    }
    for (const [row, value] of told.odd ?? []) values[row] = value;
    return values;
  };
  // What the numbers of an interval show, lower end first.
  const ends = (row) => told.patterns[at[row]][2].map((scale, place) => numbers[place][row] * scale);
  return { patterns: told.patterns, at, text, raw: text, ends, values: () => values ?? read() };
};

const readColumn = (blobs, told) => {
  if (told.kind === "words") return wordsColumn(blobs, told);
  if (told.kind === "digits") return digitsColumn(blobs, told);
  if (told.kind === "joined") {
    const parts = told.parts.map((one) => readColumn(blobs, one));
    const text = (row) => parts.map((one) => one.text(row)).join(told.by);
    return { text, raw: text };
  }
  if (told.kind === "hex") {
    const at = planes(blobs, told.at);
    const text = (row) => (at[row] ? at[row].toString(16).padStart(told.digits, "0") : "");
    return { text, raw: text };
  }
  return { text: () => "", raw: () => "" };
};
