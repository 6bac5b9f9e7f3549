"""Variables of OpenDSS files: names that begin with @ and stand for text."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace

from .dss_tokens import Parameter
from .dss_words import word_list

__all__ = ["VariableError", "Variables"]

MAX_VALUE_CHARS = 20_000

_OF_THE_ENGINE = frozenset(
    word_list(
        """@lastfile @lastexportfile @lastshowfile @lastplotfile @lastredirectfile
        @lastcompilefile @result"""
    )
)
_NAME = re.compile(r"""(?:^|(?<=[\s,|(\["'{]))@[^\s,|.^)\]"'}]+""")


class VariableError(Exception):
    """A variable is not accepted; the text says why."""


@dataclass(slots=True)
class Variables:
    """Variables defined so far, by name in lower case."""

    values: dict[str, str] = field(default_factory=dict)

    def define(self, parameter: Parameter) -> None:
        """Take in ``@name=value``; a name alone asks for its value and does nothing.

        Raises
        ------
        VariableError
            If it is neither.
        """
        if not parameter.name:
            return
        if not parameter.name.startswith("@"):
            raise VariableError("must have a name that begins with @")
        if "@" in parameter.value or len(parameter.value) > MAX_VALUE_CHARS:
            raise VariableError(f"must stand for text without @ of {MAX_VALUE_CHARS:,} characters")
        self.values[parameter.name.lower()] = parameter.value

    def put_in(self, parameter: Parameter) -> Parameter:
        """Return the parameter with the variables' values in the place of their names.

        Raises
        ------
        VariableError
            If it holds one of the engine's own, which name files outside.
        """
        if "@" not in parameter.value:
            return parameter
        return replace(parameter, value=_NAME.sub(self._value, parameter.value))

    def _value(self, name: re.Match[str]) -> str:
        """Return the value of a variable, or its name where it is none."""
        found = name.group().lower()
        if found in _OF_THE_ENGINE:
            raise VariableError("must not be one of the engine's own")
        return self.values.get(found, name.group())
