"""Who may talk to the page of `notchbend app`, and names that are data of the page and not its template."""

import asyncio
import http.client
import json
import os
import re
import signal
import stat
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from urllib.parse import parse_qs, urlsplit
from urllib.request import url2pathname

import pytest
from browser import chromium, keep_picture, listen, require_browser, serving

from fem_models.rig import preset
from hysteresis.records.record_file import read_record, write_record
from studies.app import guard
from studies.app.files import rig_text
from studies.bench_record import SHIPPED

EVIL = "{{7*7}} <img src=x onerror=alert(1)> {{constructor.constructor('alert(2)')()}} `${alert(3)}`'\""


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """Address of an app whose rig and record have hostile names."""
    require_browser()
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "rig.toml").write_text(rig_text(replace(preset("du2018"), name=EVIL)))
    write_record(replace(read_record(SHIPPED), title=EVIL + "{{6*7}}"), folder / "bench.csv")
    with serving("--rig", str(folder / "rig.toml"), "--record", str(folder / "bench.csv")) as address:
        yield address


def ask(address, path="/", *, method="GET", body=None, **headers):
    """Status and text of a request; ``headers`` replace those of a browser, None leaves one out."""
    port = urlsplit(address).port
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.putrequest(method, path, skip_host=True)
    for name, value in ({"Host": f"127.0.0.1:{port}"} | headers).items():
        if value is not None:
            connection.putheader(name.replace("_", "-"), value)
    content = b"" if body is None else json.dumps(body).encode()
    connection.putheader("Content-Length", str(len(content)))
    connection.endheaders(content)
    answer = connection.getresponse()
    found = answer.status, answer.read().decode(errors="replace"), dict(answer.getheaders())
    connection.close()
    return found


def token_of(address):
    return parse_qs(urlsplit(address).query)["token"][0]


def test_the_printed_address_is_answered_and_framed_by_nobody(served):
    status, text, headers = ask(served, f"/index.html?token={token_of(served)}")
    assert status == 200
    assert "<html" in text
    assert headers["X-Frame-Options"] == "DENY"
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert "Access-Control-Allow-Origin" not in headers


@pytest.mark.parametrize("path", ["/", "/index.html", "/ws", "/?token=", "/index.html?token=wrong", "/?token=%C3%A4"])
def test_the_page_needs_the_token(served, path):
    status, text, _ = ask(served, path)
    assert status == 403
    assert "Open the address that notchbend app printed" in text


@pytest.mark.parametrize("body", [None, {}, {"token": ""}, {"token": 1}, {"token": "wrong"}, [], "text"])
def test_the_secret_of_the_session_needs_the_token(served, body):
    status, text, _ = ask(served, "/paraview/", method="POST", body=body)
    assert status == 403
    assert "secret" not in text


def test_the_secret_is_given_to_the_page_that_was_opened(served):
    status, text, _ = ask(served, "/paraview/", method="POST", body={"token": token_of(served)})
    assert status == 200
    assert len(json.loads(text)["secret"]) == 32


@pytest.mark.parametrize("host", [None, "evil.example", "evil.example:80", "127.0.0.1", "127.0.0.1:1", "[::1]:8765"])
def test_a_foreign_host_is_refused_even_with_the_token(served, host):
    """A foreign name that resolves to 127.0.0.1 makes a page of the browser one of the same origin."""
    for path, method in ((f"/?token={token_of(served)}", "GET"), ("/paraview/", "POST"), ("/vue.global.js", "GET")):
        status, text, _ = ask(served, path, method=method, body={"token": token_of(served)}, Host=host)
        assert status in (400, 403)
        assert "secret" not in text


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1:{port}"])
def test_a_foreign_origin_is_refused_even_with_the_token(served, origin):
    origin = origin.format(port=urlsplit(served).port)
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13"}
    path = f"/ws?token={token_of(served)}"
    assert ask(served, path, Origin=origin, **upgrade, Sec_WebSocket_Key="dGhlIHNhbXBsZSBub25jZQ==")[0] == 403
    assert ask(served, "/paraview/", method="POST", body={"token": token_of(served)}, Origin=origin)[0] == 403


