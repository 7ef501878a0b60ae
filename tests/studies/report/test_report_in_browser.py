"""Reports in headless Chromium: they load offline, sort, filter, draw their data, print."""

from __future__ import annotations

import base64
import csv
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import report_runs
from programs import required
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

from studies.main import main

WIDTH = 1200  # [px]
FLAGS = ("headless=new", "no-sandbox", "disable-gpu", "disable-background-networking")
MM = 1e3
ROUNDING = 1e-9  # relative: from metres to millimetres
HOSTILE = (
    "<script>window.caught=1</script>",
    "</script><script>window.caught=2</script>",
    "<img src=x onerror=window.caught=3>",
    "<a href='javascript:window.caught=4'>x</a> %{y} {{ 7 * 7 }}",
    "\" onmouseover='window.caught=5' \x00\x1b[31m \ud800",
)
SVG = (
    "<svg xmlns='http://www.w3.org/2000/svg' onload='window.caught=6'>"
    "<script>parent.caught=7</script><image href='https://example.org/x.png'/></svg>"
)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """One browser, without a network."""
    options = webdriver.ChromeOptions()
    options.binary_location = required("chromium", "chromium-browser", "google-chrome")
    for flag in FLAGS:
        options.add_argument(f"--{flag}")
    options.add_argument(f"--user-data-dir={tmp_path_factory.mktemp('profile')}")
    options.add_argument(f"--window-size={WIDTH},900")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(required("chromedriver")))
    driver.execute_cdp_cmd("Network.enable", {})
    offline = {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0}
    driver.execute_cdp_cmd("Network.emulateNetworkConditions", offline)
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Reports by what they are of."""
    folder = tmp_path_factory.mktemp("reports")
    one = report_runs.study(folder / "one")
    two = report_runs.study(folder / "two", report_runs.rows(3e-4)[:-1], hardware="bench")
    long = report_runs.study(folder / "long", report_runs.rows(cases=60))
    runs = report_runs.study_file(folder / "mine")
    tuned = report_runs.tuning(folder / "tuned")
    of = {"one": [one], "pair": [one, two], "long": [long], "series": [runs], "tuned": [tuned]}
    of["hostile"] = [hostile(folder / HOSTILE[2].replace("/", "")), one]
    for name, given in of.items():
        words = ["report", *map(str, given), "--out", str(folder / f"{name}.html")]
        assert main(words) == 0
    return {name: folder / f"{name}.html" for name in of}


def hostile(folder: Path) -> Path:
    """Return a run of which everything that is text would like to be code."""
    found = [report_runs.Row(text, text, 1e-3, 9e-4, 2e-3, 0.0, text) for text in HOSTILE[:4]]
    text = " ".join(HOSTILE)
    report_runs.study(folder, found, question=text, answer=text, hardware=text)
    settings = {text: {text: [text]}}
    config = report_runs.config(
        ["run", *HOSTILE], configuration=settings, question=text, answer=text, machine=settings
    )
    toml = "title = '''" + HOSTILE[1] + "'''\n"
    files = {"config.json": config, "study.toml": toml, f"figures/{HOSTILE[2]}.svg": SVG}
    return report_runs.written(folder, files)


def opened(browser: Any, path: Path) -> Any:
    """Return the browser with a page that has loaded without a word in its console."""
    browser.get_log("browser")
    browser.get(path.as_uri())
    assert browser.get_log("browser") == []
    return browser


def column(browser: Any, table: str, number: int, hidden: bool = False) -> list[str]:
    """Return a column of a table as it stands, without the rows that are hidden."""
    rows = browser.find_elements(By.CSS_SELECTOR, f"#{table} tbody tr")
    shown = [row for row in rows if hidden or row.is_displayed()]
    return [row.find_elements(By.TAG_NAME, "td")[number].text for row in shown]


def data(browser: Any, key: str) -> list[dict[str, Any]]:
    """Return what plotly has drawn."""
    taken = "({x: d.x, y: d.y, name: d.name, high: d.error_x?.array, visible: d.visible})"
    script = f"return document.getElementById(arguments[0]).data.map((d) => {taken})"
    found: list[dict[str, Any]] = browser.execute_script(script, key)
    return found


def test_a_report_loads_offline_and_fetches_nothing(browser: Any, pages: dict[str, Path]) -> None:
    for name in ("one", "pair", "series", "tuned"):
        opened(browser, pages[name])
        script = "return performance.getEntriesByType('resource').map((each) => each.name)"
        assert [url for url in browser.execute_script(script) if url[:5] != "data:"] == []
        links = browser.find_elements(By.CSS_SELECTOR, "nav a")
        targets = [link.get_attribute("href").partition("#")[2] for link in links]
        assert all(browser.find_elements(By.ID, target) for target in targets) and targets
    opened(browser, pages["one"])
    assert browser.find_element(By.TAG_NAME, "h1").text == report_runs.QUESTION
    assert browser.find_element(By.CLASS_NAME, "answer").text == report_runs.ANSWER
    widths = "return [...document.images].map((image) => image.naturalWidth)"
    assert browser.execute_script(widths) == [900]  # 3 inches at 300 dpi


def test_a_click_sorts_by_number_and_a_third_goes_back(
    browser: Any, pages: dict[str, Path]
) -> None:
    opened(browser, pages["one"])
    head = browser.find_elements(By.CSS_SELECTOR, "#run-1-table-1 th")[2]
    button = head.find_element(By.TAG_NAME, "button")
    before = column(browser, "run-1-table-1", 2)
    numbers = sorted(float(text) for text in before if text != "-")
    assert sorted(before) != sorted(before, key=lambda text: (text == "-", text and len(text)))
    orders = []
    for key in (None, "\n", " "):  # a click, then by the keyboard
        button.click() if key is None else button.send_keys(key)
        orders.append((head.get_attribute("aria-sort"), column(browser, "run-1-table-1", 2)))
    (up, rising), (down, falling), (none, back) = orders
    assert (up, down, none) == ("ascending", "descending", "none")
    assert [float(text) for text in rising[:-1]] == numbers and rising[-1] == "-"
    assert [float(text) for text in falling[:-1]] == numbers[::-1] and falling[-1] == "-"
    assert back == before


def test_filters_hide_rows(browser: Any, pages: dict[str, Path]) -> None:
    opened(browser, pages["one"])
    bar = browser.find_element(By.CSS_SELECTOR, "#run-1-tables .toolbar")
    words = bar.find_element(By.TAG_NAME, "input")
    words.send_keys("CASE 1")
    assert column(browser, "run-1-table-1", 0) == ["case 1", "case 1"]
    by_plant = Select(bar.find_elements(By.TAG_NAME, "select")[-1])
    by_plant.select_by_visible_text("chain")
    assert column(browser, "run-1-table-1", 1) == ["chain"]
    assert bar.find_element(By.CSS_SELECTOR, "[role=status]").text == "1 of 13 rows"
    words.clear()
    words.send_keys(" ")
    assert set(column(browser, "run-1-table-1", 1)) == {"chain"}
    assert len(column(browser, "run-1-table-1", 1)) == 7


def test_figures_hold_the_numbers_of_the_files(browser: Any, pages: dict[str, Path]) -> None:
    opened(browser, pages["one"])
    with (pages["one"].parent / "one" / "results.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["envelope"]]
    for drawn, plant in zip(data(browser, "run-1-intervals-1"), report_runs.PLANTS, strict=True):
        own = [row for row in rows if row["plant"] == plant]
        envelopes = [MM * float(row["envelope"]) for row in own]
        ends = [MM * float(row["envelope_high"]) for row in own]
        assert drawn["name"] == plant.replace("-", " ") and drawn["visible"] is True
        assert drawn["x"] == pytest.approx(envelopes, rel=ROUNDING)
        above = [x + more for x, more in zip(drawn["x"], drawn["high"], strict=True)]
        assert above == pytest.approx(ends, rel=ROUNDING)
    assert browser.execute_script("return document.querySelectorAll('.main-svg .point').length")


def test_time_series_and_convergence_are_drawn(browser: Any, pages: dict[str, Path]) -> None:
    opened(browser, pages["series"])
    drawn = data(browser, "run-1-traces")
    shown = [each for each in drawn if each["visible"]]
    assert len(drawn) == 2 * len(shown) == 16  # two cases, two plants, four panels
    assert len(shown[0]["x"]) == report_runs.SAMPLES // 2  # as the note says
    assert "One sample in 2 is drawn" in browser.find_element(By.ID, "run-1-charts").text
    assert shown[2]["y"] == pytest.approx([1.0] * len(shown[0]["x"]))  # torque 1 of run 0
    opened(browser, pages["tuned"])
    best = next(
        each for each in data(browser, "run-1-convergence") if each["name"] == "best so far"
    )
    assert best["y"] == pytest.approx([2e-4, 1e-4])


def test_two_runs_show_their_differences(browser: Any, pages: dict[str, Path]) -> None:
    opened(browser, pages["pair"])
    cells = dict(zip(*(column(browser, "numbers-2", i) for i in (1, 3)), strict=True))
    verdicts = column(browser, "numbers-2", 6)
    assert cells["case 5, assumed modes"] == "0.0010 [0.0008, 0.0012]"
    assert column(browser, "numbers-2", 4)[0] == "0.0363 [0.0361, 0.0365]"
    assert column(browser, "numbers-2", 5)[0] == "+0.0003"
    assert set(verdicts) == {"overlap"} and len(verdicts) == 12
    one, two = data(browser, "differences-2")
    moved = [b - a for a, b in zip(one["x"], two["x"], strict=True)]
    assert moved == pytest.approx([MM * 3e-4] * 12, rel=1e-6)


def test_hostile_texts_are_texts(browser: Any, pages: dict[str, Path]) -> None:
    opened(browser, pages["hostile"])
    assert browser.execute_script("return window.caught === undefined")
    own = "return [...document.scripts].map((each) => each.type)"
    assert browser.execute_script(own) == ["application/json", "", "", ""]
    marked = "img:not([src^='data:']), a[href^='javascript'], [onerror], [onload], [onmouseover]"
    assert browser.find_elements(By.CSS_SELECTOR, marked) == []
    text = browser.find_element(By.TAG_NAME, "main").text
    assert HOSTILE[0] in text and "{{ 7 * 7 }}" in text
    drawn = browser.find_element(By.ID, "run-1-intervals-1").text
    assert HOSTILE[0] in drawn and HOSTILE[3][:20] in drawn
    time.sleep(0.2)  # for what would have been loaded late
    assert browser.execute_script("return window.caught === undefined")


def test_the_browser_refuses_scripts_that_are_not_ours(
    browser: Any, pages: dict[str, Path], tmp_path: Path
) -> None:
    """Were a text ever to become markup: the policy stands behind the escapes."""
    page = pages["one"].read_text(encoding="utf-8")
    broken = page.replace("</main>", f"{HOSTILE[0]}{HOSTILE[2]}</main>")
    assert broken != page
    (tmp_path / "broken.html").write_text(broken, encoding="utf-8")
    browser.get((tmp_path / "broken.html").as_uri())
    assert browser.execute_script("return window.caught === undefined")
    assert "Content Security Policy" in str(browser.get_log("browser"))


def test_a_report_prints_with_heads_on_every_page(
    browser: Any, pages: dict[str, Path], tmp_path: Path
) -> None:
    opened(browser, pages["long"])
    printed = browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
    pdf = tmp_path / "report.pdf"
    pdf.write_bytes(base64.b64decode(printed["data"]))
    words = [required("pdftotext"), "-layout", str(pdf), "-"]
    done = subprocess.run(words, capture_output=True, check=True)
    sheets = done.stdout.decode().split("\f")[:-1]
    assert len(sheets) > 2
    assert report_runs.QUESTION in sheets[0]
    holding = [sheet for sheet in sheets if "case 2" in sheet and "assumed-modes" in sheet]
    assert len(holding) >= 2
    assert all("envelope" in sheet and "plant" in sheet for sheet in holding)
    assert "Filter" not in done.stdout.decode()
