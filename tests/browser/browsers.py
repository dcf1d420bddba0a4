"""Headless Chromium, driven by its own protocol over a pipe, without a port or a package."""

import base64
import json
import os
import shutil
import subprocess
from contextlib import contextmanager

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
PROBED = """new Promise((done) => {
  const wait = setInterval(() => {
    const probe = document.getElementById("probe");
    if (probe) { clearInterval(wait); done(probe.textContent); }
  }, 20);
})"""


class Page:
    """A page in a browser: methods of the protocol by name."""

    def __init__(self, reader, writer):
        self.reader, self.writer, self.sent, self.session = reader, writer, 0, None
        self.events = []

    def call(self, method, **parameters):
        self.sent += 1
        message = {"id": self.sent, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.writer.write(json.dumps(message).encode() + b"\0")
        self.writer.flush()
        while True:
            answer = self._next()
            if answer.get("id") == self.sent:
                assert "error" not in answer, answer
                return answer["result"]

    def wait(self, *events):
        """Wait for these events of the page, in this order."""
        for event in events:
            while event not in self.events:
                self._next()
            del self.events[: self.events.index(event) + 1]

    def _next(self):
        """The next message; events come between the answers."""
        text = bytearray()
        while (byte := self.reader.read(1)) != b"\0":
            assert byte, "the browser has gone"
            text += byte
        message = json.loads(text)
        if "method" in message and message.get("sessionId") == self.session:
            self.events.append(message["method"])
        return message

    def run(self, script):
        """The value of a script, which may be a promise."""
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def probe(self):
        """The answer that a script has put into the page, as base64 of JSON in an element `probe`."""
        return json.loads(base64.b64decode(self.run(PROBED)))

    def inside(self, script):
        """The value of a script in the page's sandboxed frame, which is a target of its own."""
        whole, frames = self.session, self.call("Target.getTargets")["targetInfos"]
        (frame,) = (one["targetId"] for one in frames if one["type"] == "iframe")
        self.session = self.call("Target.attachToTarget", targetId=frame, flatten=True)["sessionId"]
        try:
            return self.run(script)
        finally:
            self.session = whole


class Browser:
    """A browser that several tests share, because its start takes longer than a page."""

    def __init__(self, reader, writer):
        self.connection = Page(reader, writer)

    @contextmanager
    def page(self, address, height=1600):
        """The page at an address, with cookies and storage of its own."""
        page = self.connection
        context = page.call("Target.createBrowserContext")["browserContextId"]
        target = page.call("Target.createTarget", url="about:blank", browserContextId=context)["targetId"]
        page.session = page.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page.events = []
        try:
            page.call("Page.enable")
            size = {"width": 1200, "height": height, "deviceScaleFactor": 1, "mobile": False}
            page.call("Emulation.setDeviceMetricsOverride", **size)
            page.call("Page.navigate", url=address)
            page.wait("Page.frameNavigated", "Page.loadEventFired")
            yield page
        finally:
            page.session = None
            page.call("Target.disposeBrowserContext", browserContextId=context)


@contextmanager
def started(folder):
    """A browser whose profile is in a folder."""
    to_read, to_write = os.pipe()
    from_read, from_write = os.pipe()
    # The protocol wants the descriptors 3 and 4.
    command = f'exec "$@" 3<&{to_read} 4>&{from_write}'
    browser = subprocess.Popen(
        ["bash", "-c", command, "bash", CHROMIUM, *FLAGS, f"--user-data-dir={folder}/profile",
         "--remote-debugging-pipe", "about:blank"],
        pass_fds=(to_read, from_write), stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(to_read)
    os.close(from_write)
    try:
        with os.fdopen(to_write, "wb") as writer, os.fdopen(from_read, "rb") as reader:
            found = Browser(reader, writer)
            yield found
            found.connection.call("Browser.close")
    finally:
        browser.kill()
        browser.wait()
