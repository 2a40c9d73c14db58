import pytest

from tactbench.core.errors import ConfigError
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.yaml_file import load_yaml, plain_value

GOOD = "version: 1\nsensors: [biotac]\ntasks:\n  - force\n  - name: curvature\n    estimators: [forest]\n"


def load(tmp_path, text):
    path = tmp_path / "matrix.yaml"
    path.write_text(text)
    return load_yaml(path, MatrixSpec)


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        (GOOD.replace("sensors", "sensor"), 2, "'sensors'"),
        (GOOD.replace("    estimators", "    estimatrs"), 6, "'estimators'"),
        (GOOD + "repeats: many\n", 7, "(given: 'many')"),
        (GOOD + "latency: 3\n", 7, "(given: 3)"),
        (GOOD + "seed: [1, 2]\n", 7, "integer."),
        (GOOD.replace("[forest]", "[{name: 3}]"), 6, "(given: 3)"),
        (GOOD + "seed: 1\nseed: 2\n", 8, "twice"),
        ("tasks: [\n", 2, ""),
        ("version: 1\n", 1, "'tasks'"),
    ],
)
def test_complaints_name_file_and_line(tmp_path, text, line, says):
    with pytest.raises(ConfigError) as caught:
        load(tmp_path, text)
    assert str(caught.value).startswith(f"{tmp_path / 'matrix.yaml'}:{line}:")
    assert says in str(caught.value)


@pytest.mark.parametrize("key", ["010", "yes", "2025-04-01", "~"])
def test_a_key_that_yaml_would_change_is_refused_as_it_is_written(tmp_path, key):
    with pytest.raises(ConfigError, match=rf"matrix.yaml:2: (the key )?{key} ") as caught:
        load(tmp_path, f"tasks: [force]\n{key}: 1\n")
    assert f"'{key}'" in caught.value.hint
    with pytest.raises(ConfigError, match=f"'{key}' is not known"):
        load(tmp_path, f"tasks: [force]\n'{key}': 1\n")


@pytest.mark.parametrize("value", ["010", "12:30"])
def test_a_number_in_an_odd_notation_is_refused(tmp_path, value):
    with pytest.raises(ConfigError, match=f"matrix.yaml:2: YAML reads {value} "):
        load(tmp_path, f"tasks: [force]\nrepeats: {value}\n")
    assert plain_value(value) == value


def test_a_file_that_cannot_be_read_is_a_config_error(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.yaml"):
        load_yaml(tmp_path / "none.yaml", MatrixSpec)
    for text in (b"", b"day: 2024-99-99", b"tasks: [caf\xe9]"):
        (tmp_path / "matrix.yaml").write_bytes(text)
        with pytest.raises(ConfigError, match=r"matrix\.yaml"):
            load_yaml(tmp_path / "matrix.yaml", MatrixSpec)


@pytest.mark.parametrize(("text", "value"), [("3", 3), ("0.5", 0.5), ("yes", True), ("a b", "a b"), ("[1]", "[1]")])
def test_a_plain_value(text, value):
    assert plain_value(text) == value
    assert type(plain_value(text)) is type(value)
