// A link to a cell unfolds it, before the browser goes there.
const unfold = (hash) => {
  const cell = hash.length > 1 ? document.getElementById(decodeURIComponent(hash.slice(1))) : null;
  if (cell instanceof HTMLDetailsElement) cell.open = true;
  return cell;
};
document.addEventListener("click", (event) => {
  const link = event.target instanceof Element ? event.target.closest('a[href^="#"]') : null;
  if (link) unfold(link.hash);
});
window.addEventListener("hashchange", () => unfold(location.hash));
// Paper cannot be unfolded.
window.addEventListener("beforeprint", () => {
  for (const notes of document.querySelectorAll("details.folded")) notes.open = true;
});
const first = unfold(location.hash);
if (first) first.scrollIntoView();
