"""Reads LaTeX of tables back, and refuses what would not compile or would act."""

import re
import unicodedata

_SIGNS = {
    r"\textbackslash{}": "\\", r"\&": "&", r"\%": "%", r"\$": "$", r"\#": "#", r"\{": "{", r"\}": "}",
    r"\_\allowbreak{}": "_", r"=\allowbreak{}": "=",
    r"\textasciitilde{}": "~", r"\textasciicircum{}": "^", r"\textless{}": "<", r"\textgreater{}": ">",
    r"\textbar{}": "|", "{''}": '"', "{[}": "[", "{]}": "]", "{*}": "*", r"$\dagger$": "†", r"$\ddagger$": "‡",
    r"$\|$": "‖", "---": "—", "--": "–", r"\ldots{}": "…", r"$\cdot$": "·", r"$\times$": "×", r"$\pm$": "±",
    r"$\le$": "≤", r"$\ge$": "≥", "$-$": "−", r"$\mu$": "µ", "$^2$": "²", "$^3$": "³", r"$^\circ$": "°", r"{\ss}": "ß",
    r"\,": "\u202f",
    "-{}": "-", "`{}": "`", "'{}": "'", "?{}": "?", "!{}": "!", ",{}": ",",
}  # fmt: skip
_TOKEN = re.compile(
    "|".join(re.escape(sign) for sign in sorted(_SIGNS, key=len, reverse=True))
    # What a line of text may hold as it is; two of these that TeX draws as one have been taken apart.
    + r"|(?P<plain>(?!--|``|''|\?`|!`|,,)[A-Za-z0-9À-ÖØ-öø-ÿ .:;()/+@,'`?!-])"
)


def untex(text):
    """Return what is set."""
    place, read = 0, []
    while place < len(text):
        token = _TOKEN.match(text, place)
        assert token, f"would act or not compile: {text[place:]!r}"
        read.append(token["plain"] or _SIGNS[token[0]])
        place = token.end()
    return "".join(read)


def as_set(text):
    """Return `text` as LaTeX can set it: letters it has none of by their number."""
    return "".join(map(_letter, text.replace("μ", "µ")))


def _letter(one):
    if one.isascii() or one in _SIGNS.values():
        return one
    accented = "À" <= one <= "ÿ" and unicodedata.decomposition(one)
    return one if accented else f"U+{ord(one):04X}"
