"""What a shell completes a value with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import shtab

FUNCTIONS = {
    "bash": '{name}() {{\n  compgen -W "{words}" -- "$1"\n{files}}}',
    "zsh": "{name}() {{\n  _alternative '{label}s:{label}:({words})'{files}\n}}",
}
OR_FILES = {"bash": '  compgen -f -- "$1"\n', "zsh": " 'files:file:_files'"}


class Completion(Protocol):
    """What a value is completed with."""

    @property
    def patterns(self) -> Mapping[str, str]:
        """How each shell is told."""


@dataclass(frozen=True)
class Entries:
    """Files or folders.

    Attributes:
        patterns: how each shell is told.
    """

    patterns: Mapping[str, str]


FILES = Entries({shell: str(pattern) for shell, pattern in shtab.FILE.items()})
FOLDERS = Entries({shell: str(pattern) for shell, pattern in shtab.DIRECTORY.items()})


@dataclass(frozen=True)
class Words:
    """Names.

    Attributes:
        label: what they are names of.
        words: the names.
        or_files: whether a file will do as well.
    """

    label: str
    words: tuple[str, ...]
    or_files: bool = False

    @property
    def patterns(self) -> Mapping[str, str]:
        """How each shell is told; a shell that has functions by the name of one."""
        listed = f"`echo {' '.join(self.words)} *`" if self.or_files else f"({' '.join(self.words)})"
        return {**dict.fromkeys(FUNCTIONS, self._name), "tcsh": listed}

    def function(self, shell: str) -> str:
        """The function by that name; empty for a shell that has none."""
        files = OR_FILES.get(shell, "") * self.or_files
        form = FUNCTIONS.get(shell, "")
        return form.format(name=self._name, label=self.label, words=" ".join(self.words), files=files)

    @property
    def _name(self) -> str:
        return f"_tpbso_{self.label}" + "_or_file" * self.or_files
