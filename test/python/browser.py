"""A headless Chromium, steered by its own protocol: https://chromedevtools.github.io/devtools-protocol."""

import base64
import functools
import io
import itertools
import json
import shutil
import subprocess
import time
import urllib.request

import numpy as np
import processes
from PIL import Image
from websockets.sync.client import connect

# A browser without a GPU is slow, and each look at a page takes its time.
wait_for = functools.partial(processes.wait_for, timeout=120, interval=0.1)

SIZE = 1280, 800  # of the page [pixels]
OPTIONS = [
    "--headless=new",
    "--no-sandbox",  # tests run as root in containers
    "--disable-dev-shm-usage",
    "--use-angle=swiftshader",  # WebGL without a GPU
    "--enable-unsafe-swiftshader",
    "--remote-debugging-port=0",
    "--window-size={},{}".format(*SIZE),
]


class Browser:
    """One page. `folder` is an empty one for the browser's files."""

    def __init__(self, folder, address):
        self._process = subprocess.Popen(
            [shutil.which("chromium"), *OPTIONS, f"--user-data-dir={folder}", address],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._ids = itertools.count(1)
        file = folder / "DevToolsActivePort"
        wait_for(lambda: file.exists() and len(file.read_text().split("\n")) == 2, "the browser")
        port = file.read_text().split("\n")[0]

        def page():
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as answer:
                return next((each for each in json.load(answer) if each["type"] == "page"), None)

        self._socket = connect(wait_for(page, "a page")["webSocketDebuggerUrl"], max_size=None)

    def close(self):
        self._socket.close()
        self._process.terminate()
        self._process.wait(timeout=20)

    def call(self, method, **parameters):
        number = next(self._ids)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv(timeout=60))
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]

    def evaluate(self, expression):
        """Returns the value of a JavaScript expression."""
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def text(self):
        """Returns the visible text, and what text fields contain."""
        return self.evaluate(
            "(document.body?.innerText ?? '') +"
            "Array.from(document.querySelectorAll('input,textarea'))"
            ".map(field => '\\n' + field.value).join('')"
        )

    def screenshot(self):
        """Returns the picture, shape (height, width, 3)."""
        png = self.call("Page.captureScreenshot", format="png")["data"]
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB"))

    def click(self, words):
        """Clicks the middle of the element with exactly this text, of a button if there is one, as
        soon as the page no longer moves it."""

        def settled():
            box = self._find(words)
            time.sleep(0.3)  # longer than from one change of the panel to the next
            return box if box == self._find(words) else None

        box = wait_for(settled, f"an element {words!r}")
        self.mouse("mousePressed", *box)
        self.mouse("mouseReleased", *box)

    def _find(self, words):
        return self.evaluate(
            f"""(() => {{
              const named = kinds => Array.from(document.querySelectorAll(kinds))
                .filter(each => each.innerText?.trim() === {json.dumps(words)}).pop();
              const element = named('button') ?? named('label,[role=option]') ?? named('*');
              if (!element) return null;
              element.scrollIntoView({{block: 'center'}});
              const box = element.getBoundingClientRect();
              return [box.x + box.width / 2, box.y + box.height / 2];
            }})()"""
        )

    def fill(self, label, text):
        """Replaces the content of the field beside a label, and waits until the page has sent it,
        which it does not do at once."""
        kind = wait_for(lambda: self._select(label), f"a field {label!r}")
        self.type(text)
        if kind == "INPUT":
            self.key("Enter", text="\r")
        time.sleep(0.5)

    def _select(self, label):
        """Selects the text of the field beside a label, and returns the field's kind; None if there
        is none, or if it cannot be typed in yet."""
        return self.evaluate(
            f"""(() => {{
              const label = Array.from(document.querySelectorAll('label'))
                .filter(each => each.innerText.trim() === {json.dumps(label)}).pop();
              if (!label) return null;
              const kinds = "textarea,input:not([type=hidden])";
              let row = label;
              while (!row.querySelector(kinds)) row = row.parentElement;
              const field = row.querySelector(kinds);
              field.scrollIntoView({{block: 'center'}});
              field.focus();
              field.select();
              return document.activeElement === field ? field.tagName : null;
            }})()"""
        )

    def open(self, folder, label):
        """Opens a folder with a field of this label. The page may still move what is clicked."""

        def is_open():
            if not self._select(label):
                self.click(folder)
                time.sleep(1)
            return self._select(label)

        wait_for(is_open, f"the folder {folder!r}")

    def choose(self, label, option):
        """Chooses from the list beside a label."""
        self.fill(label, "")
        self.evaluate("document.activeElement.click()")
        self.click(option)

    def mouse(self, kind, x, y):
        held = int(kind != "mouseReleased")
        self.call(
            "Input.dispatchMouseEvent",
            type=kind,
            x=x,
            y=y,
            button="left",
            buttons=held,
            clickCount=1,
        )

    def drag(self, begin, end, seconds=0.5, steps=10):
        """Presses at `begin`, moves to `end` and stays there. `release` ends the drag."""
        self.mouse("mousePressed", *begin)
        for step in range(1, steps + 1):
            share = step / steps
            x, y = (a + share * (b - a) for a, b in zip(begin, end))
            self.mouse("mouseMoved", x, y)
            time.sleep(seconds / steps)

    def release(self, x, y):
        self.mouse("mouseReleased", x, y)

    def key(self, key, code=None, text=""):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code or key, text=text)

    def type(self, text):
        self.call("Input.insertText", text=text)
