"""Whose clock a time was taken by, and beside how many others: what keeps times apart that are not comparable."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import count, product
from string import ascii_uppercase

from tactbench.core.leaderboard.names import Row, distinct
from tactbench.core.tables.text import visible


def host_letters(rows: Iterable[Row]) -> dict[str, str]:
    """Return a letter for each host that timed one of the rows, in order of their ids; none if there is but one."""
    hosts = sorted({host for host, _ in _clocks(rows)})
    letters = ("".join(letters) for length in count(1) for letters in product(ascii_uppercase, repeat=length))
    return dict(zip(hosts, letters, strict=False)) if len(hosts) > 1 else {}


def timing_mark(row: Row, letters: Mapping[str, str]) -> str:
    """Return what stands behind every time of a row: ``[A]`` for the host, ``‖4`` for four cells at once."""
    letter, at_once = letters.get(_host(row)), _at_once(row)
    return (f" [{letter}]" if letter else "") + (f" ‖{at_once}" if at_once > 1 else "")


def timing_notes(rows: Iterable[Row], letters: Mapping[str, str], provenance: Iterable[Row]) -> list[str]:
    """Return what the marks of times mean; `provenance` tells of the runs, among it `host`, `cpu` and `cores`."""
    machines = {str(one.get("host", "")): one for one in provenance}
    notes = [f"[{letter}] timed on {_machine(host, machines.get(host))}." for host, letter in letters.items()]
    if letters:
        notes.append("Times marked with different letters are of different hosts: compare none of them. Scores do not "
                     "depend on the host and are ranked together.")  # fmt: skip
    hosts = distinct((at_once, host) for host, at_once in _clocks(rows))
    for at_once in sorted(hosts.keys() - {1}):
        cores = {host: machines.get(host, {}).get("cores") for host in hosts[at_once]}
        crowded = sorted(visible(host) for host, n in cores.items() if type(n) is int and at_once > n)
        more = f", more than the cores of host {' and of host '.join(crowded)}" if crowded else ""
        notes.append(f"‖{at_once}: timed while {at_once} cells ran at once{more}: not comparable with times measured "
                     "alone.")  # fmt: skip
    return notes


def _clocks(rows: Iterable[Row]) -> set[tuple[str, int]]:
    """Return by which hosts rows were timed, and while how many cells ran at once."""
    times = ("fit_s", "sim_s", "predict_s", "latency_ms_p50", "latency_ms_p95")
    return {
        (_host(row), _at_once(row))
        for row in rows
        if row["status"] == "done" and any(row[time] is not None for time in times)
    }


def _host(row: Row) -> str:
    return str(row.get("host") or "")


def _at_once(row: Row) -> int:
    return int(row.get("concurrency") or 1)


def _machine(host: str, machine: Row | None) -> str:
    name = f"host {visible(host)}" if host else "a host that its rows do not name"
    if not machine:
        return f"{name}, of which nothing else is known"
    return f"{name}: {visible(str(machine.get('cpu') or 'unknown CPU'))}, {visible(str(machine.get('cores')))} cores"
