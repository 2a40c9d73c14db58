// Score against time: one block, one host, and the front of what nothing else beats in both.
const TIME_UNITS = [[1, "s"], [1e-3, "ms"], [1e-6, "µs"]];
const timeText = (seconds) => {
  const [worth, unit] = TIME_UNITS.find(([one]) => seconds >= one * 0.9999) ?? TIME_UNITS.at(-1);
  return `${Number((seconds / worth).toPrecision(3))} ${unit}`;
};

const UNKNOWN = "a host that is not known";
const pointsOf = (place, axis) => {
  const score = board.role("score").column, rank = board.role("rank");
  return board.rowsOf(place).filter((row) => !Number.isNaN(score.sort[row])).map((row) => ({
    row, time: axis.column.sort[row], score: score.sort[row], kind: board.kinds.text(row),
    placed: !rank || rank.column.text(row) !== ABSENT, host: board.field("host", row) || UNKNOWN }));
};

// In the order of time, each of the front scores better than all before it; without a place (no better than the trivial
// answer) nobody is on it.
const frontOf = (points, lower) => {
  const worse = (one, other) => (lower ? one.score - other.score : other.score - one.score);
  const front = [];
  for (const one of points.filter(({ kind, placed }) => kind === "result" && placed)
    .sort((one, other) => one.time - other.time || worse(one, other))) {
    if (!front.length || worse(one, front.at(-1)) < 0) front.push(one);
  }
  return front;
};

const steps = (low, high, most) => {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= rough * 0.999);
  const first = Math.ceil(low / step - 1e-9), digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, at) => (first + at) * step)
    .map((value) => [value, value.toFixed(digits)]);
};

const decades = (low, high) => {
  const first = Math.floor(Math.log10(low)), parts = Math.log10(high / low) < 2.5 ? [1, 2, 5] : [1];
  return Array.from({ length: Math.ceil(Math.log10(high)) - first + 1 }, (_, at) => 10 ** (first + at))
    .flatMap((power) => parts.map((part) => part * power)).filter((value) => value >= low * 0.999 && value <= high * 1.001);
};

const nameOf = (row) => `${board.role("sensor").column.text(row)} · ${board.role("estimator").column.text(row)}`;

const tellPoint = (point, axis) => {
  const interval = board.role("interval"), rank = board.role("rank");
  const parts = [nameOf(point.row), `score ${board.role("score").column.text(point.row)}`];
  const between = interval?.column.text(point.row);
  if (between && between !== ABSENT) parts.push(`${interval.name} ${between}`);
  if (rank) parts.push(point.kind === "result" ? `rank ${rank.column.text(point.row)}` : "trivial answer");
  return [...parts, `${axis.name} ${axis.column.text(point.row)}`];
};

