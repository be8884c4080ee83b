"""The player: an HTML element that shows a motion, and what its page needs."""

from tpbso_casadi.animation.player.element import page, player
from tpbso_casadi.animation.player.sources import SCRIPT, STYLE

__all__ = ["SCRIPT", "STYLE", "page", "player"]
