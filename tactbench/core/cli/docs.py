"""``tactbench docs``: the pages that came with this version."""

from __future__ import annotations

from pathlib import Path

import click

from tactbench.core.cli.config import shipped


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
    """Return the pages by name: those in the installed package, or in the checkout that it is used from."""
    folder = shipped("docs/index.md", "docs/index.md", "Install it again.").parent
    return {
        path.relative_to(folder).with_suffix("").as_posix(): path
        for path in sorted(folder.rglob("*.md"), key=lambda path: (path.parent != folder, path.name))
    }


def _title(page: Path) -> str:
    lines = page.read_text(encoding="utf-8").splitlines()
    return next((line.removeprefix("# ") for line in lines if line.startswith("# ")), "")
