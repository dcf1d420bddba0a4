"""Headless Chromium, driven by its own protocol over a pipe, without a port or a package."""

import json
import os
import subprocess
from contextlib import contextmanager

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip


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
            answer = json.loads(self._next())
            # Events come in between.
            self.events.append(answer.get("method"))
            if answer.get("id") == self.sent:
                assert "error" not in answer, answer
                return answer["result"]

    def wait(self, *events):
        """Wait for these events of the browser, in this order."""
        for event in events:
            while event not in self.events:
                self.events.append(json.loads(self._next()).get("method"))
            del self.events[: self.events.index(event) + 1]

    def _next(self):
        text = bytearray()
        while (byte := self.reader.read(1)) != b"\0":
            assert byte, "the browser has gone"
            text += byte
        return bytes(text)

    def run(self, script):
        """The value of a script, which may be a promise."""
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def inside(self, script):
        """The value of a script in the page's sandboxed frame, which is a target of its own."""
        whole, frames = self.session, self.call("Target.getTargets")["targetInfos"]
        (frame,) = (one["targetId"] for one in frames if one["type"] == "iframe")
        self.session = self.call("Target.attachToTarget", targetId=frame, flatten=True)["sessionId"]
        try:
            return self.run(script)
        finally:
            self.session = whole


@contextmanager
def browsing(chromium, address, folder):
    """The page at an address, in a browser whose profile is in a folder."""
    to_read, to_write = os.pipe()
    from_read, from_write = os.pipe()
    # The protocol wants the descriptors 3 and 4.
    command = f'exec "$@" 3<&{to_read} 4>&{from_write}'
    browser = subprocess.Popen(
        ["bash", "-c", command, "bash", chromium, *FLAGS, f"--user-data-dir={folder}/profile",
         "--remote-debugging-pipe", "about:blank"],
        pass_fds=(to_read, from_write), stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(to_read)
    os.close(from_write)
    try:
        with os.fdopen(to_write, "wb") as writer, os.fdopen(from_read, "rb") as reader:
            page = Page(reader, writer)
            target = page.call("Target.createTarget", url="about:blank")["targetId"]
            page.session = page.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
            page.call("Page.enable")
            page.call("Page.navigate", url=address)
            page.wait("Page.frameNavigated", "Page.loadEventFired")
            yield page
            page.session = None
            page.call("Browser.close")
    finally:
        browser.kill()
        browser.wait()