const drawTime = () => {
  const { head } = board, figure = byId("pareto");
  const nothing = (text) => figure.replaceChildren(make("p", { class: "missing" }, text));
  const axes = head.times.map((name) => board.columns.find((one) => one.name === name)).filter((one) => !board.isSilent(one));
  const blocks = head.blocks.map((block, place) => [String(place), block.title]).filter(([place]) => board.rowsOf(place).length);
  fillPicker(byId("time-block"), blocks, byId("time-block").value);
  fillPicker(byId("time-axis"), axes.map((one) => [one.name, one.name]), byId("time-axis").value);
  byId("time-host-label").hidden = true;
  if (!blocks.length || !axes.length) return nothing(blocks.length ? "No cell has a time." : "No cell is left by the filter.");
  const place = Number(byId("time-block").value), block = head.blocks[place];
  const axis = axes.find((one) => one.name === byId("time-axis").value);
  const scored = pointsOf(place, axis), all = scored.filter((one) => one.time > 0);
  const hosts = counted(all.map(({ host }) => host))
    .sort((one, other) => other[1] - one[1] || words.compare(one[0], other[0]));
  fillPicker(byId("time-host"), hosts.map(([host, count]) => [host, `${host} (${whole(count)} cells)`]), byId("time-host").value);
  byId("time-host-label").hidden = hosts.length < 2;
  if (!all.length) return nothing("No cell of this block has both a score and this time.");
  const host = byId("time-host").value;
  const points = all.filter((one) => one.host === host).sort((one, other) => one.time - other.time);
  const front = frontOf(points, block.lower);
  const elsewhere = all.length - points.length, untimed = scored.length - all.length;
  const atOnce = [...new Set(points.map((one) => board.field("concurrency", one.row)).filter((text) => text))].sort(words.compare);
  const cells = atOnce.length > 1 ? `${atOnce[0]} to ${atOnce.at(-1)} cells` : atOnce[0] === "1" ? "one cell" : `${atOnce[0]} cells`;
  const caption = [
    `${block.lower ? "Lower" : "Higher"} and further left is better. Filled: answers; joined: the front, which no other answer beats in both; its intervals are the upright bands. Hollow: trivial answers, which are not part of it, nor is what is no better than the best of them.`,
    `All times of this figure were taken on ${host === UNKNOWN ? UNKNOWN : `host ${host}`}${atOnce.length ? `, with ${cells} at once` : ""}.`,
  ];
  if (elsewhere) caption.push(`${whole(elsewhere)} cells timed on other hosts are not drawn: times of two hosts are not comparable.`);
  if (untimed) caption.push(`${whole(untimed)} cells have no such time.`);
  return figure.replaceChildren(...drawFigure(figure.clientWidth || 800, points, front, block, axis),
    make("figcaption", {}, caption.join(" ")), frontTable(front, axis));
};

const frontTable = (front, axis) => {
  const columns = [axis, ...["rank", "sensor", "estimator", "score", "interval"].map(board.role).filter((one) => one)];
  const cell = (row, { name, numeric, column }) => make("td", { class: numeric ? "number" : null },
    numeric ? link(row, column.text(row), name === ROLES.score) : column.text(row));
  return make("div", { class: "box" }, tableOf("The front, the quickest first", columns,
    front.map(({ row }) => columns.map((one) => cell(row, one)))));
};

