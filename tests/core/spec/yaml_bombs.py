"""Small YAML texts that would take a naive reader long, or for ever."""


def _aliases(lines, per_line):
    made = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    made += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * per_line)}]" for n in range(1, lines)]
    return "\n".join(made) + "\n"


BOMBS = {
    "billion laughs": _aliases(9, 9),
    "few aliases, deep": _aliases(30, 3),
    "many aliases": "a: &a x\nb: [" + ", ".join(["*a"] * 5000) + "]\n",
    "list in itself": "tasks: &a [*a]\n",
    "mapping in itself": "&a\ntasks: *a\n",
    "two in each other": "a: &a [&b [*a, *b], *b]\n",
    "merged with itself": "a: &a {<<: *a}\n",
    "brackets": "[" * 100_000,
    "braces": "{a: " * 50_000,
    "dashes": "- " * 100_000,
    "indented": "\n".join(" " * n + "a:" for n in range(600)),
    "keys of keys": "? " * 50_000,
    "closed brackets": "a: " + "[" * 40 + "]" * 40,
    "large": "a: " + "x " * 2**18,
    "digits": "seed: " + "9" * 100_000,
    "base sixty": "seed: 1" + ":1" * 60_000,
    "exponent": "seed: 1e999999999\n",
    "many keys": "\n".join(f"k{n}: {n}" for n in range(8_000)),
    "one key, many times": "a: 1\n" * 20_000,
    "objects": "a: !!python/object/apply:os.system [true]\n",
    "binary": "a: !!binary " + "A" * 100_000 + "\n",
    "tag directive": "%TAG ! tag:yaml.org,2002:python/\n---\na: !name:os.system\n",
    "control characters": "a: \x00\x07\n",
    "mark of order": "\ufeff" * 1000,
}
