"""The page as people see it, who open it from disk in a browser."""

import re

import pytest

from tests.report.odd_runs import LABEL


def order(page, table=0):
    """The methods of a table, from above."""
    return (
        page.locator("table.results")
        .nth(table)
        .locator("tbody tr[data-row]")
        .evaluate_all("rows => rows.map((row) => row.dataset.row)")
    )


def sideways(page):
    """By how much the page is wider than the window."""
    return page.evaluate("document.documentElement.scrollWidth - innerWidth")


def cases(page):
    return page.locator("#cases tr").all_inner_texts()


def shown(page):
    """The methods that the player shows."""
    chips = page.locator("#player .rp-chip:has(input:checked) .rp-name").all_inner_texts()
    return [each for each in chips if each not in ("source", "reference")]


@pytest.fixture
def page(report_file, open_page):
    opened = open_page(report_file, width=1200)
    opened.wait_for_selector("#player canvas")
    opened.on("dialog", lambda dialog: pytest.fail(f"a name was run: {dialog.message}"))
    return opened


def test_tables_sort_by_click_and_by_key(page):
    before = order(page)
    head = page.locator("table.results").first.locator("thead th").first
    head.get_by_role("button").click()
    assert head.get_attribute("aria-sort") == "ascending"
    assert order(page)[:2] == sorted(order(page)[:2])
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "descending"
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") is None
    assert order(page) == before


def test_a_number_leads_to_its_cases_worst_first_and_back(page):
    assert page.locator("#caption").inner_text().startswith("cross: ")
    assert page.evaluate("document.querySelector('#player canvas').width") > 300
    assert page.locator("#cases tr[aria-current]").count() == 1
    row = (
        page.locator("main table.results[data-split=cross]")
        .first.locator("tbody tr[data-row]")
        .filter(has_text=LABEL)
    )
    number = row.locator(".num").nth(1)
    number.click()
    assert f"cross, {LABEL}: 6 cases" in page.locator("#what").inner_text()
    numbers = [float(each.split("\t")[-1]) for each in cases(page)]
    assert numbers == sorted(numbers, reverse=True)
    assert page.locator("#method").evaluate("each => each.selectedOptions[0].textContent") == LABEL
    assert len(shown(page)) == 2  # it, and one to compare it with
    assert LABEL in shown(page)
    assert page.evaluate("document.activeElement.id") == "watch-title"
    page.locator("#back").click()
    assert number.evaluate("each => each === document.activeElement")


def test_marks_lead_to_their_cases_by_keys_and_clicks(page):
    marks = page.locator("#chapter-1-clips svg").first.locator(".pick")
    assert marks.evaluate_all("all => all.filter((each) => each.tabIndex === 0).length") == 1
    assert set(marks.evaluate_all("all => all.map((each) => each.role)")) == {"button"}
    marks.first.focus()
    page.keyboard.press("ArrowDown")
    now = page.evaluate("document.activeElement.getAttribute('aria-label')")
    assert now != marks.first.get_attribute("aria-label")
    page.keyboard.press(" ")
    assert re.search(r", clip .*: \d cases?", page.locator("#what").inner_text())
    page.locator("#clear").click()
    assert ": 6 cases" in page.locator("#what").inner_text()
    mark = page.locator("#chapter-1-clips .pick").first
    mark.dispatch_event("click")
    assert f", clip {mark.get_attribute('data-clip')}: 3 cases" in page.locator("#what").inner_text()


def test_methods_are_taken_out_of_charts_and_put_back(page):
    name = page.locator(".legend button[aria-pressed=true]").first.get_attribute("data-style")
    button = page.locator(f".legend button[data-style={name}]")
    drawn = page.locator(f".panels .{name}").first
    assert drawn.evaluate("each => getComputedStyle(each).display") != "none"
    first = page.locator("#chapter-1-clips svg").first.locator(".pick").first
    button.click()
    assert button.get_attribute("aria-pressed") == "false"
    assert drawn.evaluate("each => getComputedStyle(each).display") == "none"
    assert first.get_attribute("tabindex") == "-1"  # what is not seen is no stop
    stops = page.locator("#chapter-1-clips svg").first.locator(".pick[tabindex='0']")
    assert stops.count() == 1
    button.press("Enter")
    assert drawn.evaluate("each => getComputedStyle(each).display") != "none"


def test_cases_methods_splits_and_names_can_be_chosen(page):
    before = page.locator("#caption").inner_text()
    page.locator("#cases tr:not([aria-current]) button").first.click()
    assert page.locator("#caption").inner_text() != before
    page.locator("#method").select_option(label=LABEL)
    assert len(shown(page)) == 2  # it, and one to compare it with
    assert LABEL in shown(page)
    page.locator("#split").select_option(label="intra")
    assert page.locator("#what").inner_text().startswith(f"intra, {LABEL}")
    page.locator("#name").fill("script")
    assert len(cases(page)) == 3
    nameless = page.locator("main button, main [role=button], #watch select, #watch input").evaluate_all(
        "all => all.filter((each) => !(each.ariaLabel || each.innerText || each.labels?.length)).length"
    )
    assert nameless == 0


def test_a_phone_shows_all_of_it(report_file, open_page):
    page = open_page(
        report_file, width=360, height=700, color_scheme="dark", has_touch=True, reduced_motion="reduce"
    )
    page.wait_for_selector("#player canvas")
    assert sideways(page) <= 0
    names = page.locator("table.results thead th").first.bounding_box()
    assert names["width"] < 0.45 * 360  # the numbers beside them are seen
    wide = page.locator("main .scroll:has(table.results)").first
    wide.evaluate("each => (each.scrollLeft = 1000)")
    assert wide.evaluate("each => each.scrollLeft") > 0
    left = wide.locator("tbody th").first.bounding_box()["x"]
    assert left == wide.bounding_box()["x"]  # names stay where they are
    page.locator(".num").first.tap()
    assert page.locator("#watch").evaluate("each => Math.abs(each.getBoundingClientRect().top) < 40")
    page.locator("summary").evaluate_all("all => all.forEach((each) => (each.parentNode.open = true))")
    assert sideways(page) <= 0
    page.set_viewport_size({"width": 1800, "height": 900})  # wide: motion stays beside the numbers
    page.locator("#chapter-1-clips .pick").first.click()
    for part in ("#caption", "#chapter-1-clips .pick.now"):
        assert 0 <= page.locator(part).first.bounding_box()["y"] < 900
