"""The page from the drop to the download, on the server's side and in a real browser."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib import image

import friction_bayes as fb
from browser import needs_browser, opened
from decays import SYSTEM, short_decay

pytest.importorskip("panel", reason="the extra app is not installed")
ANSWERED_MS = 240_000
SOON_MS = 30_000


def dropped(page: Any, **files: bytes | str) -> None:
    asyncio.run(page._dropped(SimpleNamespace(new=files)))


def test_a_file_is_kept_under_its_own_name_and_gone_with_the_visitor(tmp_path: Path) -> None:
    from friction_bayes.app.page import Page

    folder = tmp_path / "visitor"
    folder.mkdir()
    page = Page(folder)
    record = fb.write_record(short_decay(seed=1), tmp_path / "decay.csv").read_text()
    dropped(page, **{"../..\\decay.csv": record})
    assert [path.name for path in folder.iterdir()] == ["decay.csv"]
    assert "over time_s [s]" in page._read.object
    assert not page._button.disabled
    dropped(page, **{"<b>.csv": b"1,2"})
    assert "&lt;b&gt;.csv" in page._read.object
    assert page._button.disabled
    page.close()
    assert not folder.exists()


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a page that is served; its folder is gone after the interrupt."""
    temporary = tmp_path_factory.mktemp("temporary")
    server = subprocess.Popen(
        [sys.executable, "-m", "friction_bayes", "app", "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"TMPDIR": str(temporary)},
    )
    assert server.stdout is not None
    found = re.search(r"http://127\.0\.0\.1:\d+", server.stdout.readline())
    assert found is not None
    yield found[0]
    server.send_signal(signal.SIGINT)
    _, complaints = server.communicate(timeout=20)
    assert (server.returncode, complaints) == (0, "")
    assert list(temporary.glob("friction-bayes-*")) == []


def test_no_other_computer_reaches_it(address: str) -> None:
    port = int(address.rpartition(":")[2])
    with socket.create_connection(("127.0.0.1", port)):
        pass
    # another address of this machine, as a neighbour would use
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.2", port)).close()


def text_of(rows: np.ndarray, heading: str, mark: str = ",") -> str:
    lines = [mark.join(f"{value:.7f}" for value in row) for row in rows]
    return "\n".join([heading, *lines] if heading else lines) + "\n"


@pytest.fixture
def raw(tmp_path: Path) -> dict[str, Path]:
    """Five recordings as laboratories have them."""
    record = short_decay(duration=5.0, seed=3)
    rows = np.column_stack([record["time"].values, record.values])
    pendulum = fb.Pendulum(mass=0.2, length=0.5)
    swing = fb.simulate(
        pendulum,
        friction=2e-3,
        initial_displacement=0.4,
        duration=10.0,
        sampling_rate=100.0,
        noise_sd=1e-3,
        seed=4,
    )
    angles = np.column_stack([swing["time"].values, np.degrees(swing.values)])
    files = {
        "own.csv": text_of(rows, "time_s,displacement_m"),
        "german.csv": text_of(rows * [1.0, 1e3], "Zeit (s);Signal", ";").replace(".", ","),
        "bare.txt": text_of(rows, "", "\t"),
        "angle.csv": text_of(angles, "Time (s),Angle (deg)"),
    }
    paths = {name: tmp_path / name for name in files}
    for name, text in files.items():
        paths[name].write_text(text)
    return paths | {"stored.nc": fb.write_record(record, tmp_path / "stored.nc")}


def choose(browser: Any, **fields: str) -> None:
    for name, value in fields.items():
        label = name.replace("_", " ")
        field = browser.get_by_label(re.compile(rf"^{label}( \[.*\])?$")).first
        if field.evaluate("each => each.tagName") == "SELECT":
            field.select_option(label=value)
        else:
            field.fill(value)
            field.press("Enter")


def shades(picture: bytes) -> int:
    """Colours in a picture, few of a frame that stays blank."""
    pixels = image.imread(BytesIO(picture))
    return len(np.unique(pixels.reshape(-1, pixels.shape[-1]), axis=0))


@needs_browser
def test_from_the_drop_to_the_download(address: str, raw: dict[str, Path], tmp_path: Path) -> None:
    said = {
        "german.csv": {"signal_column": "Signal", "quantity": "displacement", "unit": "mm"},
        "bare.txt": {"time_column": "0", "signal_column": "1", "quantity": "displacement", "unit": "m"},
    }
    with opened(viewport={"width": 1200, "height": 1000}) as browser:
        asked: list[str] = []
        browser.on("request", lambda request: asked.append(request.url))
        browser.goto(address)
        taken_away = browser.locator(".filepond--action-revert-item-processing")
        for name, path in raw.items():
            if taken_away.count():
                taken_away.click()
                browser.get_by_text("drop a file").wait_for(timeout=SOON_MS)
            browser.locator("input[type=file]").set_input_files(path)
            browser.get_by_text("the file says").wait_for(timeout=SOON_MS)
            for field, value in said.get(name, {}).items():
                choose(browser, **{field: value})
            browser.get_by_text("samples, ").wait_for(timeout=SOON_MS)
            if name == "stored.nc":
                plot = browser.locator(".bk-Canvas").first
                plot.click(position={"x": 300, "y": 150})
                browser.get_by_text(re.compile(r"[1-9]\.\d+ to 4\.99")).wait_for(timeout=SOON_MS)
            if name == "angle.csv":
                choose(browser, mass="0.2", length="0.5")
            else:
                choose(browser, what_swings="mass on a spring")
                choose(browser, mass=f"{SYSTEM.mass}", stiffness=f"{SYSTEM.stiffness}")
            browser.get_by_role("button", name="Find friction").click()
            browser.get_by_text("Friction is").first.wait_for(timeout=ANSWERED_MS)
            assert f"friction-bayes estimate {name} " in browser.locator("pre").first.inner_text()
            with browser.expect_download() as download:
                browser.get_by_text("Download the report").click()
            assert download.value.suggested_filename == f"{path.stem}_report.html"
            download.value.save_as(tmp_path / "downloaded.html")
            assert "<h1>Friction of " in (tmp_path / "downloaded.html").read_text(encoding="utf-8")
        assert shades(browser.locator("iframe").screenshot()) > 50
        assert all(url.startswith((address, "data:", "blob:", "about:")) for url in asked)


@needs_browser
def test_wrong_files_are_answered_on_the_page(address: str, tmp_path: Path) -> None:
    still = text_of(np.column_stack([np.arange(50.0), np.ones(50)]), "time_s,displacement_m")
    wrong = {
        "empty.csv": (b"", "the file is empty"),
        "picture.csv": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "picture.csv"),
        "notes.docx": (b"PK\x03\x04", "unknown suffix"),
        "still.csv": (still.encode(), "the signal is constant"),
        "words.csv": (b"time_s,displacement_m\n0,1\n1,oops\n", "row 3"),
    }
    with opened() as browser:
        browser.goto(address)
        for name, (content, words) in wrong.items():
            (tmp_path / name).write_bytes(content)
            browser.locator("input[type=file]").set_input_files(tmp_path / name)
            browser.get_by_role("alert").filter(has_text=words).wait_for(timeout=SOON_MS)
            assert browser.get_by_role("button", name="Find friction").is_disabled()


@needs_browser
@pytest.mark.parametrize("width", [400, 1200])
def test_axe_finds_no_barrier(width: int, address: str, raw: dict[str, Path]) -> None:
    axe = pytest.importorskip(
        "axe_core_python.sync_playwright", reason="barriers are found by axe-core-python"
    )
    with opened(viewport={"width": width, "height": 900}, bypass_csp=True) as browser:
        browser.goto(address)
        browser.locator("input[type=file]").set_input_files(raw["own.csv"])
        browser.get_by_text("samples, ").wait_for(timeout=SOON_MS)
        assert axe.Axe().run(browser)["violations"] == []
        assert browser.evaluate("document.documentElement.scrollWidth") == width
        # axe does not see white on white
        button = browser.get_by_role("button", name="Find friction")
        assert shades(button.screenshot()) > 20
        choose(browser, mass=f"{SYSTEM.mass}", stiffness=f"{SYSTEM.stiffness}")
        button.click()
        stop = browser.get_by_role("button", name="Stop")
        stop.wait_for(timeout=SOON_MS)
        assert browser.evaluate("document.documentElement.scrollWidth") == width
        stop.click()
