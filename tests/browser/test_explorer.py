"""The explorer as a person uses it, in a browser."""

import json
from urllib.parse import parse_qs, urlencode

import numpy as np
import pytest

import sigdb
from sigdb.explorer import write_static


def painted(page, **wanted):
    """What the page paints once its view has the wanted settings."""
    for name, value in wanted.items():
        page.wait_for_selector(f"body[data-painted*='\"{name}\":{json.dumps(value)}']")
    return json.loads(page.get_attribute("body", "data-painted"))


def event_at(page):
    """The tooth pass in which the shown average differs most from the healthy one."""
    with page.expect_download() as download:
        page.click("[data-save=csv]")
    table = np.genfromtxt(download.value.path(), delimiter=",", skip_header=1)
    stiffness, healthy = table[:, 3], table[:, 4]
    return int(np.argmax(np.abs(stiffness - healthy)) // 64) + 1


def test_the_address_loses_the_token_and_keeps_the_view(page):
    assert "token" not in page.url
    page.fill("#number-stiffness_loss", "0.3")
    painted(page, stiffness_loss=0.3)
    page.wait_for_url("**stiffness_loss=0.3**")
    assert "token" not in page.url
    page.evaluate(
        """() => {
            const token = localStorage.getItem("sigdb-token");
            localStorage.removeItem("sigdb-token");
            location.hash = "tooth=2&stiffness_loss=0.1&token=" + token;
        }"""
    )
    painted(page, tooth=2)
    assert "token" not in page.url


STATE = {
    "tooth": "4",
    "stiffness_loss": "0.25",
    "snr_db": "3",
    "sensor": "pinion-housing-vertical",
    "tab": "database",
    "rows": "3,9",
    "where": "tooth > 2 and fm4 > 0",
    "sql": "select id, tooth, fm4 from cases where tooth > 2 and fm4 > 0",
    "sort": "-fm4",
    "map": "1",
    "map-x": "damaged_teeth",
    "map-y": "stiffness_loss",
    "map-value": "kurtosis",
    "counts": "12/36",
    "mesh-phase": "1",
    "range-tooth": "1",
    "range-tooth-to": "5",
}


def test_an_address_is_the_whole_state_of_the_page(page):
    """An address opens the state that it holds, and the page then has that address."""
    page.evaluate("hash => { location.hash = hash; }", urlencode(STATE))
    page.wait_for_selector("#cases tbody tr[aria-selected=true]")
    page.wait_for_selector("#map:not([hidden])")
    page.wait_for_selector("#shown:has-text('row 9')")
    shown = [float(text) for text in page.locator("#cases tbody td:nth-child(3)").all_inner_texts()]
    assert shown == sorted(shown, reverse=True)
    assert "mean of kurtosis" in page.inner_text("#map-text")
    page.click("#cases th[data-name=tooth] button")
    held = parse_qs(page.url.partition("#")[2])
    assert {name: value for name, (value,) in held.items()} == STATE | {"sort": "tooth"}


@pytest.mark.parametrize("tooth", [3, 11])
def test_a_dragged_slider_moves_the_event(page, tooth):
    slider = page.locator("#slider-tooth")
    box = slider.bounding_box()
    knob = 16  # px, the width of the knob, whose middle runs over the rest
    x = [box["x"] + knob / 2 + (box["width"] - knob) * value / 12 for value in (6, tooth)]
    page.mouse.move(x[0], box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(x[1], box["y"] + box["height"] / 2, steps=10)
    page.mouse.up()
    painted(page, tooth=tooth)
    assert f"tooth {tooth} of pinion" in page.inner_text("#shown")
    assert event_at(page) in (tooth, tooth + 1)


def test_arrow_keys_move_the_tooth_round_the_gear(page):
    page.click("#shown")
    for expected in (7, 8, 9, 10, 11, 12, 1):
        page.keyboard.press("ArrowRight")
        painted(page, tooth=expected)
    page.keyboard.press("ArrowLeft")
    painted(page, tooth=12)


def test_a_mesh_that_opens_is_said_in_red(page):
    page.fill("#number-stiffness_loss", "0.9")
    page.wait_for_selector("#contact:has-text('The teeth part')")
    assert page.get_attribute("#contact", "class") == "parts"


def test_rows_of_a_database_are_shown_and_overlaid(page):
    page.click("#tab-database")
    page.wait_for_selector("#cases tr[data-id]")
    page.fill("#where", "tooth = 6")
    page.press("#where", "Enter")
    page.wait_for_selector("#cases tbody tr:nth-child(2):last-child")
    page.click("#cases tbody tr:nth-child(2)")
    page.wait_for_selector("#nearest table")
    assert page.inner_text("#nearest tbody tr:first-child td:nth-child(2)") == "6"
    page.click("#cases tbody tr:nth-child(1)", modifiers=["Control"])
    page.wait_for_selector("#shown:has-text(';')")
    (rows,) = parse_qs(page.url.partition("#")[2])["rows"]
    assert len(rows.split(",")) == 2


def test_sql_answers_and_a_map_is_drawn(page):
    page.click("#tab-database")
    page.fill("#sql", "select tooth, count(*) as rows, 65537 as id from cases group by tooth order by tooth")
    page.click("#ask")
    page.wait_for_selector("#cases th:has-text('rows')")
    assert page.inner_text("#cases tbody tr:first-child").split() == ["0", "2", "65537"]
    page.click("#draw-map")
    page.wait_for_selector("#map:not([hidden])")
    assert "26 rows" in page.inner_text("#map-text")


def test_a_slow_answer_does_not_take_the_place_of_a_later_one(page):
    """A question that takes long may be followed by a quick one."""
    held, answers = [], []

    def hold_first(route):
        held.append(route)
        if len(held) > 1:
            route.continue_()

    page.click("#tab-database")
    page.wait_for_selector("#cases tr[data-id]")
    page.route("**/api/table", hold_first)
    page.on("requestfinished", lambda request: answers.append(request) if request.url.endswith("/table") else None)
    page.click("#ask")
    page.fill("#sql", "select count(*) as rows from cases")
    page.click("#ask")
    page.wait_for_timeout(500)
    held[0].continue_()
    for _ in range(200):
        page.wait_for_timeout(50)
        if len(answers) == 2:
            break
    page.wait_for_timeout(200)
    assert page.inner_text("#cases thead").split() == ["rows"]


def test_a_dropped_file_is_shown_and_matched(page, explored, tmp_path):
    opened = sigdb.open(explored)
    row = int(opened.cases("tooth = 3 and stiffness_loss = 0.4")["id"].iloc[0])
    np.save(tmp_path / "average.npy", opened.signals([row])["tsa"][0])
    page.click("#tab-measurement")
    content = (tmp_path / "average.npy").read_bytes()
    transfer = page.evaluate_handle(
        """bytes => {
            const transfer = new DataTransfer();
            transfer.items.add(new File([new Uint8Array(bytes)], 'average.npy'));
            return transfer;
        }""",
        list(content),
    )
    page.dispatch_event("#drop-run", "drop", {"dataTransfer": transfer})
    page.wait_for_selector("#nearest table")
    assert page.inner_text("#nearest tbody tr:first-child td:nth-child(2)") == "3"
    assert "average.npy" in page.inner_text("#shown")
    assert "scaled to the same rms" in page.inner_text("#shown")


def test_copied_python_runs(page):
    page.fill("#number-tooth", "9")
    painted(page, tooth=9)
    page.click("[data-copy=python]")
    page.wait_for_selector("#copied:not([hidden])")
    names = {}
    exec(page.inner_text("#copied"), names)
    expected = sigdb.simulate("nasa-spiral-bevel", {"tooth": 9, "stiffness_loss": 0.5}).signal("pinion-vertical")
    np.testing.assert_allclose(names["average"], expected, rtol=1e-9)


def test_a_page_without_its_token_says_what_to_do(browser, address):
    stranger = browser.new_context().new_page()
    stranger.goto(address.split("#")[0])
    stranger.wait_for_selector("#message:not([hidden])")
    assert "sigdb explore prints" in stranger.inner_text("#message")


def test_the_page_works_on_a_tablet(browser, address):
    tablet = browser.new_page(viewport={"width": 820, "height": 1180}, color_scheme="dark")
    tablet.goto(address)
    tablet.wait_for_selector("body[data-painted]")
    assert tablet.evaluate_handle(
        "() => document.documentElement.scrollWidth <= document.documentElement.clientWidth"
    ).json_value()
    tablet.close()


def test_a_page_is_worked_by_keys_alone(page):
    """A focused slider takes the arrow keys itself; Tab reaches the rows, and Enter shows one."""
    page.focus("#slider-stiffness_loss")
    page.keyboard.press("ArrowLeft")
    painted(page, stiffness_loss=0.49, tooth=6)
    page.focus("#tab-database")
    page.keyboard.press("Enter")
    page.wait_for_selector("#cases tr[data-id]")
    page.focus("#cases th[data-name=fm4] button")
    page.keyboard.press("Enter")
    page.wait_for_selector("#cases th[data-name=fm4][aria-sort=ascending]")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.wait_for_selector("#shown:has-text('row ')")
    assert page.inner_text("#cases tr[aria-selected=true] td:first-child") in page.inner_text("#shown")


def test_the_page_as_a_file_moves_the_event_without_a_server(browser, tmp_path):
    path, complaints = tmp_path / "page.html", []
    write_static(sigdb.load_transmission("nasa-spiral-bevel"), "nasa-spiral-bevel", path)
    assert path.stat().st_size <= 5e6
    alone = browser.new_page(viewport={"width": 1280, "height": 800})
    alone.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    alone.on("pageerror", lambda error: complaints.append(str(error)))
    alone.on("request", lambda request: complaints.append(request.url) if not request.url.startswith("file:") else None)
    alone.goto(path.as_uri() + "#tooth=4&stiffness_loss=0.4")
    painted(alone, tooth=4)
    assert event_at(alone) in (4, 5)
    alone.click("#shown")
    alone.keyboard.press("ArrowLeft")
    painted(alone, tooth=3)
    assert event_at(alone) in (3, 4)
    alone.wait_for_url("**tooth=3**")
    alone.close()
    assert complaints == []