const MANY_POINTS = 250;
const drawFigure = (width, points, front, block, axis) => {
  const height = Math.max(300, Math.min(520, width * 0.6)), left = 64, right = 16, top = 12, bottom = 44;
  const interval = board.role("interval");
  const ends = new Map(front.map((one) => [one, interval ? intervalEnds(interval.column.text(one.row)) : []]));
  const all = points.map((one) => one.score).concat(...ends.values());
  let low = Math.min(...all), high = Math.max(...all);
  const spare = (high - low || Math.abs(high) || 1) * 0.06;
  low -= spare; high += spare;
  const quick = points[0].time / 1.25, slow = points.at(-1).time * 1.25;
  const x = (time) => left + (Math.log(time / quick) / Math.log(slow / quick)) * (width - left - right);
  const y = (score) => top + ((high - score) / (high - low)) * (height - top - bottom);
  const rule = (x1, x2, y1, y2) => draw("line", { class: "rule", x1, x2, y1, y2 });
  const text = (kind, x, y, shown, more) => draw("text", { class: kind, x, y, ...more }, shown);
  const middle = { "text-anchor": "middle" };
  const picture = draw("svg", { viewBox: `0 0 ${width} ${height}`, width, height, role: "group",
    "aria-label": `${block.title}: score against ${axis.name}. Arrow keys go from point to point, Enter opens the cell.` });
  for (const [value, shown] of steps(low, high, 6)) {
    picture.append(rule(left, width - right, y(value), y(value)),
      text("tick", left - 8, y(value) + 4, shown, { "text-anchor": "end" }));
  }
  let taken = -Infinity;
  for (const value of decades(quick, slow)) {
    picture.append(rule(x(value), x(value), top, height - bottom));
    if (x(value) - taken < 48) continue;
    taken = x(value);
    picture.append(text("tick", x(value), height - bottom + 18, timeText(value), middle));
  }
  picture.append(text("axis", (left + width - right) / 2, height - 6, `${axis.name}, logarithmic`, middle),
    text("axis", 0, 0, block.metric, { ...middle, transform: `translate(14 ${(top + height - bottom) / 2}) rotate(-90)` }));
  for (const [one, [from, to]] of ends) {
    if (to !== undefined) picture.append(draw("line", { class: "interval", x1: x(one.time), x2: x(one.time), y1: y(from), y2: y(to) }));
  }
  if (front.length) {
    const corners = front.map((one) => `H${x(one.time).toFixed(1)}V${y(one.score).toFixed(1)}`).join("");
    const start = `M${x(front[0].time).toFixed(1)} ${y(front[0].score).toFixed(1)}`;
    picture.append(draw("path", { class: "front", d: `${start}${corners}H${width - right}` }));
  }
  const tip = make("div", { class: "tip", hidden: true, "aria-hidden": "true" });
  const onFront = new Set(front), small = points.length > MANY_POINTS ? 2.4 : 3.8;
  const drawn = points.map((point) => {
    const kind = `point ${point.kind}${onFront.has(point) ? " on-front" : ""}`;
    const shared = { class: kind, tabindex: -1, role: "link", "aria-label": tellPoint(point, axis).join(", ") };
    const cx = x(point.time), cy = y(point.score), r = onFront.has(point) ? 5.5 : small;
    return Object.assign(point.kind === "baseline"
      ? draw("rect", { ...shared, x: cx - small, y: cy - small, width: 2 * small, height: 2 * small })
      : draw("circle", { ...shared, cx, cy, r }), { point });
  });
  picture.append(...[false, true].flatMap((above) => drawn.filter(({ point }) => onFront.has(point) === above)));
  const labelled = [];
  for (const one of front) {
    const name = nameOf(one.row).slice(0, 48);
    const wide = name.length * 6.3, at = { x: x(one.time) + 8, y: y(one.score) - 8 };
    if (at.x + wide > width - right) at.x = x(one.time) - 8 - wide;
    if (at.x < left || labelled.some((other) => Math.abs(other.y - at.y) < 14 && other.x < at.x + wide && at.x < other.x + other.wide)) continue;
    labelled.push({ ...at, wide });
    picture.append(text("label", at.x, Math.max(at.y, 12), name));
  }
  const open = (mark) => { location.hash = `cell=${address(board.field("cell", mark.point.row))}`; };
  const tell = (mark) => {
    tip.replaceChildren(...tellPoint(mark.point, axis).map((part, at) => make("div", at ? {} : { class: "who" }, part)));
    tip.hidden = false;
    tip.style.left = `${Math.max(0, Math.min(x(mark.point.time) + 12, width - tip.offsetWidth - 4))}px`;
    const below = y(mark.point.score) + 12;
    tip.style.top = `${below + tip.offsetHeight > height ? Math.max(0, below - tip.offsetHeight - 24) : below}px`;
  };
  (drawn.find(({ point }) => onFront.has(point)) ?? drawn[0]).tabIndex = 0;
  const listen = (type, act) => picture.addEventListener(type, (event) => { if (event.target.point) act(event.target, event); });
  const rest = () => { tip.hidden = true; };
  // A pointer that rests beside the points does not silence the one that the keyboard is at.
  const pointed = (event) => {
    const mark = [event.target, document.activeElement].find((one) => one?.point);
    if (mark) tell(mark); else rest();
  };
  picture.addEventListener("pointerover", pointed);
  picture.addEventListener("pointerleave", pointed);
  listen("focusin", tell);
  listen("focusout", rest);
  listen("click", open);
  listen("keydown", (mark, event) => {
    const at = drawn.indexOf(mark);
    const next = { ArrowRight: at + 1, ArrowUp: at + 1, ArrowLeft: at - 1, ArrowDown: at - 1, Home: 0, End: drawn.length - 1 }[event.key];
    if (event.key === "Enter" || event.key === " ") open(mark);
    else if (event.key === "Escape") rest();
    else if (next === undefined) return;
    else if (drawn[next]) {
      mark.tabIndex = -1;
      drawn[next].tabIndex = 0;
      drawn[next].focus({ preventScroll: true });
    }
    event.preventDefault();
  });
  return [make("div", { class: "canvas" }, picture, tip)];
};
