"""The rig that docs/plugins.md shows: its file is read and checked as the page says."""

import re

from tests.conftest import ROOT
from tests.core.matrix.plugin_packages import write_metadata

CHECKED = {
    "{force_ceiling: 5}": (2, r"rig\.yaml:4.*force_ceiling_n"),
    "{force_ceiling_n: 5}": (0, "5 N.*No device was opened"),
    "{force_ceiling_n: 12}": (1, "refused: The frame bears 10 N.*12 N"),
}


def test_its_file_is_checked_and_its_check_is_printed(verbs):
    page = (ROOT / "docs" / "plugins.md").read_text(encoding="utf-8")
    (source,) = re.findall(r"```python\n# acme_rig\.py\n(.*?)```", page, flags=re.DOTALL)
    (verbs.folder / "acme_rig.py").write_text(source, encoding="utf-8")
    write_metadata(verbs.folder, "acme-rig", "1.0", points="acme-rig = acme_rig")
    for settings, (code, said) in CHECKED.items():
        lines = ("version: 1", "rig: acme-press", "sensors: {icub: {link: emulated}}", f"settings: {settings}")
        (verbs.folder / "rig.yaml").write_text("\n".join(lines), encoding="utf-8")
        done = verbs("doctor", "--seconds", "0", "--rig-file", "rig.yaml", plugins=(str(verbs.folder),), code=code)
        assert re.search(said, done.stdout + done.stderr, re.DOTALL), done.stdout
