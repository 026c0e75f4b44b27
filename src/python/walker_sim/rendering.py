"""What is said to who wants pictures, of which there are none yet."""

from __future__ import annotations

from typing import Any

from walker_sim.transport import Specification


class RenderingUnavailable(TypeError, ValueError):
    """There is no rendering.

    A TypeError as well: that is what learners such as Stable-Baselines3, which ask for pictures
    first, take from an environment without.
    """


def metadata_of(specification: Specification) -> dict[str, Any]:
    """What Gymnasium's environments say of their pictures."""
    return {"render_modes": [], "render_fps": round(1 / specification["dt"])}


def check_render_mode(render_mode: str | None) -> None:
    """Refuses every mode but None.

    Raises
    ------
    RenderingUnavailable
        Naming the mode.
    """
    if render_mode is not None:
        raise RenderingUnavailable(
            f"render_mode = {render_mode!r}: there is no rendering yet; must be None"
        )
