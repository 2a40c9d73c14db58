"""``tactbench docs``: the pages that came with this version."""

from __future__ import annotations

from pathlib import Path

import click

import tactbench


@click.command(name="docs")
@click.argument("page", required=False)
def command(page: str | None) -> None:
    """List the pages of documentation, or print one as it is written, in Markdown.

    PAGE is a name of the list, or what a screen says, such as docs/events.md.
    """
    from tactbench.core.errors import UnknownNameError

    pages = installed_pages()
    if page is None:
        for name, path in pages.items():
            click.echo(f"{name:<{max(map(len, pages))}}  {_title(path)}")
        return
    name = page.removeprefix("docs/").partition("#")[0].removesuffix(".md")
    if name not in pages:
        raise UnknownNameError("page", page, pages)
    click.echo(pages[name].read_text(encoding="utf-8"), nl=False)


def installed_pages() -> dict[str, Path]:
    """Return the pages by name: those in the installed package, or in the checkout that it is used from.

    Raises
    ------
    ConfigError
        If the installation has lost them.
    """
    from tactbench.core.errors import ConfigError

    package = Path(tactbench.__file__).parent
    places = (package / "docs", package.parent / "docs")
    for place in places:
        if (place / "index.md").is_file():
            return {
                path.relative_to(place).with_suffix("").as_posix(): path
                for path in sorted(place.rglob("*.md"), key=lambda path: (path.parent != place, path.name))
            }
    raise ConfigError(places[0].name, None, "tactbench was installed without its pages.", hint="Install it again.")


def _title(page: Path) -> str:
    lines = page.read_text(encoding="utf-8").splitlines()
    return next((line.removeprefix("# ") for line in lines if line.startswith("# ")), "")
