"""Sends a request to a service on this machine and prints what one wants to know first. Needs
Python alone.

python3 examples/first_saving.py [FILE] [ADDRESS]
"""

from __future__ import annotations

import json
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


def ask(path: Path, address: str) -> dict[str, Any]:
    """The answer to the request in a file. Exits with the service's reason if there is none."""
    request = urllib.request.Request(
        f"{address}/optimize", path.read_bytes(), {"Content-Type": "application/json"}
    )
    try:
        with urllib.request.urlopen(request) as reply:
            answer: dict[str, Any] = json.load(reply)
            return answer
    except urllib.error.HTTPError as error:
        problem = json.load(error)
        where = [
            "/".join(map(str, each["loc"])) + ": " + each["msg"]
            for each in problem.get("errors", [])
        ]
        sys.exit("\n".join([problem["detail"], *where]))
    except urllib.error.URLError as error:
        sys.exit(f"No service answers at {address} ({error.reason}). Start one with `make serve`.")


def main() -> None:
    """Print the energy, what the controller's own motion needs, and what could still be saved."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "optimize" / "pick_to_place.json"
    address = sys.argv[2] if len(sys.argv) > 2 else "http://127.0.0.1:8000"
    answer = ask(path, address.rstrip("/"))
    total, bound = answer["energy"]["electrical"]["total"], answer["energy"]["lower_bound"]
    print(f"this motion            {total:5.0f} J in {answer['duration']:.2f} s")
    for each in answer["baselines"]:
        if each["saving"] is not None or each["name"] == "controller_default":
            needs = f"{each['electrical']:5.0f} J in {each['duration']:.2f} s"
            saved = each["reason"] or f"{100 * each['saving']:.0f} % saved in the same time"
            print(f"{each['name']:22s} {needs}  ({saved})")
    print(f"no motion needs less   {bound:5.0f} J")
    print(
        "turn to, in degrees:  ",
        [round(57.29577951308232 * q, 1) for q in answer["branch"]["goal"]["q"]],
    )
    print("greatest value / limit:", round(max(answer["certificate"]["worst_ratio"].values()), 3))
    for warning in answer.get("warnings", []):
        print("note:", warning)


if __name__ == "__main__":
    main()
