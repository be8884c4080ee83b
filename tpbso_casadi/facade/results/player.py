"""The player of a motion inside a notebook."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import Self

from tpbso_casadi.planning.motion import Motion


@dataclass(frozen=True, repr=False)
class Player:
    """A page that plays a motion; a notebook shows it in a frame.

    Attributes:
        page: the whole page, HTML.
        title: what it shows.
        height: of the frame, pixels.
    """

    page: str
    title: str
    height: int

    @classmethod
    def of(cls, motion: Motion, title: str, height: int) -> Self:
        """The player of a motion."""
        from tpbso_casadi.animation.frames import frames_of  # noqa: PLC0415 (slow to load)
        from tpbso_casadi.animation.player import page  # noqa: PLC0415

        return cls(page(title, frames_of(motion)), title, height)

    def __repr__(self) -> str:
        return f"<player of a {self.title}; plan.animate('motion.html') writes it>"

    def _repr_html_(self) -> str:
        page, style = escape(self.page), f"width: 100%; height: {self.height}px; border: 0"
        return f'<iframe title="{escape(self.title)}" srcdoc="{page}" style="{style}"></iframe>'