def test_tokens_and_secrets_differ_from_run_to_run():
    guards = [guard.Guard() for _ in range(3)]
    assert len({one.token for one in guards} | {one.secret for one in guards}) == 6
    assert all(re.fullmatch("[0-9a-f]{48}", one.token) for one in guards)


def test_names_are_shown_as_they_are(served):
    """Nothing of them is evaluated, no dialog opens, no image is loaded; in either style, wide and narrow."""
    with chromium() as running:
        for scheme, width in (("light", 1400), ("dark", 420)):
            page = running.new_context(color_scheme=scheme, viewport={"width": width, "height": 1000}).new_page()
            heard, dialogs = listen(page), []
            page.on("dialog", lambda dialog, into=dialogs: (into.append(dialog.message), dialog.dismiss()))
            page.goto(served)
            page.wait_for_selector(".loop .now", timeout=30_000)
            page.wait_for_timeout(500)
            assert page.locator("h1").inner_text() == EVIL
            assert page.title() == f"notchbend: {EVIL}"
            assert f"{EVIL}{{{{6*7}}}}" in page.locator(".legend").inner_text()
            assert page.locator("img").count() == 0
            assert (dialogs, heard.errors, heard.hosts) == ([], [], [])
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            keep_picture(page, f"app-hostile-{scheme}-{width}")
            page.close()


def test_no_more_pages_than_the_limit(served):
    import aiohttp

    port = urlsplit(served).port

    async def crowd() -> tuple[list[int], int]:
        async with aiohttp.ClientSession() as session:
            address = f"ws://127.0.0.1:{port}/ws?token={token_of(served)}"
            open_pages = [await session.ws_connect(address) for _ in range(guard.PAGES)]
            async with session.get(served) as answer:
                refused = [answer.status]
                said = await answer.text()
            assert f"{guard.PAGES} pages are open" in said
            with pytest.raises(aiohttp.WSServerHandshakeError) as error:
                await session.ws_connect(address)
            refused.append(error.value.status)
            for one in open_pages:
                await one.close()
            await asyncio.sleep(0.3)
            async with session.get(served) as answer:
                return refused, answer.status

    assert asyncio.run(crowd()) == ([503, 503], 200)


@pytest.fixture
def opening(tmp_path):
    """An app whose browser is a command that writes its arguments and stays; its address, and the arguments."""
    script, said = tmp_path / "browser", tmp_path / "said"
    lines = ["#!/bin/sh", "exec >/dev/null 2>&1", f'echo "$@" > {said}.new', f"mv {said}.new {said}"]
    script.write_text("\n".join([*lines, f"while [ -e {said} ]; do sleep 0.1; done\n"]))
    script.chmod(0o700)
    command = [sys.executable, "-c", "from studies.commands import main; main()", "app", "--port", "0"]
    environment = {**os.environ, "BROWSER": str(script)}
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as app:
        address = app.stdout.readline().split()[-1]
        for _ in range(100):
            if said.exists():
                break
            time.sleep(0.1)
        yield app, address, said.read_text().strip()
        app.kill()
    said.unlink()


def test_the_token_is_on_no_command_line(opening):
    """Every user of the machine can read the command lines of all: only the file that the browser opens has it."""
    app, address, given = opening
    shown = [line.read_bytes() for line in Path("/proc").glob("[0-9]*/cmdline") if line.exists()]
    assert any(given.encode() in line for line in shown)
    assert not any(token_of(address).encode() in line for line in shown)
    page = Path(url2pathname(urlsplit(given).path))
    assert f'content="0;url={address}"' in page.read_text()
    assert [stat.S_IMODE(one.stat().st_mode) for one in (page, page.parent)] == [0o600, 0o700]
    app.terminate()
    app.wait(timeout=10)
    assert not page.parent.exists()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_browser_that_stays_does_not_keep_the_app(opening, number):
    app, *_ = opening
    app.send_signal(number)
    _, error = app.communicate(timeout=10)
    assert (app.returncode, error) == (0, "")
