// The page's data: JSON documents, deflated, as base64; the head first, then each column.
const packed = () => JSON.parse(document.getElementById("data").textContent);

const inflated = async (text) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).json();
};

// One value a row: `dictionary` has the values, `index` the place in it of each row's; `sort` is what numbers are
// compared by.
const readColumn = ({ values, dictionary = values, index = dictionary.map((_, place) => place), sort }) => ({
  dictionary, index, sort: sort && Float64Array.from(sort, (one) => one ?? NaN),
  raw: (row) => dictionary[index[row]], text: (row) => asText(dictionary[index[row]]),
});

const intervalEnds = (text) => (text.match(/[-−]?\d+(\.\d+)?/g) ?? []).map((one) => Number(one.replace("−", "-")));
