"""Reads and writes the settings of a training as YAML files."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

from walker_sim.files import replace_file
from walker_sim.training.settings import Settings, SettingsError, settings_from

_EXPONENT = "!exponent"
"""Tag of numbers such as 1e-2 and 1e4, which are numbers in world files and for ROS, too. For YAML
1.1 they are texts."""


def _with_exponents(base: Any) -> Any:
    """Returns a subclass of a YAML loader or dumper that has them."""
    kind: Any = type(base.__name__, (base,), {})
    pattern = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$")
    kind.add_implicit_resolver(_EXPONENT, pattern, list("-+.0123456789"))
    return kind


def _exponent(loader: Any, node: Any) -> float:
    value = float(loader.construct_scalar(node))
    return int(value) if value.is_integer() and abs(value) <= 1 << 53 else value


def _load(text: str) -> Any:
    """Parses YAML; a SettingsError names a key that a mapping has twice."""
    import yaml

    special = [f"tag:yaml.org,2002:{name}" for name in ("merge", "value")]  # the keys << and =

    class Loader(_with_exponents(yaml.SafeLoader)):  # type: ignore[misc]
        def compose_mapping_node(self, anchor: str | None) -> Any:
            node = super().compose_mapping_node(anchor)
            seen = set()
            for key_node, _ in node.value:
                if isinstance(key_node, yaml.ScalarNode) and key_node.tag not in special:
                    key = self.construct_object(key_node)
                    if key in seen:
                        line = key_node.start_mark.line + 1
                        raise SettingsError(f"line {line}: {key}: must be given once")
                    seen.add(key)
            return node

    Loader.add_constructor(_EXPONENT, _exponent)
    return yaml.load(text, Loader)


def read_settings(path: Path) -> Settings:
    """Reads a YAML file. A SettingsError names the file, the setting and what is allowed."""
    import yaml

    try:
        given = _load(path.read_text(encoding="utf-8"))
        if not isinstance(given, dict):
            raise SettingsError("must be a mapping of settings")
        return settings_from(given)
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from error
    except RecursionError as error:
        raise SettingsError(f"{path}: not YAML: nested too deep") from error
    except (yaml.YAMLError, ValueError) as error:  # ValueError: not UTF-8, or an impossible date
        raise SettingsError(f"{path}: not YAML: {error}") from error


def write_settings(settings: Settings, path: Path) -> None:
    import yaml

    plain = dataclasses.asdict(settings)
    dumper = _with_exponents(yaml.SafeDumper)  # quotes texts that would be read as numbers
    text = yaml.dump(plain, Dumper=dumper, sort_keys=False, default_flow_style=None)
    replace_file(path, text.encode())
