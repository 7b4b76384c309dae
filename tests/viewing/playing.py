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


def until(opened, condition: str) -> None:
    """Waits for a JavaScript expression to be true, looking with every picture that the screen shows."""
    opened.evaluate(
        f"""new Promise((done) => {{
            const look = () => ({condition} ? done() : requestAnimationFrame(look));
            look();
        }})"""
    )


SHOWN = "parseInt(document.querySelector('.rp-readout').textContent)"
"""The frame in the read-out, in JavaScript."""

RED = """(share) => {
    const shown = document.querySelector(".rp-canvas"), { width, height } = shown;
    const strip = Math.ceil(share * width);
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(shown, 0, 0);
    let seen = 0;
    for (const x of [0, width - strip]) {
        const { data } = context.getImageData(x, Math.round(height / 5), strip, Math.round(height * 4 / 5));
        for (let at = 0; at < data.length; at += 4) if (data[at] > 40 + 2 * data[at + 1]) seen++;
    }
    return seen;
}"""
"""Pixels that are red, in so much of the picture's width at its left and at its right."""
