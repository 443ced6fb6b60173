"""A headless Chromium for tests: the system's, driven by Playwright."""

import shutil

from playwright.sync_api import sync_playwright

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)
OPTIONS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--disable-dev-shm-usage"]
# So long an answer may take on a busy machine [ms].
PATIENCE = 60_000
NEWS = ("Network.requestWillBeSent", "Runtime.exceptionThrown", "Runtime.consoleAPICalled",
        "Log.entryAdded")  # fmt: skip


class Browser:
    """A Chromium with one tab; `close` ends it.

    Attributes:
        events: what the page asked for and complained of since it was opened.
        send: sends a command of the DevTools protocol and returns its result.
    """

    def __init__(self, folder):
        """Start it with its profile in an empty folder."""
        self._driver = sync_playwright().start()
        self._context = self._driver.chromium.launch_persistent_context(
            folder, executable_path=CHROMIUM, args=OPTIONS, viewport=None
        )
        self._page = self._context.pages[0]
        self._page.set_default_timeout(PATIENCE)
        self._session = self._context.new_cdp_session(self._page)
        self.events = []
        for domain in ("Page", "Runtime", "Log", "Network", "Accessibility"):
            self._session.send(f"{domain}.enable")
        for name in NEWS:
            self._session.on(name, lambda told, name=name: self._note(name, told))

    def _note(self, name, told):
        self.events.append({"method": name, "params": told})

    def send(self, method, **parameters):
        """Send a command and return its result."""
        return self._session.send(method, parameters)

    def open(self, address, width=1440, height=900):
        """Open a page in a window of this size."""
        self.resize(width, height)
        self._page.goto("about:blank")
        self.events.clear()
        self._page.goto(address)

    def before_every_page(self, script):
        """Run a script in every page from now on, before any of its own."""
        self._page.add_init_script(script)

    def resize(self, width, height):
        """Give the window a size; a narrow one is a phone's."""
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=width < 600)  # fmt: skip

    def run(self, expression):
        """Return what an expression in the page comes to, promises awaited."""
        found = self.send("Runtime.evaluate", expression=expression, awaitPromise=True,
                          returnByValue=True, userGesture=True)  # fmt: skip
        if "exceptionDetails" in found:
            raise RuntimeError(found["exceptionDetails"]["exception"].get("description", "thrown"))
        return found["result"].get("value")

    def press(self, key):
        """Press a key and let it go."""
        self._page.keyboard.press(key)

    def close(self):
        """End it."""
        self._context.close()
        self._driver.stop()
