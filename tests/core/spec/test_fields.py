"""Numbers that the models declare: bounds and defaults of their fields, and constants.

Each of them decides what files are accepted or how recordings are made. ``python -m tests.core.spec.test_fields``
writes them anew, to be looked at.
"""

import importlib
import pkgutil
from pathlib import Path

import annotated_types
import pytest
from pydantic import BaseModel, ValidationError

from tactbench.core import spec
from tactbench.core.spec.quantity import Frozen, Quantity, Source
from tactbench.core.spec.row import FORMAT
from tactbench.core.spec.scene import NUISANCES, RANGES

FILE = Path(__file__).parent / "fields.txt"
MODULES = [importlib.import_module(f"{spec.__name__}.{one.name}") for one in pkgutil.iter_modules(spec.__path__)]
BOUNDS = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<", "min_length": "at least this long:"}


def numeric(value):
    return isinstance(value, int | float | Quantity) or (isinstance(value, tuple) and all(map(numeric, value)))


def declared():
    """Return a line for each constant, and for each field that has bounds or a number as its default."""
    found = []
    for module in MODULES:
        for name, value in vars(module).items():
            if (
                name.isupper()
                and not name.startswith("_")
                and value != ()
                and (numeric(value) or isinstance(value, Frozen))
            ):
                found.append(f"{name} = {value!r}")
            if not (isinstance(value, type) and issubclass(value, BaseModel) and value.__module__ == module.__name__):
                continue
            for field, info in value.model_fields.items():
                bounds = [f"{sign} {getattr(one, key)}" for one in info.metadata
                          if isinstance(one, annotated_types.BaseMetadata)
                          for key, sign in BOUNDS.items() if hasattr(one, key)]  # fmt: skip
                own = info.default != () and numeric(info.default)
                if bounds or own:
                    found.append(" ".join([f"{name}.{field}", *bounds, *([f"= {info.default}"] if own else [])]))
    found += [f"nuisance {name}: {'.'.join(way)} in {unit}" for name, (way, unit) in NUISANCES.items()]
    found += [f"range of {name}: {one}" for name, one in RANGES.items()]
    for key, types in FORMAT.items():
        found.append(f"row {key}: {', '.join(sorted(one.__name__ for one in types))}")
    return "\n".join([*dict.fromkeys(found), ""])


def test_bounds_and_defaults_are_those_that_were_looked_at():
    assert declared() == FILE.read_text(encoding="utf-8")


def test_a_model_takes_no_unknown_field_and_no_change():
    source = Source(tag="assumed", reference="a test")
    with pytest.raises(ValidationError):
        Source(tag="assumed", reference="a test", page=3)
    with pytest.raises(ValidationError):
        source.reference = "another"


if __name__ == "__main__":
    FILE.write_text(declared(), encoding="utf-8")
