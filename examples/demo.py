"""Start the service on a free port of this machine, ask it for one case, stop it.

python examples/demo.py
"""

import json
import os
import re
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import urlencode

CASE = {"mu0": "0.3", "Fz": "10", "k": "1e6", "y0": "2e-6", "f": "20e3", "v0": "0.01"}
UNITS = {"mu0": "-", "Fz": "N", "k": "N/m", "y0": "m", "f": "Hz", "v0": "m/s"}
WAIT_S = 60.0


def until_ready(server: subprocess.Popen[bytes], log: Path) -> str:
    """The service's address, once it is ready."""
    started = time.monotonic()
    while time.monotonic() < started + WAIT_S and server.poll() is None:
        address = re.search(r"running on (http://[^ ]+:\d+) ", log.read_text("utf-8"))
        try:
            if address and urllib.request.urlopen(f"{address[1]}/readyz", timeout=10):
                return address[1]
        except OSError:
            pass
        time.sleep(0.05)
    raise SystemExit(f"The service does not start:\n{log.read_text('utf-8')}")


def main() -> None:
    """Print question and answer."""
    # the defaults, not the settings of the user's shell
    variables = {
        name: value for name, value in os.environ.items() if not name.startswith("MUMACRO_")
    }
    with TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        with log.open("wb") as sink:
            command = [sys.executable, "-m", "service", "--port", "0"]
            server = subprocess.Popen(command, env=variables, stdout=sink, stderr=sink)
        try:
            address = f"{until_ready(server, log)}/v1/mu-macro?{urlencode(CASE)}"
            print(
                "Question: "
                + ", ".join(f"{name} = {value} [{UNITS[name]}]" for name, value in CASE.items())
            )
            print(f"GET {address}")
            with urllib.request.urlopen(address, timeout=10) as reply:
                answer = json.load(reply)
        finally:
            server.terminate()
            server.wait(30)
    print(json.dumps(answer, indent=2))
    print(f"Answer:   mu_macro = {answer['mu_macro']:.12g} [-]")
    print("Next:     python3 dev.py serve, then open http://127.0.0.1:8000")


if __name__ == "__main__":
    main()
