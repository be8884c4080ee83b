"""Animations of a motion: a film as GIF or MP4, or an HTML player."""

from tpbso_casadi.animation.frames import Frames, frames_of
from tpbso_casadi.animation.player import SCRIPT, STYLE, page, player
from tpbso_casadi.animation.write import animate, check_animation

__all__ = ["SCRIPT", "STYLE", "Frames", "animate", "check_animation", "frames_of", "page", "player"]
