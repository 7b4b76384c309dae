"""How tests look at a player that is mounted in a page."""

from __future__ import annotations


def frame(opened) -> int:
    """The frame that is shown, counted from 1, when the picture has been drawn."""
    opened.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return int(opened.locator(".rp-readout").inner_text().split("/")[0])


def button(opened, name: str):
    return opened.get_by_role("button", name=name, exact=True)


def picture(opened) -> str:
    """What the player has drawn, as text that differs where the picture does."""
    frame(opened)
    return opened.evaluate("document.querySelector('.rp-canvas').toDataURL()")


def box_of(opened, label: str):
    """The checkbox of a figure."""
    return opened.get_by_role("checkbox", name=label)


def until(opened, told: str) -> None:
    """Waits for a JavaScript expression to be true, looking with every picture that the screen shows."""
    opened.evaluate(
        f"""new Promise((done) => {{
            const look = () => ({told} ? done() : requestAnimationFrame(look));
            look();
        }})"""
    )


SHOWN = "parseInt(document.querySelector('.rp-readout').textContent)"
"""The frame in the read-out, in JavaScript."""
